#include <splitcubes/meshless/kernel.h>
#include <splitcubes/meshless/lumping_moments.h>
#include <splitcubes/meshless/mass_lumping.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Numbers from 0 up stand for pieces; -1 for none.
std::size_t piece_limit(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
    std::int32_t highest = -1;
    for (const std::int32_t piece : a) highest = std::max(highest, piece);
    for (const std::int32_t piece : b) highest = std::max(highest, piece);
    return static_cast<std::size_t>(highest + 1);
}

constexpr std::size_t lump_grain = 512;  // nodes a chunk

// Rows of some consecutive nodes.
struct Rows {
    std::vector<std::uint32_t> count, phyxel;
    std::vector<double> share;
    std::vector<std::uint32_t> near;  // scratch
    std::size_t unlumped = 0;
};

// Books nodes, any number of them at a time on several threads, each with its own rows.
class Lumper {
  public:
    Lumper(const Phyxels& phyxels, const PhyxelLocator& locator) : phyxels_(phyxels), locator_(locator) {
        assert(locator.size() == phyxels.size());
        for (const double h : phyxels.support_radius) reach_ = std::max(reach_, h);
        members_.resize(piece_limit(phyxels.piece, {}));
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.piece[i] >= 0)
                members_[static_cast<std::size_t>(phyxels.piece[i])].push_back(static_cast<std::uint32_t>(i));
    }

    void add(const Vec3& node, std::int32_t piece, Rows& rows) const {
        // Those that the kernel reaches are few of those around; only they are put in order.
        rows.near.clear();
        locator_.visit(node, reach_, [&](std::uint32_t i) {
            if (phyxels_.piece[i] == piece && weight(i, node) > 0) rows.near.push_back(i);
            return true;
        });
        std::sort(rows.near.begin(), rows.near.end());
        if (!share_out(node, piece, rows.near, rows)) add_nearest(node, piece, rows);
    }

    // The same for a node whose row held `row`, ascending, where no phyxel or support is another since:
    // pieces part and never join, so nobody else can have come to it. Reading them spares the search.
    void add_again(const Vec3& node, std::int32_t piece, std::span<const std::uint32_t> row,
                   Rows& rows) const {
        if (!share_out(node, piece, row, rows)) add(node, piece, rows);
    }

    void copy(std::span<const std::uint32_t> row, std::span<const double> shares, Rows& rows) const {
        rows.phyxel.insert(rows.phyxel.end(), row.begin(), row.end());
        rows.share.insert(rows.share.end(), shares.begin(), shares.end());
        rows.count.push_back(static_cast<std::uint32_t>(row.size()));
        rows.unlumped += row.empty();
    }

  private:
    double weight(std::uint32_t i, const Vec3& node) const {
        return kernel((phyxels_.rest_position[i] - node).squaredNorm(), phyxels_.support_radius[i]);
    }

    // By kernel weight; false, and nothing, where none of them reaches the node.
    bool share_out(const Vec3& node, std::int32_t piece, std::span<const std::uint32_t> candidates,
                   Rows& rows) const {
        double total = 0;
        const std::size_t begin = rows.phyxel.size();
        for (const std::uint32_t i : candidates) {
            if (phyxels_.piece[i] != piece) continue;
            const double w = weight(i, node);
            if (!(w > 0)) continue;
            rows.phyxel.push_back(i);
            rows.share.push_back(w);
            total += w;
        }
        if (begin == rows.phyxel.size()) return false;
        for (std::size_t k = begin; k < rows.share.size(); ++k) rows.share[k] /= total;
        rows.count.push_back(static_cast<std::uint32_t>(rows.phyxel.size() - begin));
        return true;
    }

    void add_nearest(const Vec3& node, std::int32_t piece, Rows& rows) const {
        double least = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = 0;
        if (piece >= 0 && static_cast<std::size_t>(piece) < members_.size())
            for (const std::uint32_t i : members_[static_cast<std::size_t>(piece)]) {
                const double distance_squared = (phyxels_.rest_position[i] - node).squaredNorm();
                if (!(distance_squared < least)) continue;
                least = distance_squared;
                nearest = i;
            }
        const bool found = least < std::numeric_limits<double>::infinity();
        if (found) {
            rows.phyxel.push_back(nearest);
            rows.share.push_back(1);
        }
        rows.count.push_back(found ? 1 : 0);
        rows.unlumped += !found;
    }

    const Phyxels& phyxels_;
    const PhyxelLocator& locator_;
    double reach_ = 0;                                 // m, largest support radius
    std::vector<std::vector<std::uint32_t>> members_;  // per piece, its phyxels ascending
};

// Calls add(node, rows) for every node and puts the rows together in order.
template <class Add>
void lump_all(std::size_t nodes, const Add& add, MassLumping& lumping, const Parallel& parallel) {
    std::vector<Rows> chunks((nodes + lump_grain - 1) / lump_grain);
    parallel.for_chunks(nodes, lump_grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) add(b, chunks[begin / lump_grain]);
    });
    std::size_t entries = 0;
    for (const Rows& rows : chunks) entries += rows.phyxel.size();
    lumping.offsets.assign(1, 0);
    lumping.offsets.reserve(nodes + 1);
    lumping.phyxel.reserve(entries);
    lumping.share.reserve(entries);
    for (const Rows& rows : chunks) {
        parallel.check();
        for (const std::uint32_t count : rows.count)
            lumping.offsets.push_back(lumping.offsets.back() + count);
        lumping.phyxel.insert(lumping.phyxel.end(), rows.phyxel.begin(), rows.phyxel.end());
        lumping.share.insert(lumping.share.end(), rows.share.begin(), rows.share.end());
        lumping.unlumped += rows.unlumped;
    }
}

// What the nodes of a piece carry, about a reference that moves along.
struct Carried {
    double mass = 0;              // kg
    Vec3 moment = Vec3::Zero();   // kg m, about the origin
    Vec3 linear = Vec3::Zero();   // kg m/s
    Vec3 angular = Vec3::Zero();  // kg m^2/s, about the reference
};

struct Reference {
    Vec3 centre = Vec3::Zero();    // m
    Vec3 velocity = Vec3::Zero();  // m/s
};

using Fates = std::vector<std::uint8_t>;  // per new piece, 1 = nodes or phyxels differ from the old piece

// Per phyxel, 1 where a row names it; else it is new to the booking, or was without share.
std::vector<std::uint8_t> lumped_phyxels(const MassLumping& lumping, std::size_t phyxels) {
    std::vector<std::uint8_t> lumped(phyxels, 0);
    for (const std::uint32_t i : lumping.phyxel) lumped[i] = 1;
    return lumped;
}

// The new pieces that are not one old piece as it was.
Fates changed_pieces(const MassLumping& lumping, const MaterialNodes& nodes, const Phyxels& phyxels,
                     std::span<const std::uint8_t> lumped, std::size_t piece_count,
                     std::vector<std::int32_t>& old_piece) {
    Fates changed(piece_count, 0);
    old_piece.assign(piece_count, -1);
    const std::size_t known = lumping.node_count();
    std::vector<std::size_t> new_size(piece_count, 0);
    std::vector<std::size_t> old_size(piece_limit(lumping.piece, {}), 0);
    for (std::size_t b = 0; b < nodes.piece.size(); ++b) {
        const auto now = static_cast<std::size_t>(nodes.piece[b]);
        ++new_size[now];
        if (b >= known) {
            changed[now] = 1;
            continue;
        }
        ++old_size[static_cast<std::size_t>(lumping.piece[b])];
        if (old_piece[now] >= 0 && old_piece[now] != lumping.piece[b]) changed[now] = 1;
        old_piece[now] = lumping.piece[b];
        for (std::uint32_t e = lumping.offsets[b]; e < lumping.offsets[b + 1]; ++e)
            if (phyxels.piece[lumping.phyxel[e]] != nodes.piece[b]) changed[now] = 1;
    }
    for (std::size_t k = 0; k < piece_count; ++k)
        if (new_size[k] > 0 &&
            (old_piece[k] < 0 || new_size[k] != old_size[static_cast<std::size_t>(old_piece[k])]))
            changed[k] = 1;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (lumped[i] == 0 && phyxels.piece[i] >= 0) changed[static_cast<std::size_t>(phyxels.piece[i])] = 1;
    return changed;
}

// Centre of mass and velocity of every old piece, from what its nodes carried.
std::vector<Reference> references(const MassLumping& lumping, const MaterialNodes& nodes, double density,
                                  const Phyxels& phyxels) {
    std::vector<Carried> sums(piece_limit(lumping.piece, {}));
    for (std::size_t b = 0; b < lumping.node_count(); ++b) {
        Carried& sum = sums[static_cast<std::size_t>(lumping.piece[b])];
        for (std::uint32_t e = lumping.offsets[b]; e < lumping.offsets[b + 1]; ++e) {
            const double m = density * nodes.volume[b] * lumping.share[e];
            sum.mass += m;
            sum.moment += m * phyxels.position[lumping.phyxel[e]];
            sum.linear += m * phyxels.velocity[lumping.phyxel[e]];
        }
    }
    std::vector<Reference> result(sums.size());
    for (std::size_t k = 0; k < sums.size(); ++k)
        if (sums[k].mass > 0) result[k] = {sums[k].moment / sums[k].mass, sums[k].linear / sums[k].mass};
    return result;
}

}  // namespace

MassLumping lump(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 const Parallel& parallel) {
    assert(nodes.volume.size() == nodes.rest_position.size());
    assert(nodes.piece.size() == nodes.rest_position.size());
    MassLumping lumping;
    lumping.piece.assign(nodes.piece.begin(), nodes.piece.end());
    const Lumper keeper(phyxels, locator);
    lump_all(
        nodes.piece.size(),
        [&](std::size_t b, Rows& rows) { keeper.add(nodes.rest_position[b], nodes.piece[b], rows); }, lumping,
        parallel);
    keep_moments(nodes, phyxels, std::vector<std::uint8_t>(nodes.piece.size(), 1), {}, lumping, parallel);
    return lumping;
}

void apply(const MassLumping& lumping, std::span<const double> volumes, double density, Phyxels& phyxels) {
    assert(volumes.size() == lumping.node_count());
    std::fill(phyxels.volume.begin(), phyxels.volume.end(), 0.0);
    for (std::size_t b = 0; b < lumping.node_count(); ++b)
        for (std::uint32_t e = lumping.offsets[b]; e < lumping.offsets[b + 1]; ++e)
            phyxels.volume[lumping.phyxel[e]] += lumping.share[e] * volumes[b];
    for (std::size_t i = 0; i < phyxels.size(); ++i) phyxels.mass[i] = density * phyxels.volume[i];
}

void relump_after_split(MassLumping& lumping, const MaterialNodes& nodes, double density,
                        const PhyxelLocator& locator, Phyxels& phyxels, const Parallel& parallel) {
    assert(lumping.node_count() <= nodes.piece.size());
    const std::size_t piece_count = piece_limit(nodes.piece, phyxels.piece);
    std::vector<std::int32_t> old_piece;
    const std::vector<std::uint8_t> lumped = lumped_phyxels(lumping, phyxels.size());
    const Fates changed = changed_pieces(lumping, nodes, phyxels, lumped, piece_count, old_piece);
    const std::vector<Reference> reference = references(lumping, nodes, density, phyxels);
    const auto reference_of = [&](std::size_t piece) {
        return old_piece[piece] < 0 ? Reference{} : reference[static_cast<std::size_t>(old_piece[piece])];
    };

    std::vector<Carried> carried(piece_count);
    for (std::size_t b = 0; b < lumping.node_count(); ++b) {
        const auto piece = static_cast<std::size_t>(nodes.piece[b]);
        const Reference about = reference_of(piece);
        for (std::uint32_t e = lumping.offsets[b]; e < lumping.offsets[b + 1]; ++e) {
            const double m = density * nodes.volume[b] * lumping.share[e];
            const Vec3& x = phyxels.position[lumping.phyxel[e]];
            const Vec3& v = phyxels.velocity[lumping.phyxel[e]];
            carried[piece].mass += m;
            carried[piece].linear += m * v;
            carried[piece].angular += m * (x - about.centre).cross(v - about.velocity);
        }
    }

    MassLumping fresh;
    fresh.piece.assign(nodes.piece.begin(), nodes.piece.end());
    const Lumper keeper(phyxels, locator);
    const bool any_new = std::find(lumped.begin(), lumped.end(), 0) != lumped.end();
    std::vector<std::uint8_t> again(nodes.piece.size());
    const auto add = [&](std::size_t b, Rows& rows) {
        const std::int32_t piece = nodes.piece[b];
        again[b] = b >= lumping.node_count() || changed[static_cast<std::size_t>(piece)] != 0;
        if (b >= lumping.node_count()) return keeper.add(nodes.rest_position[b], piece, rows);
        const std::uint32_t begin = lumping.offsets[b], count = lumping.offsets[b + 1] - begin;
        const auto row = std::span<const std::uint32_t>(lumping.phyxel).subspan(begin, count);
        if (again[b] == 0)
            keeper.copy(row, std::span<const double>(lumping.share).subspan(begin, count), rows);
        else if (any_new)
            keeper.add(nodes.rest_position[b], piece, rows);
        else
            keeper.add_again(nodes.rest_position[b], piece, row, rows);
    };
    lump_all(nodes.piece.size(), add, fresh, parallel);
    keep_moments(nodes, phyxels, again, lumping, fresh, parallel);
    std::vector<double> old_mass(piece_count, 0);  // of each piece's phyxels, as booked so far
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (phyxels.piece[i] >= 0) old_mass[static_cast<std::size_t>(phyxels.piece[i])] += phyxels.mass[i];
    lumping = std::move(fresh);
    apply(lumping, nodes.volume, density, phyxels);

    std::vector<Momenta> now;
    piece_momenta(phyxels, static_cast<int>(piece_count), now);
    std::vector<double> support(piece_count, 0), members(piece_count, 0);  // sum of h, number
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        support[static_cast<std::size_t>(phyxels.piece[i])] += phyxels.support_radius[i];
        members[static_cast<std::size_t>(phyxels.piece[i])] += 1;
    }
    for (std::size_t k = 0; k < piece_count; ++k) {
        if (changed[k] == 0 || !(now[k].mass > 0) || !(carried[k].mass > 0)) continue;
        const Reference about = reference_of(k);
        const Vec3 relative = carried[k].linear - carried[k].mass * about.velocity;
        const Vec3 angular_momentum = carried[k].angular - (now[k].centre - about.centre).cross(relative);
        now[k].linear = (carried[k].linear - now[k].linear) / now[k].mass;
        // A crumb whose few phyxels lie nearly in a line cannot hold the spin that its
        // nodes carried about that line: it would be flung to pieces.
        const double least_gyration = 0.15 * support[k] / std::max(members[k], 1.0);
        // And one of new phyxels alone is smaller than the old ones, far apart, that
        // held its angular momentum: taken over, it would make the crumb whirl.
        now[k].angular_momentum =
            old_mass[k] > 0 ? angular_velocity(now[k].inertia, angular_momentum - now[k].angular_momentum,
                                               now[k].mass * least_gyration * least_gyration)
                            : Vec3::Zero();
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        const auto k = static_cast<std::size_t>(phyxels.piece[i]);
        if (changed[k] == 0 || !(now[k].mass > 0) || !(carried[k].mass > 0)) continue;
        phyxels.velocity[i] +=
            now[k].linear + now[k].angular_momentum.cross(phyxels.position[i] - now[k].centre);
        phyxels.history_broken[i] = 1;
    }
}

}  // namespace splitcubes::meshless
