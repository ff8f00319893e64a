#include <splitcubes/contact/detection/collider_contact.h>

#include <cmath>

namespace splitcubes::body {

std::optional<meshless::Contact> touch(const Collider& collider, const ColliderPoses& poses,
                                       const SurfacePoint& point, double margin) {
    Vec3 position = point.position - point.drawn;
    if (position.squaredNorm() > point.max_error * point.max_error)
        position *= point.max_error / position.norm();
    position += point.drawn;
    const Vec3 from = poses.to_before * position;
    const Vec3 to = poses.to_after * (position + point.displacement);
    if (!(collider.solid->at(from).distance < (to - from).norm() + 2 * margin)) return {};
    const double share = geometry::first_contact(*collider.solid, from, to, margin);
    if (!(share <= 1)) return {};
    const Vec3 hit = from + share * (to - from);
    const geometry::SignedDistance::Sample at = collider.solid->at(hit);
    const Vec3 touched = hit - at.distance * at.normal;
    meshless::Contact contact;
    contact.normal = poses.after.linear() * at.normal;
    contact.gap = contact.normal.dot(position - poses.before * touched);
    contact.surface_displacement = poses.after * touched - poses.before * touched;
    contact.friction = collider.friction;
    if (!contact.normal.allFinite() || !std::isfinite(contact.gap)) return {};
    return contact;
}

}  // namespace splitcubes::body
