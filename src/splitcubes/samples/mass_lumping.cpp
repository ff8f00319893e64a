#include <splitcubes/samples/lumped_rows.h>
#include <splitcubes/samples/mass_centres.h>
#include <splitcubes/samples/mass_lumping.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// The volume of all nodes is below 2^57 units, so that sums of shares up to 5 in total do not overflow.
double unit_of(std::span<const double> volumes) {
    double total = 0;
    for (const double volume : volumes) total += volume;
    return total > 0 ? std::ldexp(1.0, std::ilogb(total) - 56) : 1;
}

}  // namespace

std::size_t MassLumping::unlumped() const {
    return static_cast<std::size_t>(
        std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.count == 0; }));
}

MassLumping lump(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 const Parallel& parallel) {
    assert(nodes.volume.size() == nodes.rest_position.size());
    assert(nodes.piece.size() == nodes.rest_position.size());
    constexpr std::size_t grain = tuning::grains::lumping;
    const std::size_t count = nodes.piece.size();
    MassLumping lumping;
    lumping.rows.resize(count);
    struct Entries {
        std::vector<std::uint32_t> phyxel;
        std::vector<double> share;
    };
    std::vector<Entries> chunks((count + grain - 1) / grain);
    const RowLumper lumper(nodes, phyxels, locator);
    parallel.for_chunks(count, grain, [&](std::size_t begin, std::size_t end) {
        Entries& entries = chunks[begin / grain];
        LumpingMoments moments;
        LumpedRow row;
        for (std::size_t b = begin; b < end; ++b) {
            lumper.find(b, row, moments);
            const auto size = static_cast<std::uint32_t>(row.phyxel.size());
            lumping.rows[b] = {0, size, size};
            entries.phyxel.insert(entries.phyxel.end(), row.phyxel.begin(), row.phyxel.end());
            entries.share.insert(entries.share.end(), row.share.begin(), row.share.end());
        }
    });
    std::uint32_t total = 0;
    for (MassLumping::Row& row : lumping.rows) {
        row.begin = total;
        total += row.count;
    }
    lumping.phyxel.reserve(total);
    lumping.share.reserve(total);
    for (const Entries& entries : chunks) {
        parallel.check();
        lumping.phyxel.insert(lumping.phyxel.end(), entries.phyxel.begin(), entries.phyxel.end());
        lumping.share.insert(lumping.share.end(), entries.share.begin(), entries.share.end());
    }
    sum_volumes(nodes, phyxels, locator, lumping, parallel);
    return lumping;
}

void sum_volumes(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 MassLumping& lumping, const Parallel& parallel) {
    lumping.piece.assign(nodes.piece.begin(), nodes.piece.end());
    lumping.phyxel_piece = phyxels.piece;
    lumping.unit = unit_of(nodes.volume);
    lumping.volume.assign(phyxels.size(), {});
    parallel.for_chunks(nodes.piece.size(), tuning::grains::lumping, [&](std::size_t begin, std::size_t end) {
        std::vector<double> plain;
        VolumeSums sums(lumping.unit, parallel.thread_count() > 1, lumping.volume);
        for (std::size_t b = begin; b < end; ++b) {
            plain_shares(nodes.rest_position[b], phyxels, lumping.phyxels_of(b), plain);
            sums.replace(nodes.volume[b], {}, {lumping.phyxels_of(b), plain, lumping.shares_of(b)});
        }
    });
    move_volumes(phyxels, locator, lumping);
}

void apply(const MassLumping& lumping, const MaterialNodes& nodes, double density, Phyxels& phyxels) {
    assert(lumping.volume.size() == phyxels.size());
    std::vector<std::int64_t> units(phyxels.size());
    for (std::size_t i = 0; i < units.size(); ++i) units[i] = lumping.volume[i].corrected;
    for (const MassLumping::Transfer& transfer : lumping.transfers) {
        units[transfer.from] -= transfer.volume;
        units[transfer.to] += transfer.volume;
    }
    for (std::size_t i = 0; i < units.size(); ++i) {
        phyxels.volume[i] = lumping.unit * static_cast<double>(units[i]);
        phyxels.mass[i] = density * phyxels.volume[i];
    }
    keep_centres_of_mass(nodes, density, phyxels);
}

}  // namespace splitcubes::meshless
