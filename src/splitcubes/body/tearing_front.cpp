// Where cracks may go on: their cells, and what of these is loaded.
#include <splitcubes/body/tearing.h>
#include <splitcubes/math/cofactor.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

constexpr std::size_t grain = 64;
// Of what `propose` allows a crack's plane to be turned by: 13.9 degrees, atan(t sin a / (1 - t + t cos a))
// for a share t = 1/4 of a direction a = 60 degrees off.
constexpr double most_turn_tangent = 0.2475;
// Cosine of 45 degrees less that: turned planes whose normals all lie within 45 degrees of another, or of its
// opposite, have a mean that does, and that is well within what shadows.
constexpr double sure_shadow_cosine = 0.857;
// Edges on one line, nearest first to either side.
constexpr std::array<int, 4> along_line{-1, -2, 1, 2};

// Of the two lips of a cut edge.
struct Gap {
    Vec3 way;  // m, world, from the lower one to the upper
    const geometry::Frame *lower, *upper;
    int axis;
};

}  // namespace

// nullptr where the last step did not track the node; `index` keeps what the tracker calls it.
const geometry::Frame* Tearing::frame_of(const TearContext& context, const Vec3i& node, std::int32_t& index) {
    if (index < 0) index = context.nodes.find(node);
    if (index < 0 || !context.nodes.is_awake(static_cast<std::uint32_t>(index)) ||
        static_cast<std::size_t>(index) >= context.frames.size())
        return nullptr;
    return &context.frames[static_cast<std::size_t>(index)];
}

// Takes in what blades, sheets and tearing have cut since the last step.
void Tearing::note_crossings(const NodeGrid& grid) {
    const auto& crossings = grid.crossings();
    for (; known_crossings_ < crossings.size(); ++known_crossings_) {
        const splitting::Crossing& c = crossings[known_crossings_];
        if (c.origin == splitting::Origin::boundary) continue;
        // As far as it shadows edges on its line.
        for (int along = -2; along <= 2; ++along) {
            GridEdge edge = c.edge;
            edge.node[edge.axis] += along;
            for_cells_around(grid, edge,
                             [&](const Key& cell) { note_crossing_beside(grid, cell, along == 0); });
        }
    }
}

// What is known of the cell's tip holds no more; one whose own edge is cut becomes a crack's.
void Tearing::note_crossing_beside(const NodeGrid& grid, const Key& cell, bool is_own) {
    const std::int32_t known = crack_number_.get({cell[0], cell[1], cell[2]}, 0);
    if (known >= 0) {
        crack_cells_[static_cast<std::size_t>(known)].is_stale = true;
    } else if (is_own) {
        crack_number_.set({cell[0], cell[1], cell[2]}, 0, static_cast<std::int32_t>(crack_cells_.size()));
        crack_cells_.emplace_back().place = cell;
        note_open_edges(grid, cell);
    }
}

// Notes the edges of a cell that a crack has just come to, unless cells around have brought them.
void Tearing::note_open_edges(const NodeGrid& grid, const Key& key) {
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge({key[0], key[1], key[2]}, e);
        if (!is_whole(grid, edge) || open_number_.get(edge.node, edge.axis) >= 0) continue;
        open_number_.set(edge.node, edge.axis, static_cast<std::int32_t>(open_.size()));
        open_.emplace_back().edge = edge;
    }
}

// What is cut stays so. Numbers change.
void Tearing::forget_cut_edges() {
    for (CrackCell& cell : crack_cells_) cell.is_stale = true;
    std::size_t kept = 0;
    for (const OpenEdge& open : open_) {
        const bool is_cut = open.stretch < 0;
        open_number_.set(open.edge.node, open.edge.axis, is_cut ? -1 : static_cast<std::int32_t>(kept));
        if (!is_cut) open_[kept++] = open;
    }
    open_.resize(kept);
}

// The plane of the cracks in a cell, and which uncut edges it meets, nearly. Lists the cell's lips, too.
Tearing::Tip Tearing::tip_of(const NodeGrid& grid, CrackCell& crack) const {
    const Vec3i cell(crack.place[0], crack.place[1], crack.place[2]);
    Tip tip;
    crack.crack_face_count = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const std::int32_t slot = grid.slot(splitting::cell_edge(cell, e));
        if (slot < 0 || grid.crossing(slot).origin == splitting::Origin::boundary) continue;
        const splitting::Crossing& c = grid.crossing(slot);
        tip.centre += grid.crossing_position(c);
        tip.normal += (c.normal.dot(tip.normal) < 0 ? -1 : 1) * c.normal;
        crack.crack_faces[crack.crack_face_count++] = {-1, -1, e, c.parameter};
    }
    const double count = crack.crack_face_count;
    if (count == 0 || !(tip.normal.norm() > 0.5)) return tip;
    tip.centre /= count;
    tip.normal.normalize();
    tip.weak_plane = weak_plane_at(tip.centre);
    if (tip.weak_plane && std::abs(tip.weak_plane->normal.dot(tip.normal)) < min_opening_cosine)
        tip.weak_plane.reset();
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge(cell, e);
        if (!is_whole(grid, edge)) continue;
        const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
        // Out of reach of any plane that is turned by so little.
        const double from = tip.normal.dot(a - tip.centre), to = tip.normal.dot(b - tip.centre);
        if (from * to > 0 && std::min(std::abs(from), std::abs(to)) > 0.4 * cell_size_) continue;
        if (!tip.weak_plane && !may_meet(tip, a, b)) continue;
        tip.edges |= std::uint32_t{1} << e;
        tip.shadows[static_cast<std::size_t>(e)] = sure_shadows(grid, tip, edge);
        tip.open[static_cast<std::size_t>(e)] = open_number_.get(edge.node, edge.axis);
    }
    return tip;
}

// Bit k: the crossing at along_line[k] edges from this one.
std::uint8_t Tearing::sure_shadows(const NodeGrid& grid, const Tip& tip, const GridEdge& edge) const {
    if (tip.weak_plane) return 0;
    unsigned out = 0;
    bool is_open = true;
    for (std::size_t k = 0; k < along_line.size(); ++k) {
        is_open = is_open || std::abs(along_line[k]) == 1;
        GridEdge other = edge;
        other.node[edge.axis] += along_line[k];
        is_open = is_open && grid.has_edge(other);
        const std::int32_t slot = is_open ? grid.slot(other) : -1;
        if (slot < 0) continue;
        const splitting::Crossing& c = grid.crossing(slot);
        is_open = c.origin != splitting::Origin::boundary;
        if (is_open && std::abs(c.normal.dot(tip.normal)) > sure_shadow_cosine) out |= 1U << k;
    }
    return static_cast<std::uint8_t>(out);
}

// Whether a plane through the tip's middle, turned by as much as stress may turn it, meets the edge
// from a to b or, by `edge_slack` of its length, its continuation.
bool Tearing::may_meet(const Tip& tip, const Vec3& a, const Vec3& b) {
    const Vec3 from = a - edge_slack * (b - a) - tip.centre, to = b + edge_slack * (b - a) - tip.centre;
    const double height_from = tip.normal.dot(from), height_to = tip.normal.dot(to);
    if (height_from * height_to <= 0) return true;
    // The distance from the normal is largest at an end.
    const double width =
        std::max((from - height_from * tip.normal).norm(), (to - height_to * tip.normal).norm());
    return std::min(std::abs(height_from), std::abs(height_to)) <= most_turn_tangent * width;
}

// The stress ahead of a crack by how far the lips in its last cell gape, beyond what the strain on
// either side makes. 0: closed, not known, or below any strength.
double Tearing::opening_stress(const TearContext& context, CrackCell& cell) const {
    if (opening_modulus_ == 0) return 0;
    double sum = 0, widest = 0;
    int count = 0;
    std::array<Gap, splitting::edge_count> gaps;
    for (std::uint32_t k = 0; k < cell.crack_face_count; ++k) {
        CrackFaces& crack_faces = cell.crack_faces[k];
        const GridEdge edge =
            splitting::cell_edge({cell.place[0], cell.place[1], cell.place[2]}, crack_faces.edge);
        const geometry::Frame* a = frame_of(context, edge.node, crack_faces.lower);
        const geometry::Frame* b = frame_of(context, edge.upper(), crack_faces.upper);
        if (!a || !b) continue;
        const Vec3 lower = a->position + crack_faces.parameter * cell_size_ * a->jacobian.col(edge.axis);
        const Vec3 upper =
            b->position - (1 - crack_faces.parameter) * cell_size_ * b->jacobian.col(edge.axis);
        gaps[static_cast<std::size_t>(count++)] = {upper - lower, a, b, edge.axis};
        widest = std::max(widest, (upper - lower).squaredNorm());
    }
    // Mostly the lips are nowhere as far apart as makes a difference.
    if (!(opening_modulus_ * std::sqrt(widest) > settings_.strength * weakest_all_)) return 0;
    const auto end = gaps.begin() + count;
    count = 0;
    for (auto gap = gaps.begin(); gap != end; ++gap) {
        const Mat3 jacobian = 0.5 * (gap->lower->jacobian + gap->upper->jacobian);
        Vec3 across = cofactor_of(jacobian) * cell.tip.normal;
        if (across.dot(jacobian * Vec3::Unit(gap->axis)) < 0) across = -across;
        if (!(across.norm() > 0)) continue;
        sum += gap->way.dot(across.normalized());
        ++count;
    }
    const double crack_opening = count > 0 ? sum / count : 0;
    return crack_opening > 0 ? opening_modulus_ * crack_opening : 0;
}

// Lists the phyxels near cracks; neither cells nor phyxels ever move. False where phyxels are new, as they
// may be in each step: a list would not last.
bool Tearing::list_near_phyxels(const NodeGrid& grid, const TearContext& context) {
    if (phyxels_known_ != context.phyxels.size()) {
        near_.clear();
        first_near_.assign(1, 0);
        phyxels_known_ = context.phyxels.size();
        return false;
    }
    for (std::size_t k = first_near_.size() - 1; k < crack_cells_.size(); ++k) {
        visit_near(grid, context, crack_cells_[k].place, [&](std::uint32_t i) {
            near_.push_back(i);
            return true;
        });
        first_near_.push_back(static_cast<std::uint32_t>(near_.size()));
    }
    return true;
}

// Cells of cracks that may go on, and near which a phyxel is loaded enough to let them.
void Tearing::find_loaded_front(const NodeGrid& grid, const TearContext& context) {
    const bool is_listed = list_near_phyxels(grid, context);
    is_loaded_.resize(crack_cells_.size());
    context.parallel.for_each(crack_cells_.size(), 4 * grain, [&](std::size_t k) {
        const CrackCell& cell = crack_cells_[k];
        is_loaded_[k] = 0;
        if (!cell.is_stale && cell.tip.edges == 0) return;
        const auto is_idle = [&](std::uint32_t i) {
            return !(load_[i] >= min_load * settings_.propagation_ratio);
        };
        is_loaded_[k] = !(is_listed ? std::all_of(near_.begin() + first_near_[k],
                                                  near_.begin() + first_near_[k + 1], is_idle)
                                    : visit_near(grid, context, cell.place, is_idle));
    });
    front_.clear();
    for (std::uint32_t k = 0; k < crack_cells_.size(); ++k)
        if (is_loaded_[k] != 0) front_.push_back(k);
}

// Lists the edges of the front, and brings up to date what its cells say of them.
void Tearing::ask_edges(const NodeGrid& grid, const TearContext& context) {
    context.parallel.for_each(front_.size(), grain, [&](std::size_t k) {
        CrackCell& cell = crack_cells_[front_[k]];
        if (cell.is_stale) cell.tip = tip_of(grid, cell);
        cell.is_stale = false;
        cell.opening_stress = cell.tip.edges != 0 ? opening_stress(context, cell) : 0;
    });
    ++round_;
    asked_.clear();
    for (const std::uint32_t number : front_) {
        const CrackCell& cell = crack_cells_[number];
        const bool comes_off = cell.opening_stress > slab_opening * settings_.strength * weakest_all_;
        for (std::uint32_t edges = cell.tip.edges; edges != 0; edges &= edges - 1) {
            const auto e = static_cast<std::size_t>(std::countr_zero(edges));
            const auto k = static_cast<std::uint32_t>(cell.tip.open[e]);
            OpenEdge& open = open_[k];
            if (open.asked != round_) {
                asked_.push_back(k);
                open.asked = round_;
                open.tip_count = 0;
                open.shadows = 0xff;
            }
            open.shadows &= comes_off ? 0 : cell.tip.shadows[e];
            open.tips[open.tip_count++] = number;
        }
    }
    std::erase_if(asked_, [&](std::uint32_t k) { return open_[k].shadows != 0; });
    for (const std::uint32_t k : asked_) {
        OpenEdge& open = open_[k];
        if (open.lower < 0) open.lower = context.nodes.find(open.edge.node);
        if (open.upper < 0) open.upper = context.nodes.find(open.edge.upper());
        want_stress(context, open.lower);
        want_stress(context, open.upper);
    }
}

}  // namespace splitcubes::body
