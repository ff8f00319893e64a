#include <splitcubes/fracture/crack_nucleation.h>
#include <splitcubes/fracture/tuning.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

CrackNucleation::CrackNucleation(const StrengthField& strength, StressField& stress, CrackCells& cells,
                                 CrackFront& front, const meshless::Material& material)
    : strength_(strength),
      stress_(stress),
      cells_(cells),
      front_(front),
      wave_speed_(std::sqrt((material.lame_lambda() + 2 * material.lame_mu()) / material.density)),
      cube_(stress.reach()) {}

// Registers the positions of cuts for is_beside_crack. Done only when a crack may begin, since most steps
// begin none.
void CrackNucleation::note_crack_points(const NodeGrid& grid) {
    for (; known_points_ < cells_.known_crossings(); ++known_points_) {
        const splitting::Crossing& c = grid.crossings()[known_points_];
        if (c.origin == splitting::Origin::boundary) continue;
        const Vec3 rest = grid.crossing_position(c);
        const Vec3i cube = (rest / cube_).array().floor().cast<int>();
        crack_points_[{cube[0], cube[1], cube[2]}].push_back({rest, c.normal});
    }
}

bool CrackNucleation::is_beside_crack(const Vec3& rest, const Vec3& rest_normal, double load) const {
    const double distance = cube_ * std::clamp(2 - load, 0.0, 1.0);
    const Vec3i cube = (rest / cube_).array().floor().cast<int>();
    for (int k = 0; k < 27; ++k) {
        const auto found =
            crack_points_.find({cube[0] + k % 3 - 1, cube[1] + k / 3 % 3 - 1, cube[2] + k / 9 - 1});
        if (found == crack_points_.end()) continue;
        for (const CrackPoint& point : found->second)
            if ((point.rest - rest).squaredNorm() < distance * distance &&
                std::abs(point.normal.dot(rest_normal)) > tuning::tearing::min_opening_cosine)
                return true;
    }
    return false;
}

// Lists the edges around a phyxel at which a crack may begin, with their stress if it is above the strength.
void CrackNucleation::list_starts(const NodeGrid& grid, const TearContext& context, std::uint32_t phyxel) {
    const std::int32_t piece = context.phyxels.piece[phyxel];
    starts_.clear();
    start_nodes_.clear();
    if (!stress_.is_large(context, piece)) return;
    const Vec3& rest = context.phyxels.rest_position[phyxel];
    const Vec3 half = Vec3::Constant(0.5 * context.spacing);
    const Vec3i low = grid.rest().to_grid(rest - half).array().floor().cast<int>();
    const Vec3i high = grid.rest().to_grid(rest + half).array().ceil().cast<int>();
    const Vec3i count = high - low + Vec3i::Constant(2);
    start_indices_.assign(static_cast<std::size_t>(count.prod()), -1);
    // Each node is listed once, since edges share nodes.
    const auto index_of = [&](const Vec3i& node) {
        const Vec3i at = node - low;
        std::int32_t& index =
            start_indices_[static_cast<std::size_t>((at.z() * count.y() + at.y()) * count.x() + at.x())];
        if (index < 0) {
            index = static_cast<std::int32_t>(start_nodes_.size());
            start_nodes_.push_back({node, context.nodes.find(node), {}});
        }
        return static_cast<std::uint32_t>(index);
    };
    for (int z = low[2]; z <= high[2]; ++z)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int x = low[0]; x <= high[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (CrackCells::is_uncut(grid, edge) && context.pieces.piece_of(grid, edge.node) == piece)
                        starts_.push_back({edge, index_of(edge.node), index_of(edge.upper()), {}, 0, {}});
                }
    context.parallel.for_each(start_nodes_.size(), tuning::grains::crack_starts, [&](std::size_t k) {
        StartNode& node = start_nodes_[k];
        node.sum = stress_.stress_at(context, grid, node.node, node.index);
        // Kept, because neighbouring phyxels share nodes.
        stress_.store_stress(context, node.index, node.sum);
    });
    context.parallel.for_each(starts_.size(), tuning::grains::crack_starts, [&](std::size_t k) {
        StartEdge& start = starts_[k];
        const StartNode &lower = start_nodes_[start.lower], &upper = start_nodes_[start.upper];
        start.rest = 0.5 * (grid.rest().node_position(lower.node) + grid.rest().node_position(upper.node));
        start.strength = std::max(strength_.at(start.rest), 1e-300);
        start.stress = stress_.find_stress(context, grid, start.edge, {lower.index, upper.index},
                                           lower.sum + upper.sum, start.strength);
    });
}

// Begins a crack at the most loaded edge around a phyxel. Returns false if none is above its strength.
bool CrackNucleation::begin_crack_at(NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                                     std::vector<std::int32_t>& slots) {
    list_starts(grid, context, phyxel);
    note_crack_points(grid);
    CutProposal best{0, 1, 0.5, Vec3::Zero()};
    for (const StartEdge& start : starts_) consider_start(grid, phyxel, start, best);
    if (!(best.normal.squaredNorm() > 0)) return false;
    const std::size_t known = cells_.cells().size();
    if (!cells_.cut(grid, best, slots)) return false;
    cells_.note_crossings(grid);
    front_.grow_from(known, grid, context, slots);
    return true;
}

// Makes this edge the best start of a crack if a crack may begin there and it is loaded more than the best so
// far.
void CrackNucleation::consider_start(const NodeGrid& grid, std::uint32_t phyxel, const StartEdge& start,
                                     CutProposal& best) const {
    const EdgeStress& stress = start.stress;
    if (2 * stress_.load()[phyxel] * stress_.min_strength()[phyxel] < start.strength) return;
    const double load = stress.largest / start.strength;
    if (!(load > best.load)) return;
    const Vec3 along =
        grid.rest().node_position(start.edge.upper()) - grid.rest().node_position(start.edge.node);
    const Vec3 deformed = stress.world_from_rest * along;
    if (std::abs(stress.direction.dot(deformed)) < tuning::tearing::min_edge_cosine * deformed.norm()) return;
    Vec3 normal = (stress.world_from_rest.transpose() * stress.direction).normalized();
    const std::optional<WeakPlane> weak_plane = strength_.weak_plane_at(start.rest);
    if (weak_plane && std::abs(weak_plane->normal.dot(normal)) > tuning::tearing::min_opening_cosine)
        normal = weak_plane->normal;
    if (!normal.allFinite() || is_beside_crack(start.rest, normal, load) ||
        CrackCells::is_shielded(grid, start.edge, normal))
        return;
    best = {splitting::edge_id(start.edge), load, 0.5, normal};
}

void CrackNucleation::begin_cracks(NodeGrid& grid, const TearContext& context,
                                   std::vector<std::int32_t>& slots) {
    order_.clear();
    const std::span<const double> load = stress_.load();
    // Held material does not tear itself. Its load is that of what it holds, so it would take all tries.
    const auto is_held = [&](std::uint32_t i) { return i < context.held.size() && context.held[i] != 0; };
    for (std::uint32_t i = 0; i < load.size(); ++i)
        if (load[i] > 1 && !is_held(i)) order_.push_back(i);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return load[a] != load[b] ? load[a] > load[b] : a < b;
    });
    const double min_distance = std::max(stress_.reach(), wave_speed_ * context.dt);
    int vain_tries = 0;
    for (const std::uint32_t i : order_) {
        const Vec3& rest = context.phyxels.rest_position[i];
        if (std::any_of(cells_.torn_points().begin(), cells_.torn_points().end(), [&](const Vec3& at) {
                return (at - rest).squaredNorm() < min_distance * min_distance;
            }))
            continue;
        if (!begin_crack_at(grid, context, i, slots) && ++vain_tries == tuning::tearing::max_vain_tries)
            return;
    }
}

}  // namespace splitcubes::body
