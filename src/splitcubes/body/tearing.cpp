#include <splitcubes/body/tearing.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Of principal direction and deformed edge where a crack begins: 45 degrees.
constexpr double least_edge_cosine = 0.7071;
// Pieces below these have no stress field to speak of.
constexpr std::size_t least_phyxels = 16;
constexpr std::size_t least_nodes = 64;
// A phyxel whose edges are all below the strength costs its search; so many a step at most.
constexpr int most_vain_tries = 4;
constexpr std::size_t cell_grain = 8, start_grain = 8;

// Whether something other than the boundary has cut the edge.
bool cracked(const NodeGrid& grid, const GridEdge& edge) {
    if (!grid.has_edge(edge)) return false;
    const std::int32_t slot = grid.slot(edge);
    return slot >= 0 && grid.crossing(slot).origin != splitting::Origin::boundary;
}

// Cells from a node along an axis to the first edge that a crack has cut; `most`
// where there is none before.
int way_to_crack(const NodeGrid& grid, const Vec3i& node, int axis, int step, int most) {
    GridEdge edge{node, axis};
    if (step < 0) --edge.node[axis];
    for (int way = 0; way < most; ++way, edge.node[axis] += step)
        if (cracked(grid, edge)) return way;
    return most;
}

// Whether a crack has passed three of the four parallel edges around, the outside
// counting as one.
bool passed_around(const NodeGrid& grid, const GridEdge& edge) {
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

constexpr int most_riser = 3;  // cells

// Whether the edge is the riser of a step between two sheets: one has passed its lower
// node, the other its upper one, on opposite sides and at most a few cells apart.
bool is_riser(const NodeGrid& grid, const GridEdge& edge) {
    for (int k = 1; k <= 2; ++k) {
        const int across = (edge.axis + k) % 3;
        const int low_back = way_to_crack(grid, edge.node, across, -1, most_riser);
        const int low_ahead = way_to_crack(grid, edge.node, across, 1, most_riser);
        if ((low_back < most_riser) == (low_ahead < most_riser)) continue;
        const int to_low = low_back < most_riser ? -1 : 1;
        if (way_to_crack(grid, edge.upper(), across, to_low, most_riser) < most_riser) continue;
        const int high = way_to_crack(grid, edge.upper(), across, -to_low, most_riser);
        if (std::min(low_back, low_ahead) + high < most_riser) return true;
    }
    return false;
}

// Whether what passed_around and is_riser say of the cell's edges may depend on this one.
bool is_near(const GridEdge& edge, const std::array<int, 3>& cell) {
    constexpr int most = most_riser + 1;
    int way = 0;
    for (int axis = 0; axis < 3; ++axis)
        way = std::max(way, std::abs(edge.node[axis] - cell[static_cast<std::size_t>(axis)]));
    return way <= most;
}

// The lips of a crack a cell behind its tip gape by 8 K / E' sqrt(r / (2 pi)), and the stress at a
// distance d ahead is K / sqrt(2 pi d) (Westergaard's field; Anderson, Fracture Mechanics, section 2.6; plane
// strain): here at half a support, about where the phyxels around a tip take theirs.
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
      // Half again as long at the least: the frames of a rough crack's edges are rough.
      break_stretch_(1 + std::max(0.5, 3 * settings.strength / material.youngs_modulus) +
                     (material.plasticity ? material.plasticity->maximum : 0)) {
    for (const double h : phyxels.support_radius) reach_ = std::max(reach_, h);
    cube_ = reach_;
    crack_number_ = splitting::SlotMap<1>(grid.bricks());
    open_number_ = splitting::SlotMap<3>(grid.bricks());
    opening_modulus_ = opening_modulus(material, cell_size_, reach_);
    // A sheet of one layer of phyxels has rank 2 from the start, and stress in its plane.
    for (const std::uint8_t rank : neighbourhoods.rank())
        own_rank_.push_back(std::max<std::uint8_t>(rank, 2));
    if (!settings_.strength_factor) return;
    weakest_all_ = std::numeric_limits<double>::infinity();
    for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick)
        for (std::uint64_t word = grid.inside_word(brick); word; word &= word - 1) {
            const auto local = static_cast<unsigned>(std::countr_zero(word));
            const Vec3i node = grid.bricks().base(brick) + splitting::BrickLayout::local_place(local);
            weakest_all_ = std::min(weakest_all_, settings_.strength_factor(grid.rest().node_position(node)));
        }
}

double Tearing::strength_at(const Vec3& rest) const {
    return settings_.strength * (settings_.strength_factor ? settings_.strength_factor(rest) : 1);
}

// Where these are, for those who begin cracks: most steps begin none.
void Tearing::note_crack_points(const NodeGrid& grid) {
    for (; known_points_ < known_crossings_; ++known_points_) {
        const splitting::Crossing& c = grid.crossings()[known_points_];
        if (c.origin == splitting::Origin::boundary) continue;
        const Vec3 rest = grid.crossing_position(c);
        const Vec3i cube = (rest / cube_).array().floor().cast<int>();
        crack_points_[{cube[0], cube[1], cube[2]}].push_back({rest, c.normal});
    }
}

// Whether a piece has a stress field to speak of.
bool Tearing::is_large(const TearContext& context, std::int32_t piece) const {
    const auto p = static_cast<std::size_t>(piece);
    return phyxels_of_[p] >= least_phyxels && context.pieces.node_counts()[p] >= least_nodes;
}

// Whether it holds material together.
bool Tearing::is_whole(const NodeGrid& grid, const GridEdge& edge) {
    return grid.has_edge(edge) && grid.inside(edge.node) && grid.inside(edge.upper()) && !grid.is_cut(edge);
}

// Whether one of the next two edges on the same grid line, to either side, is cut
// by much the same plane: a slab of a node or two would come off.
bool Tearing::shadowed(const NodeGrid& grid, const GridEdge& edge, const Vec3& normal) const {
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

bool Tearing::beside_crack(const Vec3& rest, const Vec3& rest_normal, double load) const {
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
    if (!(proposal.crack_opening > slab_opening) && shadowed(grid, edge, proposal.normal)) return -1;
    const std::int32_t slot =
        grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
    if (slot < 0) return -1;
    slots.push_back(slot);
    torn_now_.push_back(grid.crossing_position(grid.crossing(slot)));
    return slot;
}

// Whether none of the cells of touched_ that share the edge comes before this one.
bool Tearing::is_first_around(const NodeGrid& grid, const GridEdge& edge, const Key& key) const {
    bool is_first = true;
    for_cells_around(grid, edge, [&](const Key& cell) {
        const std::int32_t known = cell < key ? crack_number_.get({cell[0], cell[1], cell[2]}, 0) : -1;
        is_first = is_first && (known < 0 || crack_cells_[static_cast<std::size_t>(known)].touched != round_);
    });
    return is_first;
}

// Bit e: edge e of the cell holds what cracks have passed by, and no cell before it tells so.
std::uint32_t Tearing::gaps_in(const NodeGrid& grid, const TearContext& context, const Key& key) const {
    std::uint32_t out = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge({key[0], key[1], key[2]}, e);
        if (is_whole(grid, edge) && is_first_around(grid, edge, key) &&
            (passed_around(grid, edge) || is_riser(grid, edge)) &&
            is_large(context, context.pieces.piece_of(grid, edge.node)))
            out |= std::uint32_t{1} << e;
    }
    return out;
}

// The samples on both sides of a crack no longer see each other, so what holds there
// would hold without a force, as a strand. Looks at the cells that this step's cuts
// have touched, whatever the stress.
void Tearing::close_gaps(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    constexpr int most_passes = 4;
    std::size_t before = 0;
    for (int pass = 0; pass < most_passes; ++pass) {
        cells_of(grid, slots, touched_);
        // What the last pass has cut makes no difference farther off.
        if (pass > 0)
            std::erase_if(touched_, [&](const Key& cell) {
                return std::none_of(
                    slots.begin() + static_cast<std::ptrdiff_t>(before), slots.end(),
                    [&](std::int32_t slot) { return is_near(grid.crossing(slot).edge, cell); });
            });
        ++round_;
        for (const Key& cell : touched_)
            crack_cells_[static_cast<std::size_t>(crack_number_.get({cell[0], cell[1], cell[2]}, 0))]
                .touched = round_;
        gaps_.resize(touched_.size());
        context.parallel.for_each(touched_.size(), cell_grain,
                                  [&](std::size_t k) { gaps_[k] = gaps_in(grid, context, touched_[k]); });
        before = slots.size();
        for (std::size_t k = 0; k < touched_.size(); ++k)
            for (std::uint32_t edges = gaps_[k]; edges != 0; edges &= edges - 1) {
                const Vec3i cell(touched_[k][0], touched_[k][1], touched_[k][2]);
                const GridEdge edge = splitting::cell_edge(cell, std::countr_zero(edges));
                cut(grid, {splitting::edge_id(edge), 0, 0.5, Vec3::Unit(edge.axis)}, slots);
            }
        if (slots.size() == before) return;
        note_crossings(grid);
    }
}

// The edges around a phyxel where a crack may begin, with their stress where it is above their strength.
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
    start_numbers_.assign(static_cast<std::size_t>(count.prod()), -1);
    // Edges share nodes.
    const auto number_of = [&](const Vec3i& node) {
        const Vec3i at = node - low;
        std::int32_t& number =
            start_numbers_[static_cast<std::size_t>((at.z() * count.y() + at.y()) * count.x() + at.x())];
        if (number < 0) {
            number = static_cast<std::int32_t>(start_nodes_.size());
            start_nodes_.push_back({node, context.nodes.find(node), {}});
        }
        return static_cast<std::uint32_t>(number);
    };
    for (int z = low[2]; z <= high[2]; ++z)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int x = low[0]; x <= high[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (is_whole(grid, edge) && context.pieces.piece_of(grid, edge.node) == piece)
                        starts_.push_back({edge, number_of(edge.node), number_of(edge.upper()), {}, 0, {}});
                }
    context.parallel.for_each(start_nodes_.size(), start_grain, [&](std::size_t k) {
        StartNode& node = start_nodes_[k];
        node.sum = stress_at(context, grid, node.place, node.index);
        // Phyxels beside each other ask for the same.
        if (is_lattice_driven(context, node.index))
            node_stress_[static_cast<std::size_t>(node.index)] = {step_, node.sum};
    });
    context.parallel.for_each(starts_.size(), start_grain, [&](std::size_t k) {
        StartEdge& start = starts_[k];
        const StartNode &lower = start_nodes_[start.lower], &upper = start_nodes_[start.upper];
        start.rest = 0.5 * (grid.rest().node_position(lower.place) + grid.rest().node_position(upper.place));
        start.strength = std::max(strength_at(start.rest), 1e-300);
        start.stress = find_stress(context, grid, start.edge, {lower.index, upper.index},
                                   lower.sum + upper.sum, start.strength);
    });
}

// A crack at the most loaded edge around a phyxel. False where none is overloaded.
bool Tearing::begin_one(NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                        std::vector<std::int32_t>& slots) {
    list_starts(grid, context, phyxel);
    note_crack_points(grid);
    Proposal best{0, 1, 0.5, Vec3::Zero()};
    for (const StartEdge& start : starts_) consider(grid, phyxel, start, best);
    if (!(best.normal.squaredNorm() > 0)) return false;
    const std::size_t known = crack_cells_.size();
    if (cut(grid, best, slots) < 0) return false;
    note_crossings(grid);
    front_.clear();
    for (std::size_t k = known; k < crack_cells_.size(); ++k) front_.push_back(static_cast<std::uint32_t>(k));
    grow(grid, context, slots);
    return true;
}

// Whether a crack rather begins at this edge than at the best before it.
void Tearing::consider(const NodeGrid& grid, std::uint32_t phyxel, const StartEdge& start,
                       Proposal& best) const {
    const Stress& stress = start.stress;
    if (2 * load_[phyxel] * weakest_[phyxel] < start.strength) return;
    const double load = stress.largest / start.strength;
    if (!(load > best.load)) return;
    const Vec3 along =
        grid.rest().node_position(start.edge.upper()) - grid.rest().node_position(start.edge.node);
    const Vec3 way = stress.world_from_rest * along;
    if (std::abs(stress.direction.dot(way)) < least_edge_cosine * way.norm()) return;
    Vec3 normal = (stress.world_from_rest.transpose() * stress.direction).normalized();
    const std::optional<Plane> weak_plane = weak_plane_at(start.rest);
    if (weak_plane && std::abs(weak_plane->normal.dot(normal)) > min_opening_cosine)
        normal = weak_plane->normal;
    if (!normal.allFinite() || beside_crack(start.rest, normal, load) || shadowed(grid, start.edge, normal))
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
    const double apart = std::max(reach_, wave_speed_ * context.dt);
    int vain = 0;
    for (const std::uint32_t i : order_) {
        const Vec3& rest = context.phyxels.rest_position[i];
        if (std::any_of(torn_now_.begin(), torn_now_.end(),
                        [&](const Vec3& at) { return (at - rest).squaredNorm() < apart * apart; }))
            continue;
        if (!begin_one(grid, context, i, slots) && ++vain == most_vain_tries) return;
    }
}

std::vector<std::int32_t> Tearing::tear(NodeGrid& grid, const TearContext& context) {
    std::vector<std::int32_t> slots;
    top_load_ = 0;
    if (context.neighbourhoods.size() != context.phyxels.size()) return slots;
    note_crossings(grid);
    break_ligaments(grid, context, slots);
    find_weakest(grid, context);
    if (measure_phyxels(context, min_stress()) <
        settings_.propagation_ratio * settings_.strength * weakest_all_)
        return slots;
    find_loads(context);
    if (top_load_ < min_load * settings_.propagation_ratio) return slots;
    ++step_;
    node_stress_.resize(context.nodes.kernels().size());
    phyxels_of_.assign(context.pieces.count(), 0);
    for (const std::int32_t piece : context.phyxels.piece) ++phyxels_of_[static_cast<std::size_t>(piece)];
    torn_now_.clear();
    find_loaded_front(grid, context);
    grow(grid, context, slots);
    begin_cracks(grid, context, slots);
    close_gaps(grid, context, slots);
    return slots;
}

}  // namespace splitcubes::body
