// The OpenGL backend of occlusion disks for the program's runs.
#pragma once

#include <splitcubes/body/body_settings.h>

namespace splitcubes::app {

/// Returns a factory of backends that share one context; empty if not wanted or not built in. Throws JobError
/// if it is wanted and OpenGL cannot start.
decltype(body::BodySettings::make_visibility_backend) opengl_backend_maker(bool wanted);

}  // namespace splitcubes::app
