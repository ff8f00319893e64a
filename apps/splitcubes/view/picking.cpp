#include "picking.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::view {

namespace {

Vec3f at(const std::vector<float>& values, std::uint32_t slot) {
    return Eigen::Map<const Vec3f>(values.data() + 3 * std::size_t{slot});
}

struct Hit {
    float distance = std::numeric_limits<float>::infinity();
    std::size_t body = 0, triangle = 0;
    std::array<double, 3> weights{};
};

// Tells whether a half line meets a box nearer than a distance.
bool meets(const std::array<float, 6>& box, const Vec3f& origin, const Vec3f& inverse, float limit) {
    float from = 0, to = limit;
    for (int axis = 0; axis < 3; ++axis) {
        const auto low = static_cast<std::size_t>(axis);
        const float a = (box[low] - origin[axis]) * inverse[axis],
                    b = (box[low + 3] - origin[axis]) * inverse[axis];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return from <= to;
}

// Moeller and Trumbore 1997, both sides. Slots that are free have no area and are not met.
void meet_triangle(const BodyState& body, std::size_t index, std::size_t t, const Vec3f& origin,
                   const Vec3f& direction, Hit& best) {
    const std::vector<std::uint32_t>& triangles = body.topology->triangles;
    const Vec3f a = at(body.positions, triangles[3 * t]);
    const Vec3f u = at(body.positions, triangles[3 * t + 1]) - a;
    const Vec3f v = at(body.positions, triangles[3 * t + 2]) - a;
    const Vec3f p = direction.cross(v);
    const float det = u.dot(p);
    if (det == 0) return;
    const Vec3f s = (origin - a) / det;
    const float wu = s.dot(p);
    if (wu < 0 || wu > 1) return;
    const Vec3f q = s.cross(u);
    const float wv = direction.dot(q);
    if (wv < 0 || wu + wv > 1) return;
    const float distance = v.dot(q);
    if (distance > 0 && distance < best.distance) best = {distance, index, t, {1.0 - wu - wv, wu, wv}};
}

void meet(const BodyState& body, std::size_t index, const Vec3f& origin, const Vec3f& direction, Hit& best) {
    const std::size_t count = body.topology->triangles.size() / 3;
    const Vec3f inverse = direction.cwiseInverse();
    for (std::size_t b = 0; b < body.blocks.size(); ++b) {
        if (!meets(body.blocks[b], origin, inverse, best.distance)) continue;
        const std::size_t end = std::min(count, (b + 1) * triangles_per_block);
        for (std::size_t t = b * triangles_per_block; t < end; ++t)
            meet_triangle(body, index, t, origin, direction, best);
    }
}

// Right-handed orthonormal axes along a triangle.
Mat3 triangle_axes(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 x = (b - a).normalized();
    const Vec3 z = x.cross(c - a).normalized();
    Mat3 out;
    out << x, z.cross(x), z;
    return out;
}

template <class Positions>
Vec3 blend(const MaterialPoint& point, const Positions& positions) {
    Vec3 out = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis)
            out[axis] += point.weights[k] *
                         static_cast<double>(
                             positions[3 * std::size_t{point.vertices[k]} + static_cast<std::size_t>(axis)]);
    return out;
}

// A slot that a cut gave to another vertex has another rest position.
template <class Positions, class Pieces>
std::optional<Vec3> follow_material(const MaterialPoint& point, const Positions& positions,
                                    const Positions& rest, const Pieces& pieces) {
    for (const std::uint32_t slot : point.vertices)
        if (slot >= pieces.size() || pieces[slot] < 0) return std::nullopt;
    if (!((blend(point, rest) - point.rest).norm() < 1e-4 * (1 + point.rest.norm()))) return std::nullopt;
    return blend(point, positions);
}

}  // namespace

std::optional<Pick> pick(const PublishedState& state, const Ray& ray) {
    Hit best;
    const Vec3f origin = ray.origin.cast<float>(), direction = ray.direction.cast<float>();
    for (std::size_t b = 0; b < state.bodies.size(); ++b) meet(state.bodies[b], b, origin, direction, best);
    if (!std::isfinite(best.distance)) return std::nullopt;
    const BodyState& body = state.bodies[best.body];
    Pick out;
    out.point.body = best.body;
    std::array<Vec3, 3> world, rest;
    for (std::size_t k = 0; k < 3; ++k) {
        out.point.vertices[k] = body.topology->triangles[3 * best.triangle + k];
        world[k] = at(body.positions, out.point.vertices[k]).cast<double>();
        rest[k] = at(body.topology->rest, out.point.vertices[k]).cast<double>();
    }
    out.point.weights = best.weights;
    out.point.rest = blend(out.point, body.topology->rest);
    out.point.world = blend(out.point, body.positions);
    out.distance = (out.point.world - ray.origin).dot(ray.direction);
    out.origin = body.topology->origins[best.triangle];
    const Mat3 now = triangle_axes(world[0], world[1], world[2]),
               then = triangle_axes(rest[0], rest[1], rest[2]);
    if (now.allFinite() && then.allFinite()) out.world_from_rest = now * then.transpose();
    Vec3 normal = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
        normal += best.weights[k] * at(body.normals, out.point.vertices[k]).cast<double>();
    if (!(normal.norm() > 1e-6)) normal = now.col(2);
    out.normal = normal.normalized();
    if (out.normal.dot(ray.direction) > 0) out.normal = -out.normal;
    return out;
}

std::optional<Vec3> present_position(const MaterialPoint& point, const PublishedState& state) {
    if (point.body >= state.bodies.size()) return std::nullopt;
    const BodyState& body = state.bodies[point.body];
    return follow_material(point, body.positions, body.topology->rest, body.topology->pieces);
}

std::optional<Vec3> present_position(const MaterialPoint& point, const SurfaceView& surface) {
    return follow_material(point, surface.positions, surface.rest_positions, surface.pieces);
}

}  // namespace splitcubes::view
