// How cracks go on, and which strands they leave.
#include <splitcubes/body/tearing.h>
#include <splitcubes/math/cofactor.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

constexpr std::size_t grain = 64;
// Of principal direction and a crack's normal where it goes on: 60 degrees.
constexpr double least_opening_cosine = 0.5;
// Share of the stress's direction in the normal of the next piece of a crack: the
// phyxels' stress is noisy across a tip, and a crack that turns at once is rough.
constexpr double turning_share = 0.25;
// How far beyond its ends an edge still counts as met, in edges: two planes of one
// crack differ by about so much, and an edge that both miss would stay as a strand.
constexpr double slack = 0.1;

}  // namespace

// nullptr where the last step did not track the node.
const geometry::Frame* Tearing::frame_of(const TearContext& context, const Vec3i& node) {
    const std::int32_t index = context.nodes.find(node);
    if (index < 0 || static_cast<std::size_t>(index) >= context.frames.size()) return nullptr;
    return &context.frames[static_cast<std::size_t>(index)];
}

// The same, where `index` keeps what the tracker calls the node.
const geometry::Frame* Tearing::frame_of(const TearContext& context, const Vec3i& node, std::int32_t& index) {
    if (index < 0) index = context.nodes.find(node);
    if (index < 0 || !context.nodes.is_awake(static_cast<std::uint32_t>(index)) ||
        static_cast<std::size_t>(index) >= context.frames.size())
        return nullptr;
    return &context.frames[static_cast<std::size_t>(index)];
}

// The plane of the cracks in a cell, and which uncut edges it meets, nearly.
Tearing::Tip Tearing::tip_of(const NodeGrid& grid, const TearContext& context, const Key& key) const {
    const Vec3i cell(key[0], key[1], key[2]);
    Tip tip;
    double count = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const std::int32_t slot = grid.slot(splitting::cell_edge(cell, e));
        if (slot < 0 || grid.crossing(slot).origin == splitting::Origin::boundary) continue;
        const splitting::Crossing& c = grid.crossing(slot);
        tip.centre += grid.crossing_position(c);
        tip.normal += (c.normal.dot(tip.normal) < 0 ? -1 : 1) * c.normal;
        ++count;
    }
    if (count == 0 || !(tip.normal.norm() > 0.5)) return tip;
    tip.centre /= count;
    tip.normal.normalize();
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge(cell, e);
        if (!may_tear(grid, edge, context)) continue;
        // Out of reach of any plane that is turned by so little.
        const double from = tip.normal.dot(grid.rest().node_position(edge.node) - tip.centre);
        const double to = tip.normal.dot(grid.rest().node_position(edge.upper()) - tip.centre);
        if (from * to > 0 && std::min(std::abs(from), std::abs(to)) > 0.4 * grid.rest().cell_size) continue;
        tip.edges |= std::uint32_t{1} << e;
    }
    if (tip.edges == 0) return tip;
    tip.gape_stress = gape_stress(grid, context, key, tip.normal);
    tip.seam = seam_at(tip.centre);
    if (tip.seam && std::abs(tip.seam->normal.dot(tip.normal)) < least_opening_cosine) tip.seam.reset();
    for (std::uint32_t edges = tip.seam ? 0 : tip.edges; edges != 0; edges &= edges - 1) {
        const GridEdge edge = splitting::cell_edge(cell, std::countr_zero(edges));
        if (!may_meet(tip, grid.rest().node_position(edge.node), grid.rest().node_position(edge.upper()),
                      slack))
            tip.edges &= ~(edges & -edges);
    }
    return tip;
}

// The stress ahead of a crack by how far the lips in its last cell gape, beyond what the strain on
// either side makes. 0: closed, or not known.
double Tearing::gape_stress(const NodeGrid& grid, const TearContext& context, const Key& key,
                            const Vec3& normal) const {
    if (gape_modulus_ == 0) return 0;
    double sum = 0;
    int count = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const std::int32_t slot = grid.slot(splitting::cell_edge({key[0], key[1], key[2]}, e));
        if (slot < 0 || grid.crossing(slot).origin == splitting::Origin::boundary) continue;
        const splitting::Crossing& c = grid.crossing(slot);
        const geometry::Frame *a = frame_of(context, c.edge.node), *b = frame_of(context, c.edge.upper());
        if (!a || !b) continue;
        const Vec3 at = grid.crossing_position(c);
        const Vec3 lower = a->position + a->jacobian * (at - grid.rest().node_position(c.edge.node));
        const Vec3 upper = b->position + b->jacobian * (at - grid.rest().node_position(c.edge.upper()));
        const Mat3 jacobian = 0.5 * (a->jacobian + b->jacobian);
        Vec3 across = cofactor_of(jacobian) * normal;
        if (across.dot(jacobian * Vec3::Unit(c.edge.axis)) < 0) across = -across;
        if (!(across.norm() > 0)) continue;
        sum += (upper - lower).dot(across.normalized());
        ++count;
    }
    const double gape = count > 0 ? sum / count : 0;
    return gape > 0 ? gape_modulus_ * gape : 0;
}

// Whether the edge of a crack's cell cannot bear its stress, and how it parts.
bool Tearing::propose(const NodeGrid& grid, const Tip& tip, std::uint32_t number, const GridEdge& edge,
                      Proposal& out) const {
    const Stress& stress = loaded_edges_[number].stress;
    const double strength = loaded_edges_[number].strength;
    const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
    Vec3 wanted = (stress.world_from_rest.transpose() * stress.direction).normalized();
    if (wanted.dot(tip.normal) < 0) wanted = -wanted;
    const double gape = tip.gape_stress / strength;
    double load = stress.largest / strength;
    Vec3 turned = tip.normal;
    if (load > settings_.toughness && wanted.dot(tip.normal) > least_opening_cosine)
        turned = ((1 - turning_share) * tip.normal + turning_share * wanted).normalized();
    else if (load = gape; !(load > 1))
        return false;
    Vec3 through = tip.centre;
    if (tip.seam) {
        through -= 0.5 * (tip.centre - tip.seam->point).dot(tip.seam->normal) * tip.seam->normal;
        turned = (tip.normal.dot(tip.seam->normal) < 0 ? -1 : 1) * tip.seam->normal;
    }
    const double along = turned.dot(b - a);
    if (std::abs(along) < 0.1 * grid.rest().cell_size) return false;
    const double parameter = turned.dot(through - a) / along;
    if (parameter < -slack || parameter > 1 + slack) return false;
    out = {splitting::edge_id(edge), load, std::clamp(parameter, 0.0, 1.0), turned, 0, gape};
    return true;
}

// What the cells of the front propose, cell by cell.
void Tearing::find_proposals(const NodeGrid& grid, const TearContext& context, std::span<const Key> front) {
    tips_.resize(front.size());
    context.parallel.for_each(front.size(), grain,
                              [&](std::size_t k) { tips_[k] = tip_of(grid, context, front[k]); });
    requests_.clear();
    for (std::uint32_t k = 0; k < front.size(); ++k)
        for (std::uint32_t edges = tips_[k].edges; edges != 0; edges &= edges - 1) {
            const Vec3i cell(front[k][0], front[k][1], front[k][2]);
            const GridEdge edge = splitting::cell_edge(cell, std::countr_zero(edges));
            requests_.push_back({k, ask(grid, edge, context), edge});
        }
    spare_shadowed(grid, context);
    answer(context);
    proposals_.resize(requests_.size());
    context.parallel.for_each(requests_.size(), grain, [&](std::size_t r) {
        const Request& request = requests_[r];
        if (!propose(grid, tips_[request.tip], request.number, request.edge, proposals_[r]))
            proposals_[r].id = no_edge;
    });
    std::erase_if(proposals_, [](const Proposal& p) { return p.id == no_edge; });
}

// An edge that several cells propose takes the mean of what they say; the most loaded first.
void Tearing::merge_proposals() {
    for (std::uint32_t k = 0; k < proposals_.size(); ++k) proposals_[k].order = k;
    std::sort(proposals_.begin(), proposals_.end(), [](const Proposal& a, const Proposal& b) {
        return a.id != b.id ? a.id < b.id : a.order < b.order;
    });
    std::size_t kept = 0;
    for (std::size_t begin = 0, end = 0; begin < proposals_.size(); begin = end) {
        Proposal mean = proposals_[begin];
        for (end = begin + 1; end < proposals_.size() && proposals_[end].id == mean.id; ++end) {
            const Proposal& other = proposals_[end];
            mean.load = std::max(mean.load, other.load);
            mean.gape = std::max(mean.gape, other.gape);
            mean.parameter += other.parameter;
            mean.normal += (other.normal.dot(mean.normal) < 0 ? -1 : 1) * other.normal;
        }
        mean.parameter /= static_cast<double>(end - begin);
        proposals_[kept++] = mean;
    }
    proposals_.resize(kept);
    std::sort(proposals_.begin(), proposals_.end(), [](const Proposal& a, const Proposal& b) {
        return a.load != b.load ? a.load > b.load : a.id < b.id;
    });
}

// The cells around these cuts, each once, in order.
void Tearing::cells_of(const NodeGrid& grid, std::span<const std::int32_t> slots, std::vector<Key>& out) {
    out.clear();
    for (const std::int32_t slot : slots)
        for_cells_around(grid, grid.crossing(slot).edge, [&](const Key& cell) { out.push_back(cell); });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
}

void Tearing::grow(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    const double rings = std::clamp(crack_speed_ * context.dt / grid.rest().cell_size, 1.0, 1000.0);
    for (int ring = 0; ring < static_cast<int>(rings) && !front_.empty(); ++ring) {
        // One ring of cells around the front, and then those of what was cut.
        find_proposals(grid, context, front_);
        merge_proposals();
        const std::size_t before = slots.size();
        for (const Proposal& proposal : proposals_) cut(grid, proposal, slots);
        cells_of(grid, std::span(slots).subspan(before), front_);
        if (slots.size() > before) note_crossings(grid);
    }
}

// Cells of cracks near which a phyxel is loaded enough to let them go on.
void Tearing::find_loaded_front(const NodeGrid& grid, const TearContext& context) {
    is_loaded_.resize(crack_cells_.size());
    context.parallel.for_each(crack_cells_.size(), grain, [&](std::size_t k) {
        const Key& c = crack_cells_[k];
        const Vec3 centre =
            grid.rest().node_position({c[0], c[1], c[2]}) + Vec3::Constant(0.5 * grid.rest().cell_size);
        is_loaded_[k] = !context.locator.visit(centre, 1.5 * context.spacing, [&](std::uint32_t i) {
            return !(load_[i] >= least_load * settings_.toughness);
        });
    });
    front_.clear();
    for (std::size_t k = 0; k < is_loaded_.size(); ++k)
        if (is_loaded_[k]) front_.push_back(crack_cells_[k]);
}

// Notes the edges of a cell that a crack has just come to. Those of crack cells around have been noted, as
// what is not cut now was not cut then.
void Tearing::note_edges_beside(const NodeGrid& grid, const Key& key) {
    const Vec3i cell(key[0], key[1], key[2]);
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge(cell, e);
        if (grid.is_cut(edge) || !grid.inside(edge.node) || !grid.inside(edge.upper())) continue;
        bool is_known = false;
        for_cells_around(grid, edge, [&](const Key& other) {
            is_known = is_known || (other != key && is_crack_cell(grid, {other[0], other[1], other[2]}));
        });
        if (!is_known) beside_.push_back({edge, 0});
    }
}

// Edges beside cracks that are stretched beyond all measure; of those that share a
// node the most stretched one.
void Tearing::break_strands(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    context.parallel.for_each(beside_.size(), 4 * grain, [&](std::size_t k) {
        Beside& beside = beside_[k];
        beside.stretch = -1;
        if (grid.is_cut(beside.edge)) return;
        const geometry::Frame* a = frame_of(context, beside.edge.node, beside.lower);
        const geometry::Frame* b = frame_of(context, beside.edge.upper(), beside.upper);
        beside.stretch = a && b ? (b->position - a->position).norm() / cell_size_ : 0;
    });
    proposals_.clear();
    for (const Beside& beside : beside_)
        if (beside.stretch > break_stretch_)
            proposals_.push_back(
                {splitting::edge_id(beside.edge), beside.stretch, 0.5, Vec3::Unit(beside.edge.axis)});
    // What is cut stays so.
    std::erase_if(beside_, [](const Beside& beside) { return beside.stretch < 0; });
    std::sort(proposals_.begin(), proposals_.end(), [](const Proposal& x, const Proposal& y) {
        return x.load != y.load ? x.load > y.load : x.id < y.id;
    });
    parted_.clear();
    for (const Proposal& proposal : proposals_) {
        const GridEdge edge = splitting::edge_from_id(proposal.id);
        const Vec3i low = edge.node, high = edge.upper();
        const Key a{low[0], low[1], low[2]}, b{high[0], high[1], high[2]};
        const auto has_parted = [&](const Key& node) {
            return std::find(parted_.begin(), parted_.end(), node) != parted_.end();
        };
        if (has_parted(a) || has_parted(b)) continue;
        parted_.push_back(a);
        parted_.push_back(b);
        const std::int32_t slot =
            grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
        if (slot >= 0) slots.push_back(slot);
    }
}

}  // namespace splitcubes::body
