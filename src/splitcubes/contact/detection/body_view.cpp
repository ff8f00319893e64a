#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/contact_sides.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {

namespace {

// Returns the nearest phyxel of a piece to a point (m, rest space), the first of equally near ones; the
// phyxel count if the piece has none.
std::uint32_t nearest_of_piece(const BodyView& body, const Vec3& rest, std::int32_t piece) {
    const meshless::Phyxels& phyxels = body.phyxels;
    double nearest = std::numeric_limits<double>::infinity();
    auto best = static_cast<std::uint32_t>(phyxels.size());
    const auto take = [&](std::uint32_t i) {
        const double distance = (phyxels.rest_position[i] - rest).squaredNorm();
        if (phyxels.piece[i] == piece && (distance < nearest || (distance == nearest && i < best))) {
            nearest = distance;
            best = i;
        }
        return true;
    };
    double radius = 1.5 * body.spacing;
    for (int k = 0; k < tuning::set_up::max_radius_doublings && std::isinf(nearest); ++k, radius *= 2)
        body.locator.visit(rest, radius, take);
    if (std::isinf(nearest))
        for (std::uint32_t i = 0; i < phyxels.size(); ++i) take(i);
    return best;
}

}  // namespace

bool BodyView::holds_rigid(std::size_t index) const {
    return std::any_of(kinematic_rigid_pieces.begin(), kinematic_rigid_pieces.end(),
                       [&](const meshless::RigidKinematicTarget& target) { return target.body == index; });
}

std::uint32_t BodyView::dominant_node(std::uint32_t vertex) const {
    const splitting::SurfaceVertex& v = surface.vertices()[vertex];
    const splitting::Influences influences = surface.influences(grid.rest(), v);
    std::size_t heaviest = 0;
    for (std::size_t k = 1; k < influences.count; ++k)
        if (influences.weights[k] > influences.weights[heaviest]) heaviest = k;
    return surface_motion.tracked(influences.nodes[heaviest]);
}

// Takes the influences of the vertex's dominant node: a contact needs the nearby phyxels, not the exact
// interpolation of the vertex.
meshless::ContactSide BodyView::influences_of(std::uint32_t vertex, std::uint32_t node, std::int32_t piece,
                                              std::uint32_t part) const {
    const splitting::SurfaceVertex& v = surface.vertices()[vertex];
    meshless::ContactSide side;
    side.part = part;
    const auto take = [&](std::uint32_t phyxel, double weight) {
        std::size_t at = side.count;
        while (at > 0 && side.weight[at - 1] < weight) --at;
        if (at >= meshless::ContactSide::max_phyxels) return;
        if (side.count < meshless::ContactSide::max_phyxels) ++side.count;
        for (std::size_t k = side.count - 1; k > at; --k) {
            side.phyxel[k] = side.phyxel[k - 1];
            side.weight[k] = side.weight[k - 1];
        }
        side.phyxel[at] = phyxel;
        side.weight[at] = weight;
    };
    const meshless::NodeKernels& kernels = nodes.kernels();
    if (node < kernels.size()) {
        const meshless::NodeKernels::Row& row = kernels.rows[node];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k)
            if (kernels.weight[k] > 0) take(kernels.phyxel[k], kernels.weight[k]);
    }
    if (side.count == 0) {
        // The node has no visible phyxel: use the nearest one of the piece.
        side.phyxel[0] = nearest_of_piece(*this, v.rest, piece);
        side.weight[0] = 1;
        side.count = side.phyxel[0] < phyxels.size() ? 1 : 0;
        if (side.count == 0) side.phyxel[0] = 0;
    }
    double total = 0;
    for (std::uint32_t k = 0; k < side.count; ++k) total += side.weight[k];
    for (std::uint32_t k = 0; k < side.count; ++k) side.weight[k] /= total;
    reproduce_affine_motion(phyxels.rest_position, v.rest, spacing, side);
    return side;
}

}  // namespace splitcubes::body
