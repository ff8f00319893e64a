#include <splitcubes/body/tearing.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Cosine of 45 degrees: largest angle between principal direction and deformed edge where a crack begins.
constexpr double min_edge_cosine = 0.7071;
// Phyxels and nodes; a piece with fewer resolves no stress field and does not tear.
constexpr std::size_t min_tear_phyxels = 16;
constexpr std::size_t min_tear_nodes = 64;
// Searches per step around phyxels where no edge turns out to be above its strength. More cost time; fewer
// may delay a crack by a step.
constexpr int max_vain_tries = 4;
// Cells and start nodes or edges per parallel task.
constexpr std::size_t cell_grain = 8, start_grain = 8;

// Whether the edge has been cut, not by the boundary.
bool is_cracked(const NodeGrid& grid, const GridEdge& edge) {
    if (!grid.has_edge(edge)) return false;
    const std::int32_t slot = grid.slot(edge);
    return slot >= 0 && grid.crossing(slot).origin != splitting::Origin::boundary;
}

// Returns the distance, in cells, from a node along an axis to the first cut edge; max_distance if there is
// none before.
int distance_to_crack(const NodeGrid& grid, const Vec3i& node, int axis, int step, int max_distance) {
    GridEdge edge{node, axis};
    if (step < 0) --edge.node[axis];
    for (int distance = 0; distance < max_distance; ++distance, edge.node[axis] += step)
        if (is_cracked(grid, edge)) return distance;
    return max_distance;
}

// Whether at least two of the four parallel edges around are cut, and at least three are cut or not
// inside.
bool is_passed(const NodeGrid& grid, const GridEdge& edge) {
    int torn = 0, outside = 0;
    for (int k = 0; k < 4; ++k) {
        GridEdge other = edge;
        other.node[(edge.axis + 1 + (k & 1)) % 3] += k < 2 ? -1 : 1;
        if (!grid.has_edge(other) || !grid.inside(other.node) || !grid.inside(other.upper())) {
            ++outside;
        } else if (grid.is_cut(other)) {
            ++torn;
        }
    }
    return torn >= 2 && torn + outside >= 3;
}

// Cells; largest distance between the two sheets of a step whose riser is cut. Larger closes more gaps
// between cracks, but may join cracks that would pass each other.
constexpr int max_riser = 3;

// Whether the edge is the riser of a step between two sheets: one sheet ends beside its lower node, the other
// beside its upper node, on opposite sides and within max_riser.
bool is_riser(const NodeGrid& grid, const GridEdge& edge) {
    for (int k = 1; k <= 2; ++k) {
        const int across = (edge.axis + k) % 3;
        const int low_back = distance_to_crack(grid, edge.node, across, -1, max_riser);
        const int low_ahead = distance_to_crack(grid, edge.node, across, 1, max_riser);
        if ((low_back < max_riser) == (low_ahead < max_riser)) continue;
        const int to_low = low_back < max_riser ? -1 : 1;
        if (distance_to_crack(grid, edge.upper(), across, to_low, max_riser) < max_riser) continue;
        const int high = distance_to_crack(grid, edge.upper(), across, -to_low, max_riser);
        if (std::min(low_back, low_ahead) + high < max_riser) return true;
    }
    return false;
}

// Whether is_passed and is_riser of the cell's edges may depend on this edge.
bool is_near(const GridEdge& edge, const std::array<int, 3>& cell) {
    constexpr int max_distance = max_riser + 1;
    int distance = 0;
    for (int axis = 0; axis < 3; ++axis)
        distance = std::max(distance, std::abs(edge.node[axis] - cell[static_cast<std::size_t>(axis)]));
    return distance <= max_distance;
}

// Returns the ratio of the stress ahead of a crack tip to the crack opening one cell behind it, Pa/m; 0 for
// plastic materials. The opening at a distance r behind the tip is 8 K / E' sqrt(r / (2 pi)), the stress at a
// distance d ahead K / sqrt(2 pi d) (Westergaard's field; Anderson, Fracture Mechanics, section 2.6; plane
// strain). d is half a support radius, about where the phyxels around a tip sample the stress.
double opening_modulus(const meshless::Material& material, double cell_size, double reach) {
    if (material.plasticity) return 0;
    const double nu = material.poisson_ratio;
    return material.youngs_modulus / (1 - nu * nu) / (8 * std::sqrt(cell_size * 0.5 * reach));
}

}  // namespace

Tearing::Tearing(const TearSettings& settings, const meshless::Material& material, const NodeGrid& grid,
                 const meshless::Phyxels& phyxels, const meshless::Neighbourhoods& neighbourhoods)
    : settings_(settings),
      wave_speed_(std::sqrt((material.lame_lambda() + 2 * material.lame_mu()) / material.density)),
      crack_speed_(settings.crack_speed > 0 ? settings.crack_speed
                                            : 0.4 * std::sqrt(material.lame_mu() / material.density)),
      cell_size_(grid.rest().cell_size),
      // At least 1.5, because the frames at the edges of a rough crack are noisy.
      break_stretch_(1 + std::max(0.5, 3 * settings.strength / material.youngs_modulus) +
                     (material.plasticity ? material.plasticity->maximum : 0)) {
    for (const double h : phyxels.support_radius) reach_ = std::max(reach_, h);
    cube_ = reach_;
    crack_cell_index_ = splitting::SlotMap<1>(grid.bricks());
    open_edge_index_ = splitting::SlotMap<3>(grid.bricks());
    opening_modulus_ = opening_modulus(material, cell_size_, reach_);
    // A sheet of one layer of phyxels has rank 2 initially, and in-plane stress.
    for (const std::uint8_t rank : neighbourhoods.rank())
        own_rank_.push_back(std::max<std::uint8_t>(rank, 2));
    if (!settings_.strength_factor) return;
    min_strength_factor_ = std::numeric_limits<double>::infinity();
    for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick)
        for (std::uint64_t word = grid.inside_word(brick); word; word &= word - 1) {
            const auto local = static_cast<unsigned>(std::countr_zero(word));
            const Vec3i node = grid.bricks().base(brick) + splitting::BrickLayout::local_node(local);
            min_strength_factor_ =
                std::min(min_strength_factor_, settings_.strength_factor(grid.rest().node_position(node)));
        }
}

double Tearing::strength_at(const Vec3& rest) const {
    return settings_.strength * (settings_.strength_factor ? settings_.strength_factor(rest) : 1);
}

// Registers the positions of cuts for is_beside_crack. Done only when a crack may begin, since most steps
// begin none.
void Tearing::note_crack_points(const NodeGrid& grid) {
    for (; known_points_ < known_crossings_; ++known_points_) {
        const splitting::Crossing& c = grid.crossings()[known_points_];
        if (c.origin == splitting::Origin::boundary) continue;
        const Vec3 rest = grid.crossing_position(c);
        const Vec3i cube = (rest / cube_).array().floor().cast<int>();
        crack_points_[{cube[0], cube[1], cube[2]}].push_back({rest, c.normal});
    }
}

// Whether a piece is large enough to resolve a stress field.
bool Tearing::is_large(const TearContext& context, std::int32_t piece) const {
    const auto p = static_cast<std::size_t>(piece);
    return phyxels_of_[p] >= min_tear_phyxels && context.pieces.node_counts()[p] >= min_tear_nodes;
}

// Whether both ends of the edge are inside and it is uncut.
bool Tearing::is_uncut(const NodeGrid& grid, const GridEdge& edge) {
    return grid.has_edge(edge) && grid.inside(edge.node) && grid.inside(edge.upper()) && !grid.is_cut(edge);
}

// Whether one of the next two edges on the same grid line, to either side, is cut by a nearly parallel plane:
// a cut would split off a slab of one or two nodes.
bool Tearing::is_shielded(const NodeGrid& grid, const GridEdge& edge, const Vec3& normal) const {
    for (const int step : {-1, 1})
        for (int k = 1; k <= 2; ++k) {
            GridEdge other = edge;
            other.node[edge.axis] += step * k;
            if (!grid.has_edge(other)) break;
            const std::int32_t slot = grid.slot(other);
            if (slot < 0) continue;
            const splitting::Crossing& c = grid.crossing(slot);
            if (c.origin == splitting::Origin::boundary) break;
            if (std::abs(c.normal.dot(normal)) > min_opening_cosine) return true;
        }
    return false;
}

bool Tearing::is_beside_crack(const Vec3& rest, const Vec3& rest_normal, double load) const {
    const double distance = cube_ * std::clamp(2 - load, 0.0, 1.0);
    const Vec3i cube = (rest / cube_).array().floor().cast<int>();
    for (int k = 0; k < 27; ++k) {
        const auto found =
            crack_points_.find({cube[0] + k % 3 - 1, cube[1] + k / 3 % 3 - 1, cube[2] + k / 9 - 1});
        if (found == crack_points_.end()) continue;
        for (const CrackPoint& point : found->second)
            if ((point.rest - rest).squaredNorm() < distance * distance &&
                std::abs(point.normal.dot(rest_normal)) > min_opening_cosine)
                return true;
    }
    return false;
}

std::int32_t Tearing::cut(NodeGrid& grid, const Proposal& proposal, std::vector<std::int32_t>& slots) {
    const GridEdge edge = splitting::edge_from_id(proposal.id);
    if (!(proposal.crack_opening > slab_opening) && is_shielded(grid, edge, proposal.normal)) return -1;
    const std::int32_t slot =
        grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
    if (slot < 0) return -1;
    slots.push_back(slot);
    new_tears_.push_back(grid.crossing_position(grid.crossing(slot)));
    return slot;
}

// Whether this cell is the first of the touched cells that share the edge.
bool Tearing::is_first_around(const NodeGrid& grid, const GridEdge& edge, const Key& key) const {
    bool is_first = true;
    for_cells_around(grid, edge, [&](const Key& cell) {
        const std::int32_t known = cell < key ? crack_cell_index_.get({cell[0], cell[1], cell[2]}, 0) : -1;
        is_first =
            is_first && (known < 0 || crack_cells_[static_cast<std::size_t>(known)].touched_epoch != epoch_);
    });
    return is_first;
}

// Returns the edges of a cell that cracks have passed, one bit per edge, without those that an earlier
// touched_epoch cell reports.
std::uint32_t Tearing::passed_edges_in(const NodeGrid& grid, const TearContext& context,
                                       const Key& key) const {
    std::uint32_t out = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge({key[0], key[1], key[2]}, e);
        if (is_uncut(grid, edge) && is_first_around(grid, edge, key) &&
            (is_passed(grid, edge) || is_riser(grid, edge)) &&
            is_large(context, context.pieces.piece_of(grid, edge.node)))
            out |= std::uint32_t{1} << e;
    }
    return out;
}

// Cuts the edges that cracks have passed, whatever their stress, around this step's cuts. The samples on both
// sides of a crack no longer see each other, so such an edge would connect the faces without a force, as a
// ligament.
void Tearing::cut_passed_edges(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    constexpr int max_passes = 4;
    std::size_t before = 0;
    for (int pass = 0; pass < max_passes; ++pass) {
        cells_of(grid, slots, touched_cells_);
        // Only cells near the last pass's cuts can have changed.
        if (pass > 0)
            std::erase_if(touched_cells_, [&](const Key& cell) {
                return std::none_of(
                    slots.begin() + static_cast<std::ptrdiff_t>(before), slots.end(),
                    [&](std::int32_t slot) { return is_near(grid.crossing(slot).edge, cell); });
            });
        ++epoch_;
        for (const Key& cell : touched_cells_)
            crack_cells_[static_cast<std::size_t>(crack_cell_index_.get({cell[0], cell[1], cell[2]}, 0))]
                .touched_epoch = epoch_;
        passed_edges_.resize(touched_cells_.size());
        context.parallel.for_each(touched_cells_.size(), cell_grain, [&](std::size_t k) {
            passed_edges_[k] = passed_edges_in(grid, context, touched_cells_[k]);
        });
        before = slots.size();
        for (std::size_t k = 0; k < touched_cells_.size(); ++k)
            for (std::uint32_t edges = passed_edges_[k]; edges != 0; edges &= edges - 1) {
                const Vec3i cell(touched_cells_[k][0], touched_cells_[k][1], touched_cells_[k][2]);
                const GridEdge edge = splitting::cell_edge(cell, std::countr_zero(edges));
                cut(grid, {splitting::edge_id(edge), 0, 0.5, Vec3::Unit(edge.axis)}, slots);
            }
        if (slots.size() == before) return;
        note_crossings(grid);
    }
}

// Lists the edges around a phyxel at which a crack may begin, with their stress if it is above the strength.
void Tearing::list_starts(const NodeGrid& grid, const TearContext& context, std::uint32_t phyxel) {
    const std::int32_t piece = context.phyxels.piece[phyxel];
    starts_.clear();
    start_nodes_.clear();
    if (!is_large(context, piece)) return;
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
                    if (is_uncut(grid, edge) && context.pieces.piece_of(grid, edge.node) == piece)
                        starts_.push_back({edge, index_of(edge.node), index_of(edge.upper()), {}, 0, {}});
                }
    context.parallel.for_each(start_nodes_.size(), start_grain, [&](std::size_t k) {
        StartNode& node = start_nodes_[k];
        node.sum = stress_at(context, grid, node.node, node.index);
        // Kept, because neighbouring phyxels share nodes.
        if (has_kernel(context, node.index))
            node_stress_[static_cast<std::size_t>(node.index)] = {step_, node.sum};
    });
    context.parallel.for_each(starts_.size(), start_grain, [&](std::size_t k) {
        StartEdge& start = starts_[k];
        const StartNode &lower = start_nodes_[start.lower], &upper = start_nodes_[start.upper];
        start.rest = 0.5 * (grid.rest().node_position(lower.node) + grid.rest().node_position(upper.node));
        start.strength = std::max(strength_at(start.rest), 1e-300);
        start.stress = find_stress(context, grid, start.edge, {lower.index, upper.index},
                                   lower.sum + upper.sum, start.strength);
    });
}

// Begins a crack at the most loaded edge around a phyxel. Returns false if none is above its strength.
bool Tearing::begin_crack_at(NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                             std::vector<std::int32_t>& slots) {
    list_starts(grid, context, phyxel);
    note_crack_points(grid);
    Proposal best{0, 1, 0.5, Vec3::Zero()};
    for (const StartEdge& start : starts_) consider_start(grid, phyxel, start, best);
    if (!(best.normal.squaredNorm() > 0)) return false;
    const std::size_t known = crack_cells_.size();
    if (cut(grid, best, slots) < 0) return false;
    note_crossings(grid);
    front_.clear();
    for (std::size_t k = known; k < crack_cells_.size(); ++k) front_.push_back(static_cast<std::uint32_t>(k));
    grow(grid, context, slots);
    return true;
}

// Makes this edge the best start of a crack if a crack may begin there and it is loaded more than the best so
// far.
void Tearing::consider_start(const NodeGrid& grid, std::uint32_t phyxel, const StartEdge& start,
                             Proposal& best) const {
    const Stress& stress = start.stress;
    if (2 * load_[phyxel] * min_strength_[phyxel] < start.strength) return;
    const double load = stress.largest / start.strength;
    if (!(load > best.load)) return;
    const Vec3 along =
        grid.rest().node_position(start.edge.upper()) - grid.rest().node_position(start.edge.node);
    const Vec3 deformed = stress.world_from_rest * along;
    if (std::abs(stress.direction.dot(deformed)) < min_edge_cosine * deformed.norm()) return;
    Vec3 normal = (stress.world_from_rest.transpose() * stress.direction).normalized();
    const std::optional<WeakPlane> weak_plane = weak_plane_at(start.rest);
    if (weak_plane && std::abs(weak_plane->normal.dot(normal)) > min_opening_cosine)
        normal = weak_plane->normal;
    if (!normal.allFinite() || is_beside_crack(start.rest, normal, load) ||
        is_shielded(grid, start.edge, normal))
        return;
    best = {splitting::edge_id(start.edge), load, 0.5, normal};
}

void Tearing::begin_cracks(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    order_.clear();
    for (std::uint32_t i = 0; i < load_.size(); ++i)
        if (load_[i] > 1) order_.push_back(i);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return load_[a] != load_[b] ? load_[a] > load_[b] : a < b;
    });
    const double min_distance = std::max(reach_, wave_speed_ * context.dt);
    int vain_tries = 0;
    for (const std::uint32_t i : order_) {
        const Vec3& rest = context.phyxels.rest_position[i];
        if (std::any_of(new_tears_.begin(), new_tears_.end(), [&](const Vec3& at) {
                return (at - rest).squaredNorm() < min_distance * min_distance;
            }))
            continue;
        if (!begin_crack_at(grid, context, i, slots) && ++vain_tries == max_vain_tries) return;
    }
}

std::vector<std::int32_t> Tearing::tear(NodeGrid& grid, const TearContext& context) {
    std::vector<std::int32_t> slots;
    top_load_ = 0;
    if (context.neighbourhoods.size() != context.phyxels.size()) return slots;
    note_crossings(grid);
    break_ligaments(grid, context, slots);
    find_min_strengths(grid, context);
    if (measure_phyxels(context, min_stress()) <
        settings_.propagation_ratio * settings_.strength * min_strength_factor_)
        return slots;
    find_loads(context);
    if (top_load_ < min_load * settings_.propagation_ratio) return slots;
    ++step_;
    node_stress_.resize(context.nodes.kernels().size());
    phyxels_of_.assign(context.pieces.count(), 0);
    for (const std::int32_t piece : context.phyxels.piece) ++phyxels_of_[static_cast<std::size_t>(piece)];
    new_tears_.clear();
    find_loaded_front(grid, context);
    grow(grid, context, slots);
    begin_cracks(grid, context, slots);
    cut_passed_edges(grid, context, slots);
    return slots;
}

}  // namespace splitcubes::body
