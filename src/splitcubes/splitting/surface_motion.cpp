// The surface's vertices go where its nodes carry them.
#include <splitcubes/splitting/surface.h>

#include <cassert>

namespace splitcubes::splitting {

using geometry::AffineDisplacement;

namespace {

// Columns are cross products of the other two columns.
Mat3 cofactor_of(const Mat3& matrix) {
    Mat3 out;
    for (int k = 0; k < 3; ++k) out.col(k) = matrix.col((k + 1) % 3).cross(matrix.col((k + 2) % 3));
    return out;
}

}  // namespace

void deform(const Surface& surface, const RestGrid& rest, std::span<const AffineDisplacement> motion,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel) {
    const std::vector<SurfaceVertex>& vertices = surface.vertices();
    assert(motion.size() == surface.nodes().size());
    // Room for cuts to come, lest one step copies all.
    for (std::vector<Vec3>* out : {&positions, &normals}) {
        if (out->capacity() < vertices.size()) out->reserve(vertices.size() + vertices.size() / 2);
        out->resize(vertices.size());
    }
    parallel.for_each(vertices.size(), 512, [&](std::size_t i) {
        const SurfaceVertex& v = vertices[i];
        positions[i] = v.rest;
        normals[i] = v.normal.cast<double>();
        if (!v.alive()) return;
        AffineDisplacement sum;
        const double total = surface.visit_carriers(
            rest, v, [&](std::uint32_t node, double weight) { sum.add(weight, motion[node]); });
        sum.scale(1 / total);
        positions[i] = sum.image(v.rest);
        const Vec3 normal = cofactor_of(sum.jacobian()) * normals[i];
        const double length = normal.norm();
        if (length > 1e-9) normals[i] = normal / length;
    });
}

void deform(const Surface& surface, const RestGrid& rest, std::span<const geometry::Frame> frames,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel) {
    assert(frames.size() == surface.nodes().size());
    std::vector<AffineDisplacement> motion(frames.size());
    parallel.for_each(frames.size(), 512, [&](std::size_t n) {
        motion[n] = AffineDisplacement(rest.node_position(surface.nodes()[n]), frames[n]);
    });
    deform(surface, rest, motion, positions, normals, parallel);
}

}  // namespace splitcubes::splitting
