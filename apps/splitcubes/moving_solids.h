// The solids of a run besides its bodies: colliders and instruments, with their motions.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>
#include <splitcubes/scene/description.h>

#include <string>
#include <vector>

namespace splitcubes::app {

struct MovingSolid {
    std::string name;
    geometry::TriangleMesh mesh;  // own frame
    geometry::Material material;
    std::vector<double> times;     // s; one for what stays where it is
    std::vector<Isometry> frames;  // world from own
};

/// times: s, at which they are wanted. Half spaces have no mesh, tools without an instrument no solid.
std::vector<MovingSolid> moving_solids(const scene::SceneDescription& scene,
                                       const std::vector<double>& times);

}  // namespace splitcubes::app
