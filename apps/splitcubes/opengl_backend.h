// Occlusion disks by OpenGL for the program's runs.
#pragma once

#include <splitcubes/body/body.h>

namespace splitcubes::app {

/// Makes backends that share one context; empty where it is not wanted or not
/// built in. Throws JobError where it is wanted and OpenGL cannot start.
decltype(body::BodySettings::make_visibility_backend) opengl_backend_maker(bool wanted);

}  // namespace splitcubes::app
