#include <splitcubes/scene/loft.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace splitcubes::scene {

namespace {

using geometry::TriangleMesh;

void add_fan(TriangleMesh& mesh, std::uint32_t first, std::uint32_t count, bool is_start) {
    Vec3 middle = Vec3::Zero();
    for (std::uint32_t k = 0; k < count; ++k) middle += mesh.positions[first + k] / count;
    const auto tip = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(middle);
    for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t a = first + k, b = first + (k + 1) % count;
        mesh.triangles.push_back(is_start ? geometry::Triangle{tip, b, a} : geometry::Triangle{tip, a, b});
    }
}

}  // namespace

TriangleMesh loft(const std::vector<std::vector<Vec3>>& rings) {
    TriangleMesh out;
    const auto count = static_cast<std::uint32_t>(rings.front().size());
    for (const std::vector<Vec3>& ring : rings)
        out.positions.insert(out.positions.end(), ring.begin(), ring.end());
    for (std::uint32_t r = 0; r + 1 < rings.size(); ++r)
        for (std::uint32_t k = 0; k < count; ++k) {
            const std::uint32_t a = r * count + k, b = r * count + (k + 1) % count;
            out.triangles.push_back({a, b, b + count});
            out.triangles.push_back({a, b + count, a + count});
        }
    add_fan(out, 0, count, true);
    add_fan(out, static_cast<std::uint32_t>(rings.size() - 1) * count, count, false);
    if (out.volume() < 0)
        for (geometry::Triangle& t : out.triangles) std::swap(t[1], t[2]);
    return out;
}

TriangleMesh make_rod(const Vec3& from, const Vec3& to, const Vec3& side, double half_width,
                      double half_height) {
    constexpr int around = 20, in_end = 5;
    const Vec3 axis = (to - from).normalized();
    const Vec3 u = (side - side.dot(axis) * axis).normalized(), v = axis.cross(u);
    const double length = (to - from).norm();
    const double round = std::min(0.49 * length, std::max(half_width, half_height));
    std::vector<std::vector<Vec3>> rings;
    const auto add = [&](double at, double share) {
        rings.emplace_back();
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * std::numbers::pi * k / around;
            rings.back().push_back(
                from + at * axis +
                share * (half_width * std::cos(angle) * u + half_height * std::sin(angle) * v));
        }
    };
    // Quarter circles at both ends, from nearly the pole to the equator.
    for (int end = 0; end < 2; ++end)
        for (int k = 0; k <= in_end; ++k) {
            const int j = end == 0 ? k : in_end - k;
            const double angle = 0.5 * std::numbers::pi * (0.1 + 0.9 * j / in_end);
            const double at = round * (1 - std::cos(angle));
            add(end == 0 ? at : length - at, std::sin(angle));
        }
    return loft(rings);
}

TriangleMesh make_tube(const std::vector<Vec3>& line, double radius) {
    constexpr int around = 12;
    std::vector<std::vector<Vec3>> rings;
    Vec3 side = Vec3::Zero();
    for (std::size_t i = 0; i < line.size(); ++i) {
        const Vec3 before = i > 0 ? Vec3(line[i] - line[i - 1]) : Vec3(line[1] - line[0]);
        const Vec3 after = i + 1 < line.size() ? Vec3(line[i + 1] - line[i]) : before;
        Vec3 along = before.normalized() + after.normalized();
        if (!(along.norm() > 1e-9)) along = before;
        along.normalize();
        // The ring's first point is carried along, so that the tube does not twist.
        side -= side.dot(along) * along;
        if (!(side.norm() > 1e-6)) side = along.unitOrthogonal();
        side.normalize();
        const Vec3 across = along.cross(side);
        rings.emplace_back();
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * std::numbers::pi * k / around;
            rings.back().push_back(line[i] + radius * (std::cos(angle) * side + std::sin(angle) * across));
        }
    }
    return loft(rings);
}

std::vector<Vec3> subdivided(const std::vector<Vec3>& line, double step) {
    std::vector<Vec3> out = {line.front()};
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        const double length = (line[i + 1] - line[i]).norm();
        const int count = std::clamp(static_cast<int>(std::ceil(length / step)), 1, 200);
        if (!(length > 0)) continue;
        for (int k = 1; k <= count; ++k)
            out.push_back(line[i] + (line[i + 1] - line[i]) * (static_cast<double>(k) / count));
    }
    return out;
}

}  // namespace splitcubes::scene
