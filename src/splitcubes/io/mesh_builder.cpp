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
    added_.clear();
    for (std::uint32_t i = 2; i < corners.size(); ++i)
        if (add_triangle({corners[0], corners[i - 1], corners[i]})) added_.push_back({0, i - 1, i});
    return added_.size();
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
