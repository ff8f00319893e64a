// Matrices and lengths of one picture.
#pragma once

#include <splitcubes/render/camera.h>
#include <splitcubes/render/draw_list.h>
#include <splitcubes/render/renderer.h>

#include <Eigen/Core>

namespace splitcubes::render {

/// Data shared by the passes of one picture. Positions are passed to the driver in single precision relative
/// to `origin`; "world" below is that shifted frame.
struct FrameSetup {
    Vec3 origin = Vec3::Zero();         // m, unshifted world; middle of the scene
    double radius = 1;                  // m, of a sphere around the scene
    Eigen::Matrix4d view_from_world;    // the view looks along -z
    Eigen::Matrix4d clip_from_view;     // OpenGL's clip cube
    Vec2 tan_half_fov = Vec2::Ones();   // horizontal, vertical
    double near_distance = 0.1;         // m
    Vec3 up = Vec3::UnitZ();            // unit
    Vec3 to_light = Vec3::UnitZ();      // unit
    bool ground_visible = false;        // there is a ground and the eye is above it
    bool shows_inside = false;          // of live surfaces
    Vec3 ground_center = Vec3::Zero();  // m
    Vec3 ground_u = Vec3::UnitX();      // m, half a side of the drawn square
    Vec3 ground_v = Vec3::UnitY();
    Eigen::Matrix4d light_view_from_world;
    Eigen::Matrix4d light_clip_from_view;
    Eigen::Matrix4d light_from_world;  // to 0..1 on all axes
    double light_extent = 1;           // m, side of the shadow map
    double light_depth = 1;            // m, its depth range
};

/// Throws InputError if the camera has no view direction.
FrameSetup set_up_frame(const DrawList& list, const Camera& camera, const RenderOptions& options);

}  // namespace splitcubes::render
