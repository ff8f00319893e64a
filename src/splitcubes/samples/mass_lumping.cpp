#include <splitcubes/samples/kernel.h>
#include <splitcubes/samples/lumping_moments.h>
#include <splitcubes/samples/mass_lumping.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Returns one more than the largest piece id; -1 stands for no piece.
std::size_t piece_limit(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
    std::int32_t highest = -1;
    for (const std::int32_t piece : a) highest = std::max(highest, piece);
    for (const std::int32_t piece : b) highest = std::max(highest, piece);
    return static_cast<std::size_t>(highest + 1);
}

// Rows of a chunk of consecutive nodes.
struct Rows {
    std::vector<std::uint32_t> count, phyxel;
    std::vector<double> share;
    std::vector<std::uint32_t> near;  // scratch
    std::size_t unlumped = 0;
};

// Lumps single nodes. Several threads may use it at once, each with its own rows.
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
        // Few of the visited phyxels have a weight; only these are sorted.
        rows.near.clear();
        locator_.visit(node, reach_, [&](std::uint32_t i) {
            if (phyxels_.piece[i] == piece && weight(i, node) > 0) rows.near.push_back(i);
            return true;
        });
        std::sort(rows.near.begin(), rows.near.end());
        if (!add_weighted(node, piece, rows.near, rows)) add_nearest(node, piece, rows);
    }

    // The same for a node with the old row `row`, ascending, if phyxels and supports are unchanged: pieces
    // separate and never join, so no other phyxel can reach the node and no search is needed.
    void add_again(const Vec3& node, std::int32_t piece, std::span<const std::uint32_t> row,
                   Rows& rows) const {
        if (!add_weighted(node, piece, row, rows)) add(node, piece, rows);
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

    // Appends a row of kernel weights. Returns false, without a row, if no candidate reaches the node.
    bool add_weighted(const Vec3& node, std::int32_t piece, std::span<const std::uint32_t> candidates,
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
        double min_distance_squared = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = 0;
        if (piece >= 0 && static_cast<std::size_t>(piece) < members_.size())
            for (const std::uint32_t i : members_[static_cast<std::size_t>(piece)]) {
                const double distance_squared = (phyxels_.rest_position[i] - node).squaredNorm();
                if (!(distance_squared < min_distance_squared)) continue;
                min_distance_squared = distance_squared;
                nearest = i;
            }
        const bool found = min_distance_squared < std::numeric_limits<double>::infinity();
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

// Calls add(node, rows) for every node and concatenates the rows in order.
template <class Add>
void lump_all(std::size_t nodes, const Add& add, MassLumping& lumping, const Parallel& parallel) {
    std::vector<Rows> chunks((nodes + tuning::grains::lumping - 1) / tuning::grains::lumping);
    parallel.for_chunks(nodes, tuning::grains::lumping, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) add(b, chunks[begin / tuning::grains::lumping]);
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

// Mass and momenta of the nodes of a piece, relative to a moving reference.
struct NodeMomenta {
    double mass = 0;              // kg
    Vec3 moment = Vec3::Zero();   // kg m, about the origin
    Vec3 linear = Vec3::Zero();   // kg m/s
    Vec3 angular = Vec3::Zero();  // kg m^2/s, about the reference
};

struct Reference {
    Vec3 centre = Vec3::Zero();    // m
    Vec3 velocity = Vec3::Zero();  // m/s
};

using PieceFlags = std::vector<std::uint8_t>;  // per new piece, 1: nodes or phyxels differ from the old piece

// Returns 1 per phyxel that occurs in a row; 0: it is new, or had no share.
std::vector<std::uint8_t> lumped_phyxels(const MassLumping& lumping, std::size_t phyxels) {
    std::vector<std::uint8_t> lumped(phyxels, 0);
    for (const std::uint32_t i : lumping.phyxel) lumped[i] = 1;
    return lumped;
}

// Finds the new pieces that differ from an old piece; writes the old piece of each new one, or -1.
PieceFlags changed_pieces(const MassLumping& lumping, const MaterialNodes& nodes, const Phyxels& phyxels,
                          std::span<const std::uint8_t> lumped, std::size_t piece_count,
                          std::vector<std::int32_t>& old_piece) {
    PieceFlags changed(piece_count, 0);
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

// Returns centre of mass and velocity of every old piece, from the masses and shares of its nodes.
std::vector<Reference> references(const MassLumping& lumping, const MaterialNodes& nodes, double density,
                                  const Phyxels& phyxels) {
    std::vector<NodeMomenta> sums(piece_limit(lumping.piece, {}));
    for (std::size_t b = 0; b < lumping.node_count(); ++b) {
        NodeMomenta& sum = sums[static_cast<std::size_t>(lumping.piece[b])];
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
    const Lumper lumper(phyxels, locator);
    lump_all(
        nodes.piece.size(),
        [&](std::size_t b, Rows& rows) { lumper.add(nodes.rest_position[b], nodes.piece[b], rows); }, lumping,
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
    const PieceFlags changed = changed_pieces(lumping, nodes, phyxels, lumped, piece_count, old_piece);
    const std::vector<Reference> reference = references(lumping, nodes, density, phyxels);
    const auto reference_of = [&](std::size_t piece) {
        return old_piece[piece] < 0 ? Reference{} : reference[static_cast<std::size_t>(old_piece[piece])];
    };

    std::vector<NodeMomenta> node_momenta(piece_count);
    for (std::size_t b = 0; b < lumping.node_count(); ++b) {
        const auto piece = static_cast<std::size_t>(nodes.piece[b]);
        const Reference about = reference_of(piece);
        for (std::uint32_t e = lumping.offsets[b]; e < lumping.offsets[b + 1]; ++e) {
            const double m = density * nodes.volume[b] * lumping.share[e];
            const Vec3& x = phyxels.position[lumping.phyxel[e]];
            const Vec3& v = phyxels.velocity[lumping.phyxel[e]];
            node_momenta[piece].mass += m;
            node_momenta[piece].linear += m * v;
            node_momenta[piece].angular += m * (x - about.centre).cross(v - about.velocity);
        }
    }

    MassLumping fresh;
    fresh.piece.assign(nodes.piece.begin(), nodes.piece.end());
    const Lumper lumper(phyxels, locator);
    const bool any_new = std::find(lumped.begin(), lumped.end(), 0) != lumped.end();
    std::vector<std::uint8_t> relump(nodes.piece.size());
    const auto add = [&](std::size_t b, Rows& rows) {
        const std::int32_t piece = nodes.piece[b];
        relump[b] = b >= lumping.node_count() || changed[static_cast<std::size_t>(piece)] != 0;
        if (b >= lumping.node_count()) return lumper.add(nodes.rest_position[b], piece, rows);
        const std::uint32_t begin = lumping.offsets[b], count = lumping.offsets[b + 1] - begin;
        const auto row = std::span<const std::uint32_t>(lumping.phyxel).subspan(begin, count);
        if (relump[b] == 0)
            lumper.copy(row, std::span<const double>(lumping.share).subspan(begin, count), rows);
        else if (any_new)
            lumper.add(nodes.rest_position[b], piece, rows);
        else
            lumper.add_again(nodes.rest_position[b], piece, row, rows);
    };
    lump_all(nodes.piece.size(), add, fresh, parallel);
    keep_moments(nodes, phyxels, relump, lumping, fresh, parallel);
    std::vector<double> old_mass(piece_count, 0);  // kg, of each piece's phyxels before
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (phyxels.piece[i] >= 0) old_mass[static_cast<std::size_t>(phyxels.piece[i])] += phyxels.mass[i];
    lumping = std::move(fresh);
    apply(lumping, nodes.volume, density, phyxels);

    std::vector<Momenta> now;
    momenta_of_pieces(phyxels, static_cast<int>(piece_count), now);
    std::vector<double> support(piece_count, 0), members(piece_count, 0);  // sum of h, number
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        support[static_cast<std::size_t>(phyxels.piece[i])] += phyxels.support_radius[i];
        members[static_cast<std::size_t>(phyxels.piece[i])] += 1;
    }
    for (std::size_t k = 0; k < piece_count; ++k) {
        if (changed[k] == 0 || !(now[k].mass > 0) || !(node_momenta[k].mass > 0)) continue;
        const Reference about = reference_of(k);
        const Vec3 relative = node_momenta[k].linear - node_momenta[k].mass * about.velocity;
        const Vec3 angular_momentum =
            node_momenta[k].angular - (now[k].centre - about.centre).cross(relative);
        now[k].linear = (node_momenta[k].linear - now[k].linear) / now[k].mass;
        // A fragment whose few phyxels lie nearly on a line cannot take over the angular momentum
        // of its nodes about that line: its angular velocity would be huge.
        const double min_gyration = 0.15 * support[k] / std::max(members[k], 1.0);
        // A fragment of new phyxels alone is smaller than the old phyxels' spacing, so their
        // angular momentum would make it spin too fast.
        now[k].angular_momentum =
            old_mass[k] > 0 ? angular_velocity(now[k].inertia, angular_momentum - now[k].angular_momentum,
                                               now[k].mass * min_gyration * min_gyration)
                            : Vec3::Zero();
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        const auto k = static_cast<std::size_t>(phyxels.piece[i]);
        if (changed[k] == 0 || !(now[k].mass > 0) || !(node_momenta[k].mass > 0)) continue;
        phyxels.velocity[i] +=
            now[k].linear + now[k].angular_momentum.cross(phyxels.position[i] - now[k].centre);
        phyxels.restart_history[i] = 1;
    }
}

}  // namespace splitcubes::meshless
