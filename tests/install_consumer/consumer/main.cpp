// Uses the installed library; the exit code says whether it works.
#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <cmath>
#include <iostream>

int main() {
    splitcubes::geometry::TriangleMesh corner;
    corner.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    corner.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const splitcubes::Parallel parallel(2);
    const double volume = parallel.sum(6, 1, 0.0, [&](std::size_t, std::size_t) { return corner.volume(); });
    std::cout << "six corners of a unit cube hold " << volume << " m^3\n";
    return std::abs(volume - 1) < 1e-12 ? 0 : 1;
}
