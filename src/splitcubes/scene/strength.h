// Regions and painted colours as functions of the rest position. Internal to scene.
#pragma once

#include <splitcubes/fracture/tear_settings.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>

#include <functional>

namespace splitcubes::scene {

/// Returns a test whether a point (m, world at time 0) is in the region.
std::function<bool(const Vec3&)> region_test(const Region& region);

/// model: the body's, placed. Throws InputError if colours are painted without vertex colours, or a picture
/// without texture coordinates.
body::TearSettings tear_settings(const TearingDescription& tearing, const io::Model& model);

}  // namespace splitcubes::scene
