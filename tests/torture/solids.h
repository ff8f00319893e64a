// Bodies of random scenes: shapes, given models, and blobs.
#pragma once

#include "draw.h"

#include <splitcubes/geometry/triangle_mesh.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::torture {

using Json = nlohmann::ordered_json;

/// A solid in world coordinates at time 0: a mesh, or the parts of an implicit shape.
struct Solid {
    std::string kind;
    geometry::TriangleMesh mesh;
    Json implicit;  // null: the mesh
    Vec3 low = Vec3::Zero(), high = Vec3::Zero();
    double volume = 0;  // m^3, about

    void move(const Vec3& offset);
    Vec3 center() const { return (low + high) / 2; }
    double radius() const { return (high - low).norm() / 2; }
    /// The lowest position along a direction; of an implicit shape that of its box.
    double lowest(const Vec3& direction) const;
};

/// Draws a solid that is 0.1 to 0.4 m long, about the origin. models: closed meshes to choose from.
Solid draw_solid(Draw& draw, const std::vector<std::filesystem::path>& models);

/// The mesh as OBJ with colours, which make the program write positions at rest.
std::string coloured_obj(const geometry::TriangleMesh& mesh);

Json to_json(const Vec3& v);

}  // namespace splitcubes::torture
