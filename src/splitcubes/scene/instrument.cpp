#include <splitcubes/scene/instrument.h>

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/loft.h>
#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/overloaded.h>
#include <splitcubes/scene/tuning.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::scene {

namespace {

using geometry::TriangleMesh;

double length_of(const std::vector<Vec3>& line) {
    double out = 0;
    for (std::size_t k = 0; k + 1 < line.size(); ++k) out += (line[k + 1] - line[k]).norm();
    return out;
}

// Returns a direction that points as `wish` and is perpendicular to `axis`.
Vec3 across(const Vec3& wish, const Vec3& axis) {
    const Vec3 unit = axis.normalized();
    const Vec3 out = wish - wish.dot(unit) * unit;
    return out.norm() > 1e-6 * wish.norm() ? Vec3(out.normalized()) : unit.unitOrthogonal();
}

// Times at which a tool works, evenly spaced.
std::vector<double> working_times(const cutting::Blade& blade) {
    constexpr int count = 32;
    std::vector<double> out;
    for (int k = 0; k <= count; ++k)
        out.push_back(blade.active_from() + (blade.active_until() - blade.active_from()) * k / count);
    return out;
}

// Returns the direction, own frame, that an edge leaves behind when it first moves across itself.
Vec3 wake(const cutting::Blade& blade, const std::vector<Vec3>& line) {
    const Vec3 chord = line.back() - line.front();
    const Vec3 middle = 0.5 * (line.front() + line.back());
    const double reach = 1e-3 * length_of(line);
    const std::vector<double> times = working_times(blade);
    for (std::size_t k = 0; k + 1 < times.size(); ++k) {
        const Isometry from = blade.frame(times[k]), to = blade.frame(times[k + 1]);
        Vec3 move = Vec3::Zero();
        for (const Vec3& p : {line.front(), middle, line.back()}) move += to * p - from * p;
        Vec3 own = from.linear().transpose() * move;
        if (chord.norm() > reach) own -= own.dot(chord.normalized()) * chord.normalized();
        if (own.norm() > reach) return -own.normalized();
    }
    return across(Vec3::UnitZ(), chord.norm() > reach ? chord : Vec3(Vec3::UnitX()));
}

// Tells whether the edge is held at its end: the one that moves less, else the higher one.
bool is_held_at_end(const cutting::Blade& blade, const std::vector<Vec3>& line, std::optional<Grip> grip) {
    if (grip) return *grip == Grip::end;
    const std::vector<double> times = working_times(blade);
    double start = 0, end = 0;
    for (std::size_t k = 0; k + 1 < times.size(); ++k) {
        const Isometry from = blade.frame(times[k]), to = blade.frame(times[k + 1]);
        start += (to * line.front() - from * line.front()).norm();
        end += (to * line.back() - from * line.back()).norm();
    }
    if (std::abs(start - end) > 0.05 * (start + end)) return end < start;
    const Isometry frame = blade.frame(times.front());
    return (frame * line.back()).z() > (frame * line.front()).z() + 1e-3 * length_of(line);
}

struct BladeMeasures {
    double height, thickness, handle;
};

BladeMeasures measures_of(const BladeInstrument& i, double length) {
    BladeMeasures out{};
    switch (i.kind) {
        case BladeKind::knife:
            out = {0.16 * length, 0.012 * length, 0.5 * length};
            break;
        case BladeKind::scalpel:
            out = {0.32 * length, 0.03 * length, 3.5 * length};
            break;
        case BladeKind::scissors:
            out = {0.10 * length, 0.02 * length, 0.8 * length};
            break;
    }
    out.height = i.height.value_or(out.height);
    out.thickness = i.thickness.value_or(i.height ? 0.08 * out.height : out.thickness);
    out.handle = i.handle.value_or(out.handle);
    return out;
}

// A wedge along a line whose last point is at the handle; at the first one it tapers to a point.
TriangleMesh wedge(const std::vector<Vec3>& line, const Vec3& back, const BladeMeasures& m,
                   double side_shift) {
    const double length = length_of(line);
    const double taper = std::min(1.6 * m.height, 0.6 * length);
    const std::vector<Vec3> points = subdivided(line, length / 40);
    std::vector<std::vector<Vec3>> rings;
    double passed = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
        if (k > 0) passed += (points[k] - points[k - 1]).norm();
        const Vec3 along =
            k + 1 < points.size() ? Vec3(points[k + 1] - points[k]) : Vec3(points[k] - points[k - 1]);
        const Vec3 b = across(back, along), s = along.normalized().cross(b);
        const double share = std::clamp(passed / taper, 0.0, 1.0);
        const double h = m.height * std::max(0.02, std::sqrt(share * (2 - share)));
        const double t = 0.5 * m.thickness * std::max(0.15, std::sqrt(share));
        const Vec3 p = points[k] + side_shift * s;
        const double bevel = std::min(0.3 * m.height, 0.9 * h);
        rings.push_back({p, p + bevel * b + t * s, p + h * b + 0.8 * t * s, p + h * b - 0.8 * t * s,
                         p + bevel * b - t * s});
    }
    return loft(rings);
}

void add_knife_grip(const Vec3& end, const Vec3& out, const Vec3& back, const BladeMeasures& m,
                    std::vector<TriangleMesh>& grips) {
    const Vec3 middle = end + 0.55 * m.height * back;
    const double half_height = std::clamp(0.38 * m.height, 0.02 * m.handle, 0.11 * m.handle);
    const double half_width = std::clamp(2.2 * m.thickness, 0.55 * half_height, 0.8 * half_height);
    const Vec3 side = out.cross(back);
    grips.push_back(
        make_rod(middle - 0.02 * m.handle * out, middle + m.handle * out, side, half_width, half_height));
}

void add_scalpel_grip(const Vec3& end, const Vec3& out, const Vec3& back, const BladeMeasures& m,
                      std::vector<TriangleMesh>& blades, std::vector<TriangleMesh>& grips) {
    const Vec3 lean = (out + 0.45 * back).normalized();
    const Vec3 side = out.cross(back).normalized();
    const Vec3 start = end + 0.5 * m.height * back;
    const Vec3 neck = start + 0.22 * m.handle * lean;
    blades.push_back(make_rod(start - 0.2 * m.height * lean, neck, side, 1.1 * m.thickness, 0.30 * m.height));
    grips.push_back(make_rod(neck - 0.03 * m.handle * lean, start + m.handle * lean, side, 1.9 * m.thickness,
                             0.42 * m.height));
}

void add_scissors_grip(const Vec3& end, const Vec3& out, const Vec3& back, const BladeMeasures& m,
                       double shift, std::vector<TriangleMesh>& blades, std::vector<TriangleMesh>& grips) {
    const Vec3 side = out.cross(back).normalized();
    const double ring = 0.26 * m.handle, tube = 0.055 * m.handle;
    // The shank leaves the axis of the blade on the side of the edge, away from that of the other half.
    const Vec3 center = end + (m.handle - ring) * out - 0.95 * ring * back;
    std::vector<Vec3> shank;
    for (int k = 0; k <= 12; ++k) {
        const double t = k / 12.0;
        shank.emplace_back(end + 0.4 * m.height * (1 - t) * back + shift * side +
                           (0.9 * m.handle - 1.75 * ring) * t * out - 0.55 * ring * t * t * back);
    }
    shank.insert(shank.begin(), Vec3(end - 0.5 * m.height * out + 0.5 * m.height * back + shift * side));
    blades.push_back(make_tube(shank, 0.045 * m.handle));
    TriangleMesh eye = geometry::make_torus(ring - tube, tube, 48, 20);
    const Quat turn = Quat::FromTwoVectors(Vec3::UnitZ(), side);
    for (Vec3& p : eye.positions) {
        const Vec3 own = turn * p;
        p = center + shift * side + own + 0.35 * own.dot(out) * out;
    }
    grips.push_back(std::move(eye));
    blades.push_back(make_rod(end - 1.6 * m.thickness * side + 0.35 * m.height * back,
                              end + 1.6 * m.thickness * side + 0.35 * m.height * back, out, 0.4 * m.height,
                              0.4 * m.height));
}

void add_parts(const BladeInstrument& i, const cutting::Blade& blade, std::vector<TriangleMesh>& blades,
               std::vector<TriangleMesh>& grips) {
    for (std::vector<Vec3> line : blade.shape().polylines) {
        const double length = length_of(line);
        if (!is_held_at_end(blade, line, i.grip)) std::reverse(line.begin(), line.end());
        const Vec3 out = (line.back() - line[line.size() - 2]).normalized();
        const Vec3 back = across(i.back ? i.back->normalized() : wake(blade, line), out);
        const BladeMeasures m = measures_of(i, length);
        const double shift = i.kind == BladeKind::scissors ? 0.5 * m.thickness : 0;
        blades.push_back(wedge(line, back, m, shift));
        if (!(m.handle > 0)) continue;
        if (i.kind == BladeKind::knife) add_knife_grip(line.back(), out, back, m, grips);
        if (i.kind == BladeKind::scalpel) add_scalpel_grip(line.back(), out, back, m, blades, grips);
        if (i.kind == BladeKind::scissors) add_scissors_grip(line.back(), out, back, m, shift, blades, grips);
    }
}

void add_parts(const WireInstrument& i, const cutting::Blade& blade, std::vector<TriangleMesh>& blades,
               std::vector<TriangleMesh>& grips) {
    for (const std::vector<Vec3>& line : blade.shape().polylines) {
        const double length = length_of(line);
        const double radius = i.radius.value_or(0.006 * length);
        blades.push_back(make_tube(line, radius));
        if (!i.grips) continue;
        const Vec3 chord = line.back() - line.front();
        const Vec3 bar =
            across(wake(blade, line), chord.norm() > 1e-6 * length ? chord : Vec3(Vec3::UnitX()));
        for (const Vec3& end : {line.front(), line.back()}) {
            const double half = std::max(0.08 * length, 6 * radius),
                         thick = std::max(0.018 * length, 2.5 * radius);
            grips.push_back(make_rod(end - half * bar, end + half * bar, bar.unitOrthogonal(), thick, thick));
        }
    }
}

// Returns the rim of a bowl whose front is `front`: half an ellipse closes it, which reaches `length` against
// `low` from the chord.
std::vector<Vec3> closed_rim(const std::vector<Vec3>& front, const Vec3& low, double length) {
    constexpr int steps = 24;
    const Vec3 middle = 0.5 * (front.front() + front.back());
    std::vector<Vec3> out = front;
    for (int k = 1; k < steps; ++k) {
        const double angle = std::numbers::pi * k / steps;
        out.push_back(middle + std::cos(angle) * (front.back() - middle) - std::sin(angle) * length * low);
    }
    return out;
}

// Half of an ellipsoid over the rim, a closed line, with a wall; open towards the rim.
TriangleMesh bowl(const std::vector<Vec3>& rim, const Vec3& center, const Vec3& back, double depth,
                  double wall) {
    constexpr int steps = 14;
    TriangleMesh out;
    const auto columns = static_cast<std::uint32_t>(rim.size());
    double reach = 0;
    for (const Vec3& p : rim) reach = std::max(reach, (p - center).norm());
    const double inner = 1 - std::min(0.4, wall / std::max(reach, 1e-12));
    for (const double share : {1.0, inner}) {
        for (int k = 0; k < steps; ++k) {
            const double angle = 0.5 * std::numbers::pi * k / steps;
            for (const Vec3& p : rim)
                out.positions.push_back(
                    center + share * (std::cos(angle) * (p - center) + std::sin(angle) * depth * back));
        }
        out.positions.push_back(center + share * depth * back);
    }
    const std::uint32_t layer = columns * steps + 1;
    for (std::uint32_t j = 0; j < columns; ++j) {
        const std::uint32_t next = (j + 1) % columns;
        for (std::uint32_t k = 0; k + 1 < steps; ++k) {
            const std::uint32_t a = k * columns + j, b = k * columns + next;
            out.triangles.push_back({a, b, b + columns});
            out.triangles.push_back({a, b + columns, a + columns});
            out.triangles.push_back({layer + a, layer + b + columns, layer + b});
            out.triangles.push_back({layer + a, layer + a + columns, layer + b + columns});
        }
        const std::uint32_t a = (steps - 1) * columns + j, b = (steps - 1) * columns + next;
        out.triangles.push_back({a, b, layer - 1});
        out.triangles.push_back({layer + a, 2 * layer - 1, layer + b});
        out.triangles.push_back({next, j, layer + j});
        out.triangles.push_back({next, layer + j, layer + next});
    }
    if (out.volume() < 0)
        for (geometry::Triangle& t : out.triangles) std::swap(t[1], t[2]);
    return out;
}

// Returns the largest offset of a rim from its chord; some direction across for a straight one.
Vec3 sag_of(const std::vector<Vec3>& rim) {
    const Vec3 chord = (rim.back() - rim.front()).normalized();
    Vec3 out = Vec3::Zero();
    for (const Vec3& p : rim) {
        const Vec3 offset = p - rim.front() - (p - rim.front()).dot(chord) * chord;
        if (offset.norm() > out.norm()) out = offset;
    }
    return out.norm() > 1e-6 * length_of(rim) ? out : across(-Vec3::UnitZ(), chord);
}

void add_parts(const SpoonInstrument& i, const cutting::Blade& blade, std::vector<TriangleMesh>& blades,
               std::vector<TriangleMesh>& grips) {
    for (const std::vector<Vec3>& line : blade.shape().polylines) {
        const double length = length_of(line);
        const std::vector<Vec3> front = subdivided(line, length / 40);
        const Vec3 middle = 0.5 * (line.front() + line.back());
        const Vec3 low = sag_of(front).normalized();
        double sag = 0;
        for (const Vec3& p : front) sag = std::max(sag, (p - middle).dot(low));
        const double behind = std::max(sag, 0.2 * length);
        const Vec3 back = across(i.back ? i.back->normalized() : wake(blade, line), low);
        const double depth = i.depth.value_or(0.25 * length);
        const double wall = i.thickness.value_or(0.02 * length);
        blades.push_back(
            bowl(closed_rim(front, low, behind), middle + 0.5 * (sag - behind) * low, back, depth, wall));
        const double handle = i.handle.value_or(2 * length);
        if (!(handle > 0)) continue;
        // The handle leaves the rear of the rim and rises out of the plane of the rim.
        const Vec3 rear = middle - behind * low;
        const std::vector<Vec3> axis = {rear + 0.5 * wall * low + 0.4 * wall * back,
                                        rear - 0.06 * handle * low - 0.01 * handle * back,
                                        rear - 0.15 * handle * low - 0.06 * handle * back,
                                        rear - 0.96 * handle * low - 0.28 * handle * back};
        const double thick = 0.024 * length;
        grips.push_back(make_tube({axis[0], axis[1], axis[2], axis[2] + 0.12 * (axis[3] - axis[2])}, thick));
        grips.push_back(make_rod(axis[2], axis[3], back.cross(low).normalized(), 0.045 * length, thick));
    }
}

geometry::Finish blade_finish(const ToolDescription& tool) {
    return tool.finish ? *tool.finish : *finish_of_kind("steel");
}

// A handle of metal is made of one piece with the rest.
geometry::Finish grip_finish(const ToolDescription& tool) {
    if (tool.grip_finish) return *tool.grip_finish;
    const auto* i = std::get_if<BladeInstrument>(&*tool.instrument);
    const bool is_one = std::holds_alternative<SpoonInstrument>(*tool.instrument) ||
                        (i != nullptr && i->kind == BladeKind::scalpel);
    return is_one ? blade_finish(tool) : *finish_of_kind("plastic");
}

}  // namespace

std::vector<InstrumentPart> instrument_parts(const ToolDescription& tool, BuildReport* report) {
    std::vector<InstrumentPart> out;
    if (!tool.instrument) return out;
    if (const auto* shape = std::get_if<MeshInstrument>(&*tool.instrument)) {
        TriangleMesh mesh = shape_mesh(shape->mesh, Parallel(1), report);
        const PlacementDescription& placement = shape->placement;
        const Mat3 turn = quaternion(placement.rotation).toRotationMatrix();
        for (Vec3& p : mesh.positions) p = placement.position + turn * placement.scale.cwiseProduct(p);
        out.push_back({std::move(mesh), blade_finish(tool), false});
        return out;
    }
    const cutting::Blade blade = make_blade(tool);
    std::vector<TriangleMesh> blades, grips;
    std::visit(
        Overloaded{[](const MeshInstrument&) {}, [&](const auto& i) { add_parts(i, blade, blades, grips); }},
        *tool.instrument);
    for (TriangleMesh& mesh : blades) out.push_back({std::move(mesh), blade_finish(tool), false});
    for (TriangleMesh& mesh : grips) out.push_back({std::move(mesh), grip_finish(tool), true});
    return out;
}

std::pair<double, double> shown_times(const ToolDescription& tool) {
    constexpr double forever = 1e300;  // s
    if (tool.solid) return {-forever, forever};
    const auto [first, last] = times_of(tool.motion);
    return {tool.shown_from.value_or(std::min(first, tool.active_from) - tuning::instrument::shown_beyond),
            tool.shown_until.value_or(std::max(last, tool.active_until) + tuning::instrument::shown_beyond)};
}

TriangleMesh instrument_mesh(const ToolDescription& tool, BuildReport* report) {
    TriangleMesh out;
    for (const InstrumentPart& part : instrument_parts(tool, report)) out.append(part.mesh);
    return out;
}

}  // namespace splitcubes::scene
