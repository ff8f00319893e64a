#include <splitcubes/math/decompose.h>
#include <splitcubes/scene/material_frame.h>

#include <limits>
#include <utility>

namespace splitcubes::scene {

MaterialFrame::MaterialFrame(std::function<bool(const Vec3&)> region, const BodySamples& at_start)
    : region_(std::move(region)) {
    double mass = 0;
    Vec3 centre = Vec3::Zero();
    for (std::size_t i = 0; i < at_start.rest.size(); ++i) {
        if (!contains(at_start.rest[i])) continue;
        mass += at_start.mass[i];
        centre += at_start.mass[i] * at_start.rest[i];
    }
    if (mass > 0) centre /= mass;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < at_start.rest.size(); ++i) {
        const double distance = (at_start.rest[i] - centre).squaredNorm();
        if (!contains(at_start.rest[i]) || !(distance < nearest)) continue;
        nearest = distance;
        anchor_ = i;
    }
}

Isometry MaterialFrame::fit(const BodySamples& now, double ahead, const Isometry& last) const {
    if (anchor_ >= now.rest.size()) return last;
    const std::int32_t piece = now.piece[anchor_];
    const auto counts = [&](std::size_t i) { return now.piece[i] == piece && contains(now.rest[i]); };
    double mass = 0;
    Vec3 rest = Vec3::Zero(), centre = Vec3::Zero();
    for (std::size_t i = 0; i < now.rest.size(); ++i) {
        if (!counts(i)) continue;
        mass += now.mass[i];
        rest += now.mass[i] * now.rest[i];
        centre += now.mass[i] * (now.position[i] + ahead * now.velocity[i]);
    }
    if (!(mass > 0)) return last;
    rest /= mass;
    centre /= mass;
    Mat3 moment = Mat3::Zero(), spread = Mat3::Zero();
    for (std::size_t i = 0; i < now.rest.size(); ++i) {
        if (!counts(i)) continue;
        const Vec3 arm = now.rest[i] - rest;
        moment += now.mass[i] * (now.position[i] + ahead * now.velocity[i] - centre) * arm.transpose();
        spread += now.mass[i] * arm * arm.transpose();
    }
    // Of the size of a deformation gradient, whatever the units.
    const double scale = spread.trace();
    if (scale > 0) moment /= scale;
    if (!moment.allFinite() || !centre.allFinite()) return last;
    Isometry out = Isometry::Identity();
    out.linear() = rotation_of(moment, last.linear());
    out.translation() = centre - out.linear() * rest;
    return out;
}

}  // namespace splitcubes::scene
