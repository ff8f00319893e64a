// Tool reaction forces.
#include <splitcubes/body/body.h>
#include <splitcubes/body/node_motion.h>
#include <splitcubes/body/world.h>

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

void add_force(ToolForce& tool_force, const Isometry& tool, const Vec3& point, const Vec3& force) {
    tool_force.force += force;
    tool_force.torque += (point - tool.translation()).cross(force);
}

}  // namespace

// Adds the resistance of one grid edge that the blade cut in the last interval of dt seconds.
void Body::accumulate_cut_force(std::int32_t slot, double dt, const Isometry& tool_before,
                                const Isometry& tool_now, ToolForce& tool_force) const {
    const splitting::Crossing& crossing = grid_.crossing(slot);
    const double cell = grid_.rest().cell_size;
    const double area = cell * cell * std::abs(crossing.normal[crossing.edge.axis]);
    const double work = settings_.material.cutting_resistance * area;
    tool_force.area += area;
    tool_force.work += work;
    const std::int32_t a = motion_->tracker().find(crossing.edge.node),
                       b = motion_->tracker().find(crossing.edge.upper());
    if (!(work > 0) || a < 0 || b < 0) return;
    const Vec3 point = (1 - crossing.parameter) * motion_->frames()[static_cast<std::size_t>(a)].position +
                       crossing.parameter * motion_->frames()[static_cast<std::size_t>(b)].position;
    const Vec3 displacement = point - tool_before * (tool_now.inverse() * point);
    // Below a micrometre per second there is no direction of motion to resist.
    if (displacement.norm() > 1e-6 * dt)
        add_force(tool_force, tool_now, point, -work / displacement.squaredNorm() * displacement);
}

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
            add_force(tool_force, now, point,
                      -2 * tool.sides.friction * contact.normal_force * displacement.normalized());
    }
}

}  // namespace splitcubes::body
