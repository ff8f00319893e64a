// Materials in the files of a run that stand for the finishes of its bodies.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/scene/appearance.h>

#include <string>

namespace splitcubes::app {

/// Returns the name of the material of a body's faces, `loaf/cut`.
std::string material_name(const std::string& body, geometry::Origin origin);

/// Returns the plain part of a finish as a material.
geometry::Material material_of_finish(const std::string& name, const geometry::Finish& finish);

/// Returns the finish of faces; null: the scene does not say.
const geometry::Finish* finish_of(const scene::AppearanceDescription& appearance, geometry::Origin origin);

/// Gives the faces of a body with an appearance the materials of its finishes; others keep theirs.
/// attributes: of
/// the surface; may be empty.
void set_body_materials(const std::string& body, const scene::AppearanceDescription& appearance,
                        const geometry::SurfaceMesh& surface, geometry::MeshAttributes& attributes);

}  // namespace splitcubes::app
