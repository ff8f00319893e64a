#include "solids.h"

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <numbers>

namespace splitcubes::torture {

namespace {

using geometry::TriangleMesh;

// A rotation by an integer quaternion, which needs no trigonometric function.
Eigen::Quaterniond draw_rotation(Draw& draw) {
    if (draw.chance(1, 4)) return Eigen::Quaterniond::Identity();
    std::array<double, 4> q;
    double square = 0;
    do {
        square = 0;
        for (double& part : q) {
            part = static_cast<double>(draw.between(-9, 9));
            square += part * part;
        }
    } while (square < 25);
    const double length = std::sqrt(square);
    return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

TriangleMesh draw_primitive(Draw& draw, std::string& kind) {
    constexpr std::array<const char*, 6> kinds = {"box", "sphere", "cylinder", "torus", "capsule", "pear"};
    const auto choice = static_cast<std::size_t>(draw.between(0, 5));
    kind = kinds[choice];
    const double a = draw.real(0.3, 1), b = draw.real(0.3, 1);
    switch (choice) {
        case 0:
            return geometry::make_box({1, a, b});
        case 1:
            return geometry::make_sphere(0.5, 3);
        case 2:
            return geometry::make_cylinder(0.5 * a, b, 32);
        case 3:
            return geometry::make_torus(0.5, 0.15 + 0.2 * a, 48, 20);
        case 4:
            return geometry::make_capsule(0.3 * a, b, 32);
        default:
            return geometry::make_pear(1, 32);
    }
}

void set_box(Solid& solid) {
    solid.low.setConstant(std::numeric_limits<double>::infinity());
    solid.high = -solid.low;
    for (const Vec3& p : solid.mesh.positions) {
        solid.low = solid.low.cwiseMin(p);
        solid.high = solid.high.cwiseMax(p);
    }
}

Solid of_mesh(Draw& draw, TriangleMesh mesh, const std::string& kind) {
    Solid out;
    out.kind = kind;
    out.mesh = std::move(mesh);
    const Eigen::Matrix3d rotation = draw_rotation(draw).toRotationMatrix();
    for (Vec3& p : out.mesh.positions) p = rotation * p;
    set_box(out);
    const double scale = draw.real(0.1, 0.4) / (out.high - out.low).maxCoeff();
    const Vec3 middle = out.center();
    for (Vec3& p : out.mesh.positions) p = rounded(Vec3(scale * (p - middle)));
    set_box(out);
    out.volume = out.mesh.volume();
    return out;
}

double ball_volume(double a, double b, double c) {
    return 4 * std::numbers::pi / 3 * a * b * c;
}

// Balls and cones in a chain, so that each touches the next.
Solid draw_blob(Draw& draw) {
    Solid out;
    out.kind = "blob";
    out.low.setConstant(std::numeric_limits<double>::infinity());
    out.high = -out.low;
    const double size = draw.real(0.05, 0.12);
    const double smoothness = rounded(draw.real(0, 0.3) * size);
    Json parts = Json::array();
    Vec3 at = Vec3::Zero();
    const auto include = [&](const Vec3& p, double reach) {
        out.low = out.low.cwiseMin((p.array() - reach - smoothness).matrix());
        out.high = out.high.cwiseMax((p.array() + reach + smoothness).matrix());
    };
    const auto count = draw.between(1, 5);
    for (std::int64_t k = 0; k < count; ++k) {
        const Vec3 way = draw.direction();
        const Vec3 next = rounded(Vec3(at + draw.real(0.6, 1) * size * way));
        const double r = rounded(draw.real(0.6, 1) * size), s = rounded(draw.real(0.6, 1) * size);
        if (draw.chance(1, 2)) {
            const Vec3 radii(r, s, rounded(draw.real(0.6, 1) * size));
            parts.push_back({{"ball", {{"center", to_json(at)}, {"radii", to_json(radii)}}}});
            out.volume += 0.7 * ball_volume(radii.x(), radii.y(), radii.z());
            include(at, radii.maxCoeff());
        } else {
            parts.push_back(
                {{"cone",
                  {{"from", to_json(at)}, {"to", to_json(next)}, {"from_radius", r}, {"to_radius", s}}}});
            out.volume += 0.7 * ball_volume(r, r, s);
            include(at, r);
            include(next, s);
        }
        at = next;
    }
    out.implicit = {{"smoothness", smoothness}, {"cells", 48}, {"parts", parts}};
    return out;
}

}  // namespace

void Solid::move(const Vec3& offset) {
    low += offset;
    high += offset;
    for (Vec3& p : mesh.positions) p = rounded(Vec3(p + offset));
    if (implicit.is_null()) return;
    const auto shift = [&](Json& v) {
        for (std::size_t k = 0; k < 3; ++k)
            v[k] = rounded(v[k].get<double>() + offset[static_cast<Eigen::Index>(k)]);
    };
    for (Json& part : implicit["parts"])
        for (const char* key : {"center", "from", "to"})
            for (auto& [name, shape] : part.items())
                if (shape.contains(key)) shift(shape[key]);
}

double Solid::lowest(const Vec3& direction) const {
    double out = std::numeric_limits<double>::infinity();
    for (const Vec3& p : mesh.positions) out = std::min(out, p.dot(direction));
    if (!implicit.is_null())
        for (int corner = 0; corner < 8; ++corner)
            out = std::min(out, direction.dot(Vec3((corner & 1) != 0 ? high.x() : low.x(),
                                                   (corner & 2) != 0 ? high.y() : low.y(),
                                                   (corner & 4) != 0 ? high.z() : low.z())));
    return out;
}

Solid draw_solid(Draw& draw, const std::vector<std::filesystem::path>& models) {
    const auto choice = draw.between(0, 9);
    if (choice < 2) return draw_blob(draw);
    if (choice < 4 && !models.empty()) {
        const auto& model =
            models[static_cast<std::size_t>(draw.between(0, static_cast<std::int64_t>(models.size()) - 1))];
        return of_mesh(draw, io::read_mesh(model), model.stem().string());
    }
    std::string kind;
    TriangleMesh mesh = draw_primitive(draw, kind);
    return of_mesh(draw, std::move(mesh), kind);
}

std::string coloured_obj(const geometry::TriangleMesh& mesh) {
    std::string out;
    std::array<char, 128> line;
    for (const Vec3& p : mesh.positions) {
        std::snprintf(line.data(), line.size(), "v %.6f %.6f %.6f 0.8 0.6 0.5\n", p.x(), p.y(), p.z());
        out += line.data();
    }
    for (const geometry::Triangle& t : mesh.triangles) {
        std::snprintf(line.data(), line.size(), "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
        out += line.data();
    }
    return out;
}

Json to_json(const Vec3& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

}  // namespace splitcubes::torture
