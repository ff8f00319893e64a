// Crack tips, the cells that are loaded, and the edges that a crack may cut next.
#include <splitcubes/fracture/crack_front.h>
#include <splitcubes/fracture/tuning.h>
#include <splitcubes/math/cofactor.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Offsets of edges on one grid line, nearest first to either side.
constexpr std::array<int, 4> along_line{-1, -2, 1, 2};

// The two crack faces of a cut edge.
struct FacePair {
    Vec3 separation;  // m, world, from the lower face to the upper one
    const geometry::Frame *lower, *upper;
    int axis;
};

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

CrackFront::CrackFront(const StrengthField& strength, StressField& stress, CrackCells& cells,
                       const meshless::Material& material, const NodeGrid& grid)
    : strength_(strength),
      stress_(stress),
      cells_(cells),
      crack_speed_(strength.settings().crack_speed > 0
                       ? strength.settings().crack_speed
                       : 0.4 * std::sqrt(material.lame_mu() / material.density)),
      cell_size_(grid.rest().cell_size),
      opening_modulus_(opening_modulus(material, cell_size_, stress.reach())) {}

// Returns the mean plane of the cracks in a cell and the uncut edges within its reach. Also lists the cell's
// crack faces.
CrackTip CrackFront::tip_of(const NodeGrid& grid, CrackCell& crack) const {
    const Vec3i cell(crack.cell[0], crack.cell[1], crack.cell[2]);
    CrackTip tip;
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
    tip.weak_plane = strength_.weak_plane_at(tip.centre);
    if (tip.weak_plane &&
        std::abs(tip.weak_plane->normal.dot(tip.normal)) < tuning::tearing::min_opening_cosine)
        tip.weak_plane.reset();
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge(cell, e);
        if (!CrackCells::is_uncut(grid, edge)) continue;
        const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
        // Cheap test: no plane that is turned so little reaches the edge.
        const double from = tip.normal.dot(a - tip.centre), to = tip.normal.dot(b - tip.centre);
        if (from * to > 0 && std::min(std::abs(from), std::abs(to)) > 0.4 * cell_size_) continue;
        if (!tip.weak_plane && !may_meet(tip, a, b)) continue;
        tip.edges |= std::uint32_t{1} << e;
        tip.shielding[static_cast<std::size_t>(e)] = certain_shielding(grid, tip, edge);
        tip.open[static_cast<std::size_t>(e)] = cells_.open_index_of(edge);
    }
    return tip;
}

// Returns the crossings that shield an edge from any cut that the tip may propose. Bit k: the crossing at
// along_line[k] edges from this one.
std::uint8_t CrackFront::certain_shielding(const NodeGrid& grid, const CrackTip& tip, const GridEdge& edge) {
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
        if (is_open && std::abs(c.normal.dot(tip.normal)) > tuning::tearing::certain_shielding_cosine)
            out |= 1U << k;
    }
    return static_cast<std::uint8_t>(out);
}

// Returns whether a plane through the tip's centre, rotated by at most the maximum angle of one continuation,
// can cross the edge from a to b, extended by edge_slack at both ends.
bool CrackFront::may_meet(const CrackTip& tip, const Vec3& a, const Vec3& b) {
    const Vec3 from = a - tuning::tearing::edge_slack * (b - a) - tip.centre,
               to = b + tuning::tearing::edge_slack * (b - a) - tip.centre;
    const double height_from = tip.normal.dot(from), height_to = tip.normal.dot(to);
    if (height_from * height_to <= 0) return true;
    // The distance from the normal is largest at an end.
    const double width =
        std::max((from - height_from * tip.normal).norm(), (to - height_to * tip.normal).norm());
    return std::min(std::abs(height_from), std::abs(height_to)) <= tuning::tearing::max_turn_tangent * width;
}

// Returns the stress, Pa, ahead of a crack that is implied by its opening in the cell, without the part that
// the strain on either side explains. 0: closed, unknown, or below any strength.
double CrackFront::opening_stress(const TearContext& context, CrackCell& cell) const {
    if (opening_modulus_ == 0) return 0;
    double sum = 0, widest_squared = 0;
    int count = 0;
    std::array<FacePair, splitting::edge_count> pairs;
    for (std::uint32_t k = 0; k < cell.crack_face_count; ++k) {
        CrackFaces& crack_faces = cell.crack_faces[k];
        const GridEdge edge =
            splitting::cell_edge({cell.cell[0], cell.cell[1], cell.cell[2]}, crack_faces.edge);
        const geometry::Frame* a = context.frame_of(edge.node, crack_faces.lower);
        const geometry::Frame* b = context.frame_of(edge.upper(), crack_faces.upper);
        if (!a || !b) continue;
        const Vec3 lower = a->position + crack_faces.parameter * cell_size_ * a->jacobian.col(edge.axis);
        const Vec3 upper =
            b->position - (1 - crack_faces.parameter) * cell_size_ * b->jacobian.col(edge.axis);
        pairs[static_cast<std::size_t>(count++)] = {upper - lower, a, b, edge.axis};
        widest_squared = std::max(widest_squared, (upper - lower).squaredNorm());
    }
    // Most cracks are nowhere open widely enough to matter.
    if (!(opening_modulus_ * std::sqrt(widest_squared) >
          strength_.settings().strength * strength_.min_factor()))
        return 0;
    const auto end = pairs.begin() + count;
    count = 0;
    for (auto pair = pairs.begin(); pair != end; ++pair) {
        const Mat3 jacobian = 0.5 * (pair->lower->jacobian + pair->upper->jacobian);
        Vec3 across = cofactor_of(jacobian) * cell.tip.normal;
        if (across.dot(jacobian * Vec3::Unit(pair->axis)) < 0) across = -across;
        if (!(across.norm() > 0)) continue;
        sum += pair->separation.dot(across.normalized());
        ++count;
    }
    const double crack_opening = count > 0 ? sum / count : 0;
    return crack_opening > 0 ? opening_modulus_ * crack_opening : 0;
}

// Lists the phyxels near crack cells; neither move at rest. Returns false, without a list, if phyxels were
// added since the last call: they may be added in each step, and then a list would not pay.
bool CrackFront::list_near_phyxels(const NodeGrid& grid, const TearContext& context) {
    if (phyxels_known_ != context.phyxels.size()) {
        near_.clear();
        first_near_.assign(1, 0);
        phyxels_known_ = context.phyxels.size();
        return false;
    }
    for (std::size_t k = first_near_.size() - 1; k < cells_.cells().size(); ++k) {
        visit_near(grid, context, cells_.cells()[k].cell, [&](std::uint32_t i) {
            near_.push_back(i);
            return true;
        });
        first_near_.push_back(static_cast<std::uint32_t>(near_.size()));
    }
    return true;
}

// Collects the crack cells from which a crack may grow and near which a phyxel is loaded enough.
void CrackFront::find_loaded_front(const NodeGrid& grid, const TearContext& context) {
    const bool is_listed = list_near_phyxels(grid, context);
    is_loaded_.resize(cells_.cells().size());
    context.parallel.for_each(cells_.cells().size(), 4 * tuning::grains::crack_cells, [&](std::size_t k) {
        const CrackCell& cell = cells_.cells()[k];
        is_loaded_[k] = 0;
        if (!cell.is_stale && cell.tip.edges == 0) return;
        const auto is_idle = [&](std::uint32_t i) { return !(stress_.load()[i] >= stress_.min_load()); };
        is_loaded_[k] = !(is_listed ? std::all_of(near_.begin() + first_near_[k],
                                                  near_.begin() + first_near_[k + 1], is_idle)
                                    : visit_near(grid, context, cell.cell, is_idle));
    });
    front_.clear();
    for (std::uint32_t k = 0; k < cells_.cells().size(); ++k)
        if (is_loaded_[k] != 0) front_.push_back(k);
}

// Updates the tips of the front's cells and lists the open edges that these may cut.
void CrackFront::list_front_edges(const NodeGrid& grid, const TearContext& context) {
    context.parallel.for_each(front_.size(), tuning::grains::crack_cells, [&](std::size_t k) {
        CrackCell& cell = cells_.cells()[front_[k]];
        if (cell.is_stale) cell.tip = tip_of(grid, cell);
        cell.is_stale = false;
        cell.opening_stress = cell.tip.edges != 0 ? opening_stress(context, cell) : 0;
    });
    ++epoch_;
    front_edges_.clear();
    for (const std::uint32_t index : front_) {
        const CrackCell& cell = cells_.cells()[index];
        const bool is_wide_open =
            cell.opening_stress >
            tuning::tearing::slab_opening * strength_.settings().strength * strength_.min_factor();
        for (std::uint32_t edges = cell.tip.edges; edges != 0; edges &= edges - 1) {
            const auto e = static_cast<std::size_t>(std::countr_zero(edges));
            const auto k = static_cast<std::uint32_t>(cell.tip.open[e]);
            OpenEdge& open = cells_.open_edges()[k];
            if (open.queried_epoch != epoch_) {
                front_edges_.push_back(k);
                open.queried_epoch = epoch_;
                open.tip_count = 0;
                open.shielding = 0xff;
            }
            open.shielding &= is_wide_open ? 0 : cell.tip.shielding[e];
            open.tips[open.tip_count++] = index;
        }
    }
    std::erase_if(front_edges_, [&](std::uint32_t k) { return cells_.open_edges()[k].shielding != 0; });
    for (const std::uint32_t k : front_edges_) {
        OpenEdge& open = cells_.open_edges()[k];
        if (open.lower < 0) open.lower = context.nodes.find(open.edge.node);
        if (open.upper < 0) open.upper = context.nodes.find(open.edge.upper());
        stress_.request_stress(context, open.lower);
        stress_.request_stress(context, open.upper);
    }
}

}  // namespace splitcubes::body
