// A camera that circles a point.
#pragma once

#include "vectors.h"

#include <splitcubes/geometry/box.h>

namespace splitcubes::view {

/// Size of the picture, pixels.
struct ViewSize {
    double width = 1280, height = 720;
};

/// Looks at `target` from a distance; z is up.
struct OrbitCamera {
    Vec3 target = Vec3::Zero();  // m, world
    double distance = 1;         // m, eye to target, > 0
    double azimuth = -1.0;       // rad, of the eye about z from the x axis
    double elevation = 0.45;     // rad, of the eye above the horizon, within +-1.55
    double vertical_fov = 0.61;  // rad

    Vec3 eye() const;
    Vec3 forward() const;  // unit
    Vec3 right() const;    // unit
    Vec3 up() const;       // unit
    /// Half line through a pixel.
    Ray ray(double x, double y, const ViewSize& size) const;
    /// Pixels of a point, and its depth along the view, m (third coordinate; behind the eye: <= 0).
    Vec3 project(const Vec3& point, const ViewSize& size) const;
    /// Length that a pixel covers at a depth, m.
    double pixel_size(double depth, const ViewSize& size) const;

    // By a motion of the pointer, pixels.
    void orbit(double dx, double dy);
    void pan(double dx, double dy, const ViewSize& size);
    /// By notches of the wheel; moves towards a point that stays where it is in the picture.
    void zoom(double notches, const Vec3& towards);
    /// Shows all of a box from the present side.
    void focus(const geometry::Box& box);
    /// Places the eye.
    void look(const Vec3& from, const Vec3& at);
};

/// A part of a view, pixels from its upper left.
struct ViewArea {
    double left = 0, top = 0, right = 0, bottom = 0;
};
/// Tells whether most of a box lies outside an area of the view, though it is not much larger than that.
bool has_left(const geometry::Box& box, const OrbitCamera& camera, const ViewSize& size,
              const ViewArea& area);

}  // namespace splitcubes::view
