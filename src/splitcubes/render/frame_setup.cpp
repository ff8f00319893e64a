#include <splitcubes/core/error.h>
#include <splitcubes/render/frame_setup.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::render {

namespace {

/// Returns a view matrix. Rows: right, top, back; maps the eye to the origin.
Eigen::Matrix4d view_matrix(const Vec3& eye, const Vec3& back, const Vec3& up) {
    Vec3 right = up.cross(back);
    if (!(right.norm() > 1e-9 * up.norm())) right = back.unitOrthogonal();
    right.normalize();
    const Vec3 top = back.cross(right);
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.row(0).head<3>() = right;
    matrix.row(1).head<3>() = top;
    matrix.row(2).head<3>() = back;
    matrix.col(3).head<3>() = -matrix.topLeftCorner<3, 3>() * eye;
    return matrix;
}

void set_view(FrameSetup& frame, const Camera& camera, double aspect, double far_beyond_scene) {
    const Vec3 back = camera.eye - camera.target;
    if (!(back.norm() > 0) || !back.allFinite() || !camera.up.allFinite() || !(camera.up.norm() > 0)) {
        throw InputError("camera", "eye, target and up give no direction to look in",
                         "put the eye apart from the target");
    }
    if (!(camera.vertical_fov_degrees > 0 && camera.vertical_fov_degrees < 180)) {
        throw InputError("camera.vertical_fov_degrees",
                         "is not between 0 and 180 (" + std::to_string(camera.vertical_fov_degrees) + ")");
    }
    const Vec3 eye = camera.eye - frame.origin;
    frame.view_from_world = view_matrix(eye, back.normalized(), camera.up);
    const double tan_vertical = std::tan(camera.vertical_fov_degrees * std::numbers::pi / 360);
    frame.tan_half_fov = Vec2(tan_vertical * aspect, tan_vertical);
    const double distance = eye.norm();
    // The near plane is as far as the scene allows, for depth resolution.
    frame.near_distance = std::clamp(0.5 * (distance - frame.radius), 0.002 * frame.radius,
                                     std::max(0.05 * distance, 0.002 * frame.radius));
    const double near = frame.near_distance;
    const double far = distance + far_beyond_scene;
    frame.clip_from_view = Eigen::Matrix4d::Zero();
    frame.clip_from_view(0, 0) = 1 / frame.tan_half_fov.x();
    frame.clip_from_view(1, 1) = 1 / frame.tan_half_fov.y();
    frame.clip_from_view(2, 2) = -(far + near) / (far - near);
    frame.clip_from_view(2, 3) = -2 * far * near / (far - near);
    frame.clip_from_view(3, 2) = -1;
}

void set_light(FrameSetup& frame, const DrawList& list, const RenderOptions& options) {
    if (options.to_light) {
        frame.to_light = options.to_light->normalized();
    } else {
        // Left of the camera and above it, on the side of the sky.
        const Vec3 right = frame.view_from_world.row(0).head<3>();
        const Vec3 back = frame.view_from_world.row(2).head<3>();
        Vec3 level = back - back.dot(frame.up) * frame.up;
        if (level.norm() < 1e-6) level = frame.view_from_world.row(1).head<3>();
        frame.to_light = (0.55 * level.normalized() - 0.62 * right + 1.15 * frame.up).normalized();
    }
    frame.light_view_from_world = view_matrix(Vec3::Zero(), frame.to_light, frame.up);
    geometry::Box casters;
    for (const ShadedMesh& mesh : list.meshes) {
        for (const Vec3& point : mesh.positions) {
            casters.add(frame.light_view_from_world.topLeftCorner<3, 3>() * (point - frame.origin));
        }
    }
    for (const LiveSurface* surface : list.surfaces) {
        const geometry::Box& box = surface->bounds();
        for (int k = 0; k < 8 && !box.empty(); ++k) {
            const Vec3 corner((k & 1) != 0 ? box.max.x() : box.min.x(),
                              (k & 2) != 0 ? box.max.y() : box.min.y(),
                              (k & 4) != 0 ? box.max.z() : box.min.z());
            casters.add(frame.light_view_from_world.topLeftCorner<3, 3>() * (corner - frame.origin));
        }
    }
    if (casters.empty()) casters.add(Vec3::Zero());
    // A margin keeps the filter's taps inside the map.
    casters = casters.grown(0.02 * frame.radius);
    frame.light_extent = std::max(casters.size().x(), casters.size().y());
    frame.light_depth = casters.size().z();
    const Vec3 middle = casters.center();
    frame.light_clip_from_view = Eigen::Matrix4d::Identity();
    const Vec3 scale(2 / frame.light_extent, 2 / frame.light_extent, -2 / frame.light_depth);
    frame.light_clip_from_view.diagonal().head<3>() = scale;
    frame.light_clip_from_view.col(3).head<3>() = -scale.cwiseProduct(middle);
    Eigen::Matrix4d half = Eigen::Matrix4d::Identity();
    half.diagonal().head<3>().setConstant(0.5);
    half.col(3).head<3>().setConstant(0.5);
    frame.light_from_world = half * frame.light_clip_from_view * frame.light_view_from_world;
}

// A plane cuts them, or the eye is in one of them.
bool shows_inside(const FrameSetup& frame, const DrawList& list, const Camera& camera) {
    if (list.clip.normal.norm() > 0) return true;
    const double reach =
        frame.near_distance * std::sqrt(1 + frame.tan_half_fov.squaredNorm());  // corners of the near plane
    return std::any_of(list.surfaces.begin(), list.surfaces.end(), [&](const LiveSurface* surface) {
        return !surface->style.is_closed ||
               (!surface->bounds().empty() && surface->bounds().grown(reach).contains(camera.eye));
    });
}

}  // namespace

FrameSetup set_up_frame(const DrawList& list, const Camera& camera, const RenderOptions& options) {
    FrameSetup frame;
    const geometry::Box box = list.bounds();
    if (!box.empty()) {
        frame.origin = box.center();
        frame.radius = std::max(0.5 * box.size().norm(), 1e-9);
    }
    frame.up = options.up.normalized();
    const double height = frame.origin.dot(frame.up) - options.ground_height;
    const double ground_side = 10 * frame.radius + 2 * std::abs(height);
    frame.ground_center = -height * frame.up;
    frame.ground_u = ground_side * frame.up.unitOrthogonal();
    frame.ground_v = frame.up.cross(frame.ground_u);
    frame.ground_visible = options.ground && camera.eye.dot(frame.up) > options.ground_height;
    set_view(frame, camera, static_cast<double>(options.width) / options.height,
             1.5 * ground_side + frame.radius);
    set_light(frame, list, options);
    frame.shows_inside = shows_inside(frame, list, camera);
    return frame;
}

}  // namespace splitcubes::render
