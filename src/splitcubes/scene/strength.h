// Regions and painted colours as functions of the place at rest. Internal to scene.
#pragma once

#include <splitcubes/body/tear_settings.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>

#include <functional>

namespace splitcubes::scene {

/// Whether a place (m, world at time 0) is in the region.
std::function<bool(const Vec3&)> region_test(const Region& region);

/// model: the body's, as it is placed. Throws InputError for a paint where it has no
/// vertex colours, for a painted picture where it has no texture coordinates.
body::TearSettings tear_settings(const TearingDescription& tearing, const io::Model& model);

}  // namespace splitcubes::scene
