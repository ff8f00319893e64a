// Surfaces of other libraries from the same mesh at the same resolution, for comparison. Each is optional: a
// library that was not found is skipped.
#pragma once

#include <splitcubes/geometry/rest_grid.h>

#include <cstddef>
#include <string>
#include <vector>

namespace splitcubes::geometry {
struct TriangleMesh;  // not included: VTK 9.1's headers need C++17, ours C++20
}

namespace splitcubes::bench {

/// A method, timed `runs` times.
struct Timed {
    std::string name;
    std::string skipped;  // reason without times; else empty
    int threads = 0;      // 0: the library's default
    std::size_t triangles = 0;
    std::vector<std::string> parts;
    std::vector<std::vector<double>> seconds;  // by part, by run
};

/// OpenVDB: meshToLevelSet (narrow band of 3 cells to either side), then volumeToMesh without adaptivity,
/// each timed; quads count as two triangles.
Timed openvdb_surface(const geometry::TriangleMesh& mesh, const geometry::RestGrid& grid, int threads,
                      int runs);

/// VTK: vtkFlyingEdges3D on `distance`, one value per node, x fastest; points and triangles only. threads 0:
/// VTK's default.
Timed vtk_surface(const std::vector<float>& distance, const geometry::RestGrid& grid, int threads, int runs);

}  // namespace splitcubes::bench
