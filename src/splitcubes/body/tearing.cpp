#include <splitcubes/body/tearing.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/constitutive.h>
#include <splitcubes/meshless/kernel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

constexpr std::size_t grain = 256;
// In place of the norm of a stress: what moves the phyxel is not its stress.
constexpr double held_phyxel = -2;
// Of principal direction and deformed edge where a crack begins: 45 degrees.
constexpr double least_edge_cosine = 0.7071;
// Of principal direction and a crack's normal where it goes on: 60 degrees.
constexpr double least_opening_cosine = 0.5;
// Share of the stress's direction in the normal of the next piece of a crack: the
// phyxels' stress is noisy across a tip, and a crack that turns at once is rough.
constexpr double turning_share = 0.25;
// How far beyond its ends an edge still counts as met, in edges: two planes of one
// crack differ by about so much, and an edge that both miss would stay as a strand.
constexpr double slack = 0.1;
// Of a bound, for the rounding of what it bounds: relative, far above both.
constexpr double bound_slack = 1e-6;
// Pieces below these have no stress field to speak of.
constexpr std::size_t least_phyxels = 16;
constexpr std::size_t least_nodes = 64;
// A phyxel whose edges are all below the strength costs its search; so many a step at most.
constexpr int most_vain_tries = 4;

// The cells that share an edge.
std::vector<Vec3i> cells_around(const NodeGrid& grid, const GridEdge& edge) {
    std::vector<Vec3i> cells;
    for (int k = 0; k < 4; ++k) {
        Vec3i cell = edge.node;
        cell[(edge.axis + 1) % 3] -= k & 1;
        cell[(edge.axis + 2) % 3] -= k >> 1;
        if (grid.has_cell(cell)) cells.push_back(cell);
    }
    return cells;
}

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

// Whether the edge is the riser of a step between two sheets: one has passed its lower
// node, the other its upper one, on opposite sides and at most a few cells apart.
bool is_riser(const NodeGrid& grid, const GridEdge& edge) {
    constexpr int most = 3;
    for (int k = 1; k <= 2; ++k) {
        const int across = (edge.axis + k) % 3;
        const int low_back = way_to_crack(grid, edge.node, across, -1, most);
        const int low_ahead = way_to_crack(grid, edge.node, across, 1, most);
        const int high_back = way_to_crack(grid, edge.upper(), across, -1, most);
        const int high_ahead = way_to_crack(grid, edge.upper(), across, 1, most);
        if (low_back + high_ahead < most && low_ahead == most && high_back == most) return true;
        if (low_ahead + high_back < most && low_back == most && high_ahead == most) return true;
    }
    return false;
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

// Takes in what blades, sheets and tearing have cut since the last step.
void Tearing::note_crossings(const NodeGrid& grid) {
    const auto& crossings = grid.crossings();
    for (; known_crossings_ < crossings.size(); ++known_crossings_) {
        const splitting::Crossing& c = crossings[known_crossings_];
        if (c.origin == splitting::Origin::boundary) continue;
        const Vec3 rest = grid.crossing_position(c);
        const Vec3i cube = (rest / cube_).array().floor().cast<int>();
        crack_points_[{cube[0], cube[1], cube[2]}].push_back({rest, c.normal});
        for (const Vec3i& cell : cells_around(grid, c.edge)) {
            const Key key{cell[0], cell[1], cell[2]};
            if (is_crack_cell_.insert(key).second) crack_cells_.push_back(key);
        }
    }
}

// A weak region may be thinner than the phyxels' spacing: each answers for the
// weakest node within half a spacing along each axis.
void Tearing::find_weakest(const NodeGrid& grid, const TearContext& context) {
    const std::size_t known = weakest_.size(), count = context.phyxels.size();
    weakest_.resize(count, settings_.strength);
    own_rank_.resize(count, 3);
    if (!settings_.strength_factor) return;
    context.parallel.for_each(count - known, grain, [&](std::size_t k) {
        const Vec3& rest = context.phyxels.rest_position[known + k];
        const Vec3 half = Vec3::Constant(0.5 * context.spacing);
        const Vec3i low = grid.rest().to_grid(rest - half).array().floor().cast<int>();
        const Vec3i high = grid.rest().to_grid(rest + half).array().ceil().cast<int>();
        double weakest = strength_at(rest);
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x)
                    weakest = std::min(weakest, strength_at(grid.rest().node_position({x, y, z})));
        weakest_[known + k] = weakest;
    });
}

// Returns the largest norm of a stress, an upper bound of all principal stresses.
double Tearing::measure_phyxels(const TearContext& context) {
    const meshless::Phyxels& p = context.phyxels;
    const std::size_t count = p.size();
    stress_.resize(count);
    size_.resize(count);
    const auto rank = context.neighbourhoods.rank();
    const bool some_held = context.held.size() == count;
    context.parallel.for_each(count, grain, [&](std::size_t i) {
        stress_[i].setZero();
        size_[i] = -1;
        if (some_held && context.held[i]) size_[i] = held_phyxel;
        if (rank[i] < own_rank_[i] || size_[i] == held_phyxel) return;
        const Mat3& F = p.deformation[i];
        const double volume = F.determinant();
        if (!(volume > 0.05)) return;
        const Mat3 cauchy = meshless::piola_stress(context.material, F, p.rotation[i], p.plastic_strain[i]) *
                            F.transpose() / volume;
        if (!cauchy.allFinite()) return;
        stress_[i] = 0.5 * (cauchy + cauchy.transpose());
        size_[i] = stress_[i].norm();
    });
    double largest = 0;
    for (const double size : size_) largest = std::max(largest, size);
    return largest;
}

void Tearing::find_loads(const TearContext& context) {
    const meshless::Neighbourhoods& n = context.neighbourhoods;
    load_.assign(context.phyxels.size(), 0);
    principal_.resize(load_.size());
    context.parallel.for_each(load_.size(), grain, [&](std::size_t i) {
        principal_[i] =
            size_[i] < 0 ? -std::numeric_limits<double>::infinity() : eigen_symmetric(stress_[i]).values[0];
        // The mean over the neighbours cannot be near the limit where none of them is.
        const std::size_t begin = n.offsets()[i], end = n.offsets()[i + 1];
        double largest = size_[i];
        for (std::size_t k = begin; k < end; ++k)
            if (n.weight()[k] > 0) largest = std::max(largest, size_[n.neighbour()[k]]);
        if (!(largest >= settings_.toughness * weakest_[i])) return;
        double total = 0;
        Mat3 sum = Mat3::Zero();
        const auto add = [&](std::size_t j, double weight) {
            if (size_[j] < 0) return;
            sum += weight * stress_[j];
            total += weight;
        };
        add(i, meshless::kernel(0, context.phyxels.support_radius[i]));
        for (std::size_t k = begin; k < end; ++k) add(n.neighbour()[k], n.weight()[k]);
        if (!(total > 0)) return;
        load_[i] = eigen_symmetric(sum / total).values[0] / std::max(weakest_[i], 1e-300);
    });
    for (const double load : load_) top_load_ = std::max(top_load_, load);
}

// No phyxel has a say where the stress is no larger than `least` in any of them: no mean of tensors
// has a larger principal value than the largest of theirs, so whom the place sees need not be asked.
Tearing::Stress Tearing::stress_at(const GridEdge& edge, const Vec3& rest, std::int32_t piece, double least,
                                   const TearContext& context, std::vector<std::uint32_t>& near) const {
    const meshless::Phyxels& p = context.phyxels;
    const std::uint64_t id = splitting::edge_id(edge);
    const EdgeSights::List* seen = sights_.find(id);
    if (!seen) {
        context.locator.near(rest, reach_, near);
        const double enough = least - bound_slack * std::abs(least);
        const auto loaded = [&](std::uint32_t j) {
            return p.piece[j] == piece && !(principal_[j] <= enough);
        };
        if (std::none_of(near.begin(), near.end(), loaded)) return {};
        EdgeSights::List list;
        for (const std::uint32_t j : near) {
            if (p.piece[j] != piece) continue;
            const double weight =
                meshless::kernel((p.rest_position[j] - rest).squaredNorm(), p.support_radius[j]);
            if (weight > 0 && !context.occluders.segment_blocked(rest, p.rest_position[j]))
                list.push_back({j, weight});
        }
        seen = &sights_.keep(id, std::move(list));
    }
    double total = 0, held = 0;
    Mat3 sum = Mat3::Zero(), gradient = Mat3::Zero();
    for (const auto& [j, weight] : *seen) {
        if (size_[j] == held_phyxel) held += weight;
        if (size_[j] < 0) continue;
        sum += weight * stress_[j];
        gradient += weight * p.deformation[j];
        total += weight;
    }
    Stress out;
    if (!(total > held)) return out;
    const SymmetricEigen eigen = eigen_symmetric(sum / total);
    out.largest = eigen.values[0];
    out.direction = eigen.vectors.col(0);
    out.world_from_rest = gradient / total;
    return out;
}

bool Tearing::may_tear(const NodeGrid& grid, const GridEdge& edge, const TearContext& context) const {
    if (!grid.has_edge(edge) || !grid.inside(edge.node) || !grid.inside(edge.upper()) || grid.is_cut(edge))
        return false;
    const auto piece = static_cast<std::size_t>(context.pieces.piece_of(grid, edge.node));
    return phyxels_of_[piece] >= least_phyxels && context.pieces.node_counts()[piece] >= least_nodes;
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
            if (std::abs(c.normal.dot(normal)) > least_opening_cosine) return true;
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
                std::abs(point.normal.dot(rest_normal)) > least_opening_cosine)
                return true;
    }
    return false;
}

// The uncut edges of a cell that its crack's plane meets and that cannot bear their
// stress.
void Tearing::propose_from(const NodeGrid& grid, const TearContext& context, const Key& key,
                           std::vector<Proposal>& out) const {
    const Vec3i cell(key[0], key[1], key[2]);
    Vec3 centre = Vec3::Zero(), normal = Vec3::Zero();
    double count = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const std::int32_t slot = grid.slot(splitting::cell_edge(cell, e));
        if (slot < 0 || grid.crossing(slot).origin == splitting::Origin::boundary) continue;
        const splitting::Crossing& c = grid.crossing(slot);
        centre += grid.crossing_position(c);
        normal += (c.normal.dot(normal) < 0 ? -1 : 1) * c.normal;
        ++count;
    }
    if (count == 0 || !(normal.norm() > 0.5)) return;
    centre /= count;
    normal.normalize();
    std::optional<Plane> seam = seam_at(centre);
    if (seam && std::abs(seam->normal.dot(normal)) < least_opening_cosine) seam.reset();
    std::vector<std::uint32_t> near;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge(cell, e);
        if (!may_tear(grid, edge, context)) continue;
        const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
        const double h = grid.rest().cell_size;
        // Out of reach of any plane that is turned by so little.
        const double from = normal.dot(a - centre), to = normal.dot(b - centre);
        if (from * to > 0 && std::min(std::abs(from), std::abs(to)) > 0.4 * h) continue;
        const Vec3 middle = 0.5 * (a + b);
        const double strength = std::max(strength_at(middle), 1e-300);
        const Stress stress = stress_at(edge, middle, context.pieces.piece_of(grid, edge.node),
                                        settings_.toughness * strength, context, near);
        const double load = stress.largest / strength;
        if (!(stress.direction.squaredNorm() > 0) || !(load > settings_.toughness)) continue;
        Vec3 wanted = (stress.world_from_rest.transpose() * stress.direction).normalized();
        if (wanted.dot(normal) < 0) wanted = -wanted;
        if (!(wanted.dot(normal) > least_opening_cosine)) continue;
        Vec3 turned = ((1 - turning_share) * normal + turning_share * wanted).normalized();
        Vec3 through = centre;
        if (seam) {
            through -= 0.5 * (centre - seam->point).dot(seam->normal) * seam->normal;
            turned = (normal.dot(seam->normal) < 0 ? -1 : 1) * seam->normal;
        }
        const double along = turned.dot(b - a);
        if (std::abs(along) < 0.1 * h) continue;
        const double parameter = turned.dot(through - a) / along;
        if (parameter < -slack || parameter > 1 + slack) continue;
        out.push_back({splitting::edge_id(edge), load, std::clamp(parameter, 0.0, 1.0), turned});
    }
}

std::int32_t Tearing::cut(NodeGrid& grid, const Proposal& proposal, std::vector<std::int32_t>& slots) {
    const GridEdge edge = splitting::edge_from_id(proposal.id);
    if (shadowed(grid, edge, proposal.normal)) return -1;
    const std::int32_t slot =
        grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
    if (slot < 0) return -1;
    slots.push_back(slot);
    torn_now_.push_back(grid.crossing_position(grid.crossing(slot)));
    return slot;
}

// One ring of cells around the front; returns the cells of what was cut.
std::vector<Tearing::Key> Tearing::grow_once(NodeGrid& grid, const TearContext& context,
                                             const std::vector<Key>& front,
                                             std::vector<std::int32_t>& slots) {
    std::vector<std::vector<Proposal>> found(front.size());
    context.parallel.for_each(front.size(), 4,
                              [&](std::size_t k) { propose_from(grid, context, front[k], found[k]); });
    // An edge that several cells propose takes the mean of what they say.
    std::vector<Proposal> proposals;
    for (const auto& some : found) proposals.insert(proposals.end(), some.begin(), some.end());
    std::stable_sort(proposals.begin(), proposals.end(),
                     [](const Proposal& a, const Proposal& b) { return a.id < b.id; });
    std::vector<Proposal> merged;
    for (std::size_t begin = 0, end = 0; begin < proposals.size(); begin = end) {
        Proposal mean = proposals[begin];
        for (end = begin + 1; end < proposals.size() && proposals[end].id == mean.id; ++end) {
            const Proposal& other = proposals[end];
            mean.load = std::max(mean.load, other.load);
            mean.parameter += other.parameter;
            mean.normal += (other.normal.dot(mean.normal) < 0 ? -1 : 1) * other.normal;
        }
        mean.parameter /= static_cast<double>(end - begin);
        merged.push_back(mean);
    }
    std::stable_sort(merged.begin(), merged.end(),
                     [](const Proposal& a, const Proposal& b) { return a.load > b.load; });
    const std::size_t before = slots.size();
    for (const Proposal& proposal : merged) cut(grid, proposal, slots);
    if (slots.size() == before) return {};
    note_crossings(grid);
    std::set<Key> next;
    for (std::size_t k = before; k < slots.size(); ++k)
        for (const Vec3i& cell : cells_around(grid, grid.crossing(slots[k]).edge))
            next.insert({cell[0], cell[1], cell[2]});
    return {next.begin(), next.end()};
}

// The samples on both sides of a crack no longer see each other, so what holds there
// would hold without a force, as a strand. Looks at the cells that this step's cuts
// have touched, whatever the stress.
void Tearing::close_gaps(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    constexpr int most_passes = 4;
    for (int pass = 0; pass < most_passes; ++pass) {
        std::set<Key> cells;
        for (const std::int32_t slot : slots)
            for (const Vec3i& cell : cells_around(grid, grid.crossing(slot).edge))
                cells.insert({cell[0], cell[1], cell[2]});
        std::vector<Proposal> proposals;
        for (const Key& key : cells) {
            const Vec3i cell(key[0], key[1], key[2]);
            for (int e = 0; e < splitting::edge_count; ++e) {
                const GridEdge edge = splitting::cell_edge(cell, e);
                if (!may_tear(grid, edge, context)) continue;
                if (passed_around(grid, edge) || is_riser(grid, edge))
                    proposals.push_back({splitting::edge_id(edge), 0, 0.5, Vec3::Unit(edge.axis)});
            }
        }
        const std::size_t before = slots.size();
        for (const Proposal& proposal : proposals) cut(grid, proposal, slots);
        if (slots.size() == before) return;
        note_crossings(grid);
    }
}

// Edges beside cracks that are stretched beyond all measure; of those that share a
// node the most stretched one.
void Tearing::break_strands(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    std::vector<Proposal> proposals;
    const auto place_of = [&](const Vec3i& node) -> const Vec3* {
        const std::int32_t index = context.nodes.find(node);
        if (index < 0 || static_cast<std::size_t>(index) >= context.frames.size()) return nullptr;
        return &context.frames[static_cast<std::size_t>(index)].position;
    };
    for (const Key& key : crack_cells_)
        for (int e = 0; e < splitting::edge_count; ++e) {
            const GridEdge edge = splitting::cell_edge({key[0], key[1], key[2]}, e);
            if (grid.is_cut(edge) || !grid.inside(edge.node) || !grid.inside(edge.upper())) continue;
            const Vec3 *a = place_of(edge.node), *b = place_of(edge.upper());
            if (!a || !b) continue;
            const double stretch = (*b - *a).norm() / cell_size_;
            if (stretch > break_stretch_)
                proposals.push_back({splitting::edge_id(edge), stretch, 0.5, Vec3::Unit(edge.axis)});
        }
    std::sort(proposals.begin(), proposals.end(), [](const Proposal& x, const Proposal& y) {
        return x.load != y.load ? x.load > y.load : x.id < y.id;
    });
    std::set<Key> parted;
    for (const Proposal& proposal : proposals) {
        const GridEdge edge = splitting::edge_from_id(proposal.id);
        const Vec3i low = edge.node, high = edge.upper();
        const Key a{low[0], low[1], low[2]}, b{high[0], high[1], high[2]};
        if (parted.count(a) || parted.count(b)) continue;
        parted.insert(a);
        parted.insert(b);
        const std::int32_t slot =
            grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
        if (slot >= 0) slots.push_back(slot);
    }
}

void Tearing::grow(NodeGrid& grid, const TearContext& context, std::vector<Key> front,
                   std::vector<std::int32_t>& slots) {
    const double rings = std::clamp(crack_speed_ * context.dt / grid.rest().cell_size, 1.0, 1000.0);
    for (int ring = 0; ring < static_cast<int>(rings) && !front.empty(); ++ring)
        front = grow_once(grid, context, front, slots);
}

// Cells of cracks near which a phyxel is loaded enough to let them go on.
std::vector<Tearing::Key> Tearing::loaded_front(const NodeGrid& grid, const TearContext& context) const {
    std::vector<std::uint8_t> loaded(crack_cells_.size(), 0);
    context.parallel.for_chunks(loaded.size(), 64, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> near;
        for (std::size_t k = begin; k < end; ++k) {
            const Key& c = crack_cells_[k];
            const Vec3 centre =
                grid.rest().node_position({c[0], c[1], c[2]}) + Vec3::Constant(0.5 * grid.rest().cell_size);
            context.locator.near(centre, 1.5 * context.spacing, near);
            loaded[k] = std::any_of(near.begin(), near.end(),
                                    [&](std::uint32_t i) { return load_[i] >= 0.8 * settings_.toughness; });
        }
    });
    std::vector<Key> front;
    for (std::size_t k = 0; k < loaded.size(); ++k)
        if (loaded[k]) front.push_back(crack_cells_[k]);
    return front;
}

// A crack at the most loaded edge around a phyxel. False where none is overloaded.
bool Tearing::begin_one(NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                        std::vector<std::int32_t>& slots) {
    const Vec3& rest = context.phyxels.rest_position[phyxel];
    const Vec3 half = Vec3::Constant(0.5 * context.spacing);
    const Vec3i low = grid.rest().to_grid(rest - half).array().floor().cast<int>();
    const Vec3i high = grid.rest().to_grid(rest + half).array().ceil().cast<int>();
    std::vector<std::uint32_t> near;
    Proposal best{0, 1, 0.5, Vec3::Zero()};
    for (int z = low[2]; z <= high[2]; ++z)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int x = low[0]; x <= high[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (!may_tear(grid, edge, context)) continue;
                    if (context.pieces.piece_of(grid, edge.node) != context.phyxels.piece[phyxel]) continue;
                    const Vec3 a = grid.rest().node_position(edge.node);
                    const Vec3 b = grid.rest().node_position(edge.upper());
                    const double strength = std::max(strength_at(0.5 * (a + b)), 1e-300);
                    if (2 * load_[phyxel] * weakest_[phyxel] < strength) continue;
                    const Stress stress = stress_at(edge, 0.5 * (a + b), context.phyxels.piece[phyxel],
                                                    best.load * strength, context, near);
                    if (!(stress.largest / strength > best.load)) continue;
                    const Vec3 way = stress.world_from_rest * (b - a);
                    if (std::abs(stress.direction.dot(way)) < least_edge_cosine * way.norm()) continue;
                    Vec3 normal = (stress.world_from_rest.transpose() * stress.direction).normalized();
                    const std::optional<Plane> seam = seam_at(0.5 * (a + b));
                    if (seam && std::abs(seam->normal.dot(normal)) > least_opening_cosine)
                        normal = seam->normal;
                    if (!normal.allFinite() ||
                        beside_crack(0.5 * (a + b), normal, stress.largest / strength) ||
                        shadowed(grid, edge, normal))
                        continue;
                    best = {splitting::edge_id(edge), stress.largest / strength, 0.5, normal};
                }
    if (!(best.normal.squaredNorm() > 0)) return false;
    const std::size_t known = crack_cells_.size();
    if (cut(grid, best, slots) < 0) return false;
    note_crossings(grid);
    grow(grid, context, {crack_cells_.begin() + static_cast<std::ptrdiff_t>(known), crack_cells_.end()},
         slots);
    return true;
}

void Tearing::begin_cracks(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < load_.size(); ++i)
        if (load_[i] > 1) order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return load_[a] > load_[b]; });
    const double apart = std::max(reach_, wave_speed_ * context.dt);
    int vain = 0;
    for (const std::uint32_t i : order) {
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
    break_strands(grid, context, slots);
    find_weakest(grid, context);
    if (measure_phyxels(context) < settings_.toughness * settings_.strength * weakest_all_) return slots;
    find_loads(context);
    if (top_load_ < 0.8 * settings_.toughness) return slots;
    sights_.begin(context.surface_revision, context.phyxels.size());
    phyxels_of_.assign(context.pieces.count(), 0);
    for (const std::int32_t piece : context.phyxels.piece) ++phyxels_of_[static_cast<std::size_t>(piece)];
    torn_now_.clear();
    grow(grid, context, loaded_front(grid, context), slots);
    begin_cracks(grid, context, slots);
    close_gaps(grid, context, slots);
    return slots;
}

}  // namespace splitcubes::body
