#include <splitcubes/core/error.h>
#include <splitcubes/io/mesh_builder.h>

#include <utility>

namespace splitcubes::io {

bool MeshBuilder::add_triangle(const geometry::Triangle& triangle) {
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
        ++degenerate_count_;
        return false;
    }
    mesh.triangles.push_back(triangle);
    return true;
}

std::size_t MeshBuilder::add_polygon(std::span<const std::uint32_t> corners) {
    if (corners.size() > 3) ++polygon_count_;
    std::size_t added = 0;
    for (std::size_t i = 2; i < corners.size(); ++i)
        added += add_triangle({corners[0], corners[i - 1], corners[i]}) ? 1 : 0;
    return added;
}

geometry::TriangleMesh MeshBuilder::finish(const std::string& name, ReadMeshReport& report,
                                           bool allow_empty) {
    if (polygon_count_ > 0)
        report.notes.push_back(std::to_string(polygon_count_) +
                               " polygons with more than three corners were cut into triangles");
    if (degenerate_count_ > 0)
        report.notes.push_back(std::to_string(degenerate_count_) +
                               " triangles that use a vertex twice were left out");
    if (mesh.triangles.empty() && !allow_empty) {
        const std::string problem =
            degenerate_count_ > 0 ? "every triangle uses a vertex twice (" : "there are no triangles (";
        throw InputError(name, problem + std::to_string(mesh.positions.size()) + " vertices)",
                         "give a file with a triangle mesh");
    }
    return std::move(mesh);
}

}  // namespace splitcubes::io
