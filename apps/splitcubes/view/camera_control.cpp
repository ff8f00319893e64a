#include "camera_control.h"

#include <algorithm>
#include <cmath>

namespace splitcubes::view {

namespace {

constexpr double max_elevation = 1.55;       // rad; the picture turns over at pi / 2
constexpr double radians_per_pixel = 0.006;  // of orbiting

}  // namespace

Vec3 OrbitCamera::forward() const {
    const double level = std::cos(elevation);
    return -Vec3(level * std::cos(azimuth), level * std::sin(azimuth), std::sin(elevation));
}

Vec3 OrbitCamera::eye() const {
    return target - distance * forward();
}

Vec3 OrbitCamera::right() const {
    return {-std::sin(azimuth), std::cos(azimuth), 0};
}

Vec3 OrbitCamera::up() const {
    return right().cross(forward());
}

Ray OrbitCamera::ray(double x, double y, const ViewSize& size) const {
    const double scale = 2 * std::tan(0.5 * vertical_fov) / size.height;
    const Vec3 direction =
        forward() + scale * ((x - 0.5 * size.width) * right() - (y - 0.5 * size.height) * up());
    return {eye(), direction.normalized()};
}

Vec3 OrbitCamera::project(const Vec3& point, const ViewSize& size) const {
    const Vec3 offset = point - eye();
    const double depth = offset.dot(forward());
    const double scale = 0.5 * size.height / (std::tan(0.5 * vertical_fov) * (depth == 0 ? 1e-12 : depth));
    return {0.5 * size.width + scale * offset.dot(right()), 0.5 * size.height - scale * offset.dot(up()),
            depth};
}

double OrbitCamera::pixel_size(double depth, const ViewSize& size) const {
    return 2 * std::tan(0.5 * vertical_fov) * depth / size.height;
}

void OrbitCamera::orbit(double dx, double dy) {
    azimuth = std::remainder(azimuth - radians_per_pixel * dx, 2 * M_PI);
    elevation = std::clamp(elevation + radians_per_pixel * dy, -max_elevation, max_elevation);
}

void OrbitCamera::pan(double dx, double dy, const ViewSize& size) {
    const double pixel = pixel_size(distance, size);
    target += pixel * (dy * up() - dx * right());
}

void OrbitCamera::zoom(double notches, const Vec3& towards) {
    const double factor = std::pow(0.88, std::clamp(notches, -20.0, 20.0));
    target = towards + factor * (target - towards);
    distance = std::max(distance * factor, 1e-6);
}

void OrbitCamera::focus(const geometry::Box& box) {
    if (box.empty()) return;
    target = box.center();
    distance = std::max(0.5 * box.size().norm(), 1e-6) / std::sin(0.5 * vertical_fov);
}

void OrbitCamera::look(const Vec3& from, const Vec3& at) {
    const Vec3 offset = from - at;
    if (!(offset.norm() > 1e-9)) return;
    target = at;
    distance = offset.norm();
    azimuth = std::atan2(offset.y(), offset.x());
    elevation = std::clamp(std::asin(offset.z() / distance), -max_elevation, max_elevation);
}

bool has_left(const geometry::Box& box, const OrbitCamera& camera, const ViewSize& size,
              const ViewArea& area) {
    if (box.empty()) return false;
    constexpr int corners = 8;
    int outside = 0;
    geometry::Box seen;
    for (int c = 0; c < corners; ++c) {
        const Vec3 corner((c & 1) != 0 ? box.max.x() : box.min.x(), (c & 2) != 0 ? box.max.y() : box.min.y(),
                          (c & 4) != 0 ? box.max.z() : box.min.z());
        const Vec3 p = camera.project(corner, size);
        if (!(p.z() > 0)) return false;  // the eye is in the midst of it
        seen.add(p);
        outside += p.x() < area.left || p.x() > area.right || p.y() < area.top || p.y() > area.bottom;
    }
    constexpr double much = 1.5;
    const Vec3 extent = seen.size();
    return 2 * outside > corners && extent.x() < much * (area.right - area.left) &&
           extent.y() < much * (area.bottom - area.top);
}

}  // namespace splitcubes::view
