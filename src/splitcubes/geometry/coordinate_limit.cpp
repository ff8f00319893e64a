#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

void require_coordinates(const TriangleMesh& mesh, const std::string& where, const std::string& after) {
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        for (const double coordinate : mesh.positions[v])
            if (!(coordinate >= -max_coordinate && coordinate <= max_coordinate))
                throw InputError(where,
                                 "vertex " + std::to_string(v + 1) + " of " +
                                     std::to_string(mesh.positions.size()) + " has the coordinate " +
                                     plain_number(coordinate) + after + ", too large to compute areas with",
                                 "coordinates reach from " + plain_number(-max_coordinate) + " to " +
                                     plain_number(max_coordinate) + "; scale the mesh down");
}

}  // namespace splitcubes::geometry
