// Influences of contact samples.
#include <splitcubes/body/body.h>
#include <splitcubes/body/contact_sides.h>
#include <splitcubes/body/node_motion.h>
#include <splitcubes/meshless/contact.h>
#include <splitcubes/splitting/surface.h>

namespace splitcubes::body {

std::uint32_t Body::dominant_node(std::uint32_t vertex) const {
    const splitting::SurfaceVertex& v = surface_->vertices()[vertex];
    const splitting::Influences influences = surface_->influences(grid_.rest(), v);
    std::size_t heaviest = 0;
    for (std::size_t k = 1; k < influences.count; ++k)
        if (influences.weights[k] > influences.weights[heaviest]) heaviest = k;
    return surface_motion_.tracked(influences.nodes[heaviest]);
}

// Takes the influences of the vertex's dominant node: a contact needs the nearby phyxels, not the exact
// interpolation of the vertex.
meshless::ContactSide Body::influences_of(std::uint32_t vertex, std::uint32_t node, std::int32_t piece,
                                          std::uint32_t part) const {
    const splitting::SurfaceVertex& v = surface_->vertices()[vertex];
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
    const meshless::NodeKernels& kernels = motion_->tracker().kernels();
    if (node < kernels.size()) {
        const meshless::NodeKernels::Row& row = kernels.rows[node];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k)
            if (kernels.weight[k] > 0) take(kernels.phyxel[k], kernels.weight[k]);
    }
    if (side.count == 0) {
        // The node has no visible phyxel: use the nearest one of the piece.
        side.phyxel[0] = samples_.nearest_of_piece(v.rest, piece);
        side.weight[0] = 1;
        side.count = side.phyxel[0] < samples_.phyxels.size() ? 1 : 0;
        if (side.count == 0) side.phyxel[0] = 0;
    }
    double total = 0;
    for (std::uint32_t k = 0; k < side.count; ++k) total += side.weight[k];
    for (std::uint32_t k = 0; k < side.count; ++k) side.weight[k] /= total;
    reproduce_affine_motion(samples_.phyxels.rest_position, v.rest, samples_.spacing, side);
    return side;
}

}  // namespace splitcubes::body
