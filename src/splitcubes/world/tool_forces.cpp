// Friction of the cut faces on the sides of tools.
#include <splitcubes/body/body.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

// Returns the squared distance of a point from a polyline, m^2.
double squared_distance_to_polyline(const std::vector<Vec3>& line, const Vec3& point) {
    double nearest = 1e300;
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
        const Vec3 along = line[k + 1] - line[k];
        const double length = along.squaredNorm();
        const double t = length > 0 ? std::clamp(along.dot(point - line[k]) / length, 0.0, 1.0) : 0;
        nearest = std::min(nearest, (line[k] + t * along - point).squaredNorm());
    }
    return nearest;
}

}  // namespace

void World::accumulate_side_friction(const Tool& tool, ToolForce& tool_force) const {
    const double end = time();
    if (!(tool.sides.reach > 0) || !(tool.sides.friction > 0) || !tool.blade.active(end)) return;
    const Isometry now = tool.blade.frame(end), before = tool.blade.frame(end - settings_.time_step);
    const std::vector<std::vector<Vec3>> pose = tool.blade.pose(end);
    for (const meshless::CachedContact& contact : cached_contacts_) {
        if ((contact.key >> 32 & 0xffffU) != 0) continue;
        const Body& body = *bodies_[contact.key >> 48];
        const auto vertex = static_cast<std::size_t>(contact.key & 0xffffffffU);
        if (vertex >= body.vertex_positions().size()) continue;
        const Vec3 point = body.vertex_positions()[vertex];
        double nearest = 1e300;
        for (const std::vector<Vec3>& line : pose)
            nearest = std::min(nearest, squared_distance_to_polyline(line, point));
        if (nearest > tool.sides.reach * tool.sides.reach) continue;
        const Vec3 displacement = point - before * (now.inverse() * point);
        // Both sides of the blade have friction.
        if (displacement.norm() > 1e-6 * settings_.time_step)
            tool_force.add_force(now, point,
                                 -2 * tool.sides.friction * contact.normal_force * displacement.normalized());
    }
}

}  // namespace splitcubes::body
