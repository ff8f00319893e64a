#include <splitcubes/splitting/cut_front.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace splitcubes::splitting {

std::vector<CutFront> fronts_beside(const NodeGrid& grid, std::span<const std::int32_t> slots) {
    std::vector<CutFront> out;
    for (const std::int32_t slot : slots)
        for (std::uint8_t side = 0; side < 4; ++side)
            if (grid.ends_in({slot, side})) out.push_back({slot, side});
    return out;
}

Vec3i ring_node(const GridFace& face, int k) {
    Vec3i node = face.node;
    if (k == 1 || k == 2) ++node[(face.axis + 1) % 3];
    if (k >= 2) ++node[(face.axis + 2) % 3];
    return node;
}

FrontRay ray_of(const NodeGrid& grid, const CutFront& front) {
    const Crossing& crossing = grid.crossing(front.slot);
    const GridFace face = face_beside(crossing.edge, front.side);
    const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
    const bool is_upper = front.side % 2 == 1;  // the face lies on the upper side of the edge
    const int ring_edge = crossing.edge.axis == u ? (is_upper ? 0 : 2) : (is_upper ? 3 : 1);
    return front_ray(ring_edge,
                     face_crossing(ring_edge, crossing.hit, crossing.normal[u], crossing.normal[v]));
}

std::optional<double> share_along(const FrontRay& ray, const Vec2& point) {
    constexpr double margin = tuning::cut_front::face_margin;
    if ((point.array() < -margin).any() || (point.array() > 1 + margin).any()) return std::nullopt;
    const double square = ray.way.squaredNorm();
    if (!(square > 0)) return std::nullopt;
    const double share = (point - ray.start).dot(ray.way) / square;
    return std::isfinite(share) ? std::optional(share) : std::nullopt;
}

int step_at(double share) {
    return static_cast<int>(std::lround(std::clamp(share * front_steps, 1.0, front_steps - 1.0)));
}

int moving_step_at(double share) {
    constexpr int half = front_steps / 2;
    return 2 * static_cast<int>(std::clamp(std::floor(share * half), 0.0, half - 1.0)) + 1;
}

}  // namespace splitcubes::splitting
