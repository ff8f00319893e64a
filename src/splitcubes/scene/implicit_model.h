// Meshes of implicit shapes. Internal to scene.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>

#include <string>

namespace splitcubes::scene {

/// Meshes the shape in its own frame by splitting cubes on a grid of shape.cells, with the parts' colours as
/// vertex colours. Throws InputError if the shape is too thin for the grid.
io::Model implicit_model(const ImplicitShape& shape, const std::string& body, const Parallel& parallel);

}  // namespace splitcubes::scene
