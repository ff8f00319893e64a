#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/shapes.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

namespace splitcubes::geometry {

namespace {

constexpr double pi = std::numbers::pi;

std::string text(double value) {
    return plain_number(value, 6);
}

void check_length(const std::string& where, double value) {
    if (!(value > 0) || !std::isfinite(value))
        throw InputError(where, "must be positive and finite (" + text(value) + ")", "give a length in m");
}

void check_count(const std::string& where, int value, int min, int max) {
    if (value < min || value > max)
        throw InputError(where, "is " + std::to_string(value),
                         "give a number from " + std::to_string(min) + " to " + std::to_string(max));
}

constexpr int max_segments = 8192;

void add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, TriangleMesh& mesh) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
}

// Revolves an outline about the z axis. outline: (radius, z) from the bottom pole to the
// top pole; the radius is zero at these two and positive between.
TriangleMesh revolve(const std::vector<Vec2>& outline, int segments) {
    TriangleMesh mesh;
    const auto n = static_cast<std::uint32_t>(segments);
    const auto ring_count = static_cast<std::uint32_t>(outline.size()) - 2;
    mesh.positions.emplace_back(0, 0, outline.front()[1]);
    for (std::uint32_t ring = 1; ring <= ring_count; ++ring)
        for (std::uint32_t s = 0; s < n; ++s) {
            const double angle = 2 * pi * s / n;
            mesh.positions.emplace_back(outline[ring][0] * std::cos(angle),
                                        outline[ring][0] * std::sin(angle), outline[ring][1]);
        }
    mesh.positions.emplace_back(0, 0, outline.back()[1]);
    const auto top = static_cast<std::uint32_t>(mesh.positions.size() - 1);
    const auto at = [&](std::uint32_t ring, std::uint32_t s) { return 1 + ring * n + s % n; };
    for (std::uint32_t s = 0; s < n; ++s) {
        mesh.triangles.push_back({0, at(0, s + 1), at(0, s)});
        for (std::uint32_t ring = 0; ring + 1 < ring_count; ++ring)
            add_quad(at(ring, s), at(ring, s + 1), at(ring + 1, s + 1), at(ring + 1, s), mesh);
        mesh.triangles.push_back({top, at(ring_count - 1, s), at(ring_count - 1, s + 1)});
    }
    return mesh;
}

// Returns the number of rows for nearly square cells, within limits.
int row_count(double height, double radius, int segments) {
    const double rows = std::round(height * segments / (2 * pi * radius));
    return static_cast<int>(std::clamp(rows, 1.0, 4.0 * segments));
}

// Creates the square sheet over [-half_size, half_size]^2, displaced by height(s, t).
template <class Height>
TriangleMesh sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution,
                   const Height& height) {
    check_length("sheet half size", half_size);
    check_count("sheet resolution", resolution, 1, max_segments);
    if (!center.allFinite()) throw InputError("sheet centre", "is not finite");
    if (!normal.allFinite() || !(normal.stableNorm() > 0))
        throw InputError("sheet normal", "has no direction", "give a finite vector other than zero");
    const Vec3 up = normal.stableNormalized();
    const Vec3 along = up.unitOrthogonal(), across = up.cross(along);
    TriangleMesh mesh;
    const auto n = static_cast<std::uint32_t>(resolution);
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) {
            const double s = half_size * (2.0 * i / n - 1), t = half_size * (2.0 * j / n - 1);
            mesh.positions.push_back(center + s * along + t * across + height(s, t) * up);
        }
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i;
            add_quad(a, a + 1, a + n + 2, a + n + 1, mesh);
        }
    return mesh;
}

TriangleMesh icosahedron() {
    const double g = std::numbers::phi;
    TriangleMesh mesh;
    mesh.positions = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                      {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    return mesh;
}

}  // namespace

TriangleMesh make_box(const Vec3& size) {
    for (int axis = 0; axis < 3; ++axis) check_length("box size", size[axis]);
    TriangleMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.positions.emplace_back((corner & 1 ? 0.5 : -0.5) * size[0], (corner & 2 ? 0.5 : -0.5) * size[1],
                                    (corner & 4 ? 0.5 : -0.5) * size[2]);
    add_quad(0, 4, 6, 2, mesh);
    add_quad(1, 3, 7, 5, mesh);
    add_quad(0, 1, 5, 4, mesh);
    add_quad(2, 6, 7, 3, mesh);
    add_quad(0, 2, 3, 1, mesh);
    add_quad(4, 5, 7, 6, mesh);
    return mesh;
}

TriangleMesh make_sphere(double radius, int subdivisions) {
    check_length("sphere radius", radius);
    check_count("sphere subdivisions", subdivisions, 0, 9);
    TriangleMesh mesh = icosahedron();
    for (Vec3& p : mesh.positions) p.normalize();
    for (int level = 0; level < subdivisions; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [entry, added] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
            if (added) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]).normalized());
            return entry->second;
        };
        std::vector<Triangle> finer;
        finer.reserve(4 * mesh.triangles.size());
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    for (Vec3& p : mesh.positions) p *= radius;
    return mesh;
}

TriangleMesh make_cylinder(double radius, double height, int segments) {
    check_length("cylinder radius", radius);
    check_length("cylinder height", height);
    check_count("cylinder segments", segments, 3, max_segments);
    std::vector<Vec2> outline = {{0, -0.5 * height}};
    const int rows = row_count(height, radius, segments);
    for (int row = 0; row <= rows; ++row)
        outline.emplace_back(radius, height * (static_cast<double>(row) / rows - 0.5));
    outline.emplace_back(0, 0.5 * height);
    return revolve(outline, segments);
}

TriangleMesh make_torus(double ring_radius, double tube_radius, int ring_segments, int tube_segments) {
    check_length("torus ring radius", ring_radius);
    check_length("torus tube radius", tube_radius);
    check_count("torus ring segments", ring_segments, 3, max_segments);
    check_count("torus tube segments", tube_segments, 3, max_segments);
    if (!(tube_radius < ring_radius))
        throw InputError("torus tube radius",
                         text(tube_radius) + " is not below the ring radius " + text(ring_radius),
                         "a torus without a hole cuts through itself");
    TriangleMesh mesh;
    const auto n = static_cast<std::uint32_t>(ring_segments), m = static_cast<std::uint32_t>(tube_segments);
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j) {
            const double around = 2 * pi * i / n, tube = 2 * pi * j / m;
            const double r = ring_radius + tube_radius * std::cos(tube);
            mesh.positions.emplace_back(r * std::cos(around), r * std::sin(around),
                                        tube_radius * std::sin(tube));
        }
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return i % n * m + j % m; };
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j)
            add_quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), mesh);
    return mesh;
}

TriangleMesh make_capsule(double radius, double straight_height, int segments) {
    check_length("capsule radius", radius);
    if (straight_height != 0) check_length("capsule straight height", straight_height);
    check_count("capsule segments", segments, 4, max_segments);
    const int quarter = std::max(2, segments / 4);
    const double half = 0.5 * straight_height;
    std::vector<Vec2> outline = {{0, -half - radius}};
    for (int k = 1; k <= quarter; ++k) {
        const double angle = 0.5 * pi * k / quarter;
        outline.emplace_back(radius * std::sin(angle), -half - radius * std::cos(angle));
    }
    const int rows = straight_height > 0 ? row_count(straight_height, radius, segments) : 0;
    for (int row = 1; row < rows; ++row)
        outline.emplace_back(radius, straight_height * (static_cast<double>(row) / rows - 0.5));
    for (int k = straight_height > 0 ? quarter : quarter - 1; k > 0; --k) {
        const double angle = 0.5 * pi * k / quarter;
        outline.emplace_back(radius * std::sin(angle), half + radius * std::cos(angle));
    }
    outline.emplace_back(0, half + radius);
    return revolve(outline, segments);
}

// Axis position of the outline's maximum radius.
constexpr double widest_position = -0.35;

double pear_outline(double axis) {
    if (!(axis > -1 && axis < 1)) return 0;
    // A sphere whose radius changes smoothly from the belly's to the neck's.
    return std::sqrt(1 - axis * axis) * (0.5 - 0.24 * std::tanh(3.2 * axis));
}

TriangleMesh make_pear(double height, int segments, double foot) {
    check_length("pear height", height);
    check_count("pear segments", segments, 4, max_segments);
    const double half = 0.5 * height;
    if (!(foot >= 0 && foot < 0.5 * half * pear_outline(widest_position)))
        throw InputError("pear foot", "must be from 0 to below half the belly's radius, about 0.16 heights");
    double below = -1, above = widest_position;
    for (int k = 0; foot > 0 && k < 60; ++k) {
        const double middle = 0.5 * (below + above);
        (half * pear_outline(middle) < foot ? below : above) = middle;
    }
    const int rows = std::max(4, segments);
    std::vector<Vec2> outline = {{0, half * below}};
    if (foot > 0) outline.emplace_back(foot, half * below);
    for (int row = 1; row < rows; ++row) {
        const double axis = -std::cos(pi * row / rows);
        if (axis > below + 1e-9) outline.emplace_back(half * pear_outline(axis), half * axis);
    }
    outline.emplace_back(0, half);
    return revolve(outline, segments);
}

TriangleMesh make_plane_sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution) {
    return sheet(center, normal, half_size, resolution, [](double, double) { return 0.0; });
}

TriangleMesh make_wavy_sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution,
                             double amplitude, double wavelength) {
    check_length("sheet wavelength", wavelength);
    if (!std::isfinite(amplitude)) throw InputError("sheet amplitude", "is not finite");
    return sheet(center, normal, half_size, resolution, [&](double s, double t) {
        return amplitude * std::sin(2 * pi * s / wavelength) * std::cos(2 * pi * t / wavelength);
    });
}

}  // namespace splitcubes::geometry
