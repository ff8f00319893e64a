#include "idle_notes.h"

#include "report.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/cutting/sweep.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace splitcubes::app {

namespace {

std::string short_number(double value) {
    return plain_number(value, 4);
}

std::string text_of(const Vec3& p) {
    return '(' + short_number(p[0]) + ", " + short_number(p[1]) + ", " + short_number(p[2]) + ')';
}

std::string text_of(double length, const geometry::LengthUnit& unit) {
    return short_number(unit.from_metres(length)) + ' ' + std::string(unit.name);
}

std::string text_of(const geometry::Box& box, const geometry::LengthUnit& unit) {
    const auto corner = [&](Vec3 p) {
        for (double& x : p) x = unit.from_metres(x);
        return text_of(p);
    };
    return corner(box.min) + " to " + corner(box.max) + ' ' + std::string(unit.name);
}

const char* const passes_beside = "it passes beside the body or between the nodes of its grid";

// A plane's bounds are arbitrary, so its position along its normal is given instead.
std::string where_plane_is(const geometry::CuttingPlane& plane, const IdleCutter& idle) {
    const double length = plane.normal.stableNorm();
    const Vec3 normal = plane.normal / length;
    const double middle = normal.dot(idle.body.center());
    const double half = 0.5 * normal.cwiseAbs().dot(idle.body.size());
    const double at = plane.offset / length;
    return "along its normal " + text_of(normal) + " it is at " + text_of(at, idle.unit) + ", '" +
           idle.body_name + "' from " + text_of(middle - half, idle.unit) + " to " +
           text_of(middle + half, idle.unit) +
           (std::abs(at - middle) > half ? "" : std::string(": ") + passes_beside);
}

std::string edges(std::size_t count) {
    return std::to_string(count) + (count == 1 ? " edge" : " edges");
}

struct ToolNote {
    const char* reason;
    std::string text;
};

ToolNote tool_note(const body::IdleTool& idle, const body::World& world) {
    const cutting::Blade& blade = world.tools()[idle.tool].blade;
    const body::Body& body = *world.bodies()[idle.body];
    if (idle.sweep.empty())
        return {"never_active", "was never active and cut nothing: it is from " +
                                    short_number(blade.active_from()) + " s to " +
                                    short_number(blade.active_until()) + " s, the run ended at " +
                                    short_number(world.time()) + " s; run longer, or let it start earlier"};
    if (idle.before.uncut == 0 && idle.last.uncut > 0)
        return {"last_step", "reached '" + body.name() +
                                 "' in the last step, and its cuts appear a step later: nothing was cut yet; "
                                 "run longer"};
    splitting::CrossedEdges crossed = idle.before;
    crossed.add(idle.last);
    const bool still = sweeps_nothing(blade, 0, world.time());
    return {idle_reason(crossed), idle_note({.cutter = idle.sweep,
                                             .body = idle.bounds,
                                             .crossed = crossed,
                                             .cell_size = body.grid().rest().cell_size,
                                             .body_name = body.name(),
                                             .cell_option = "cell_size",
                                             .sweeps_nothing = still})};
}

}  // namespace

const char* idle_reason(const splitting::CrossedEdges& crossed) {
    if (crossed.cut > 0) return "already_cut";
    return crossed.boundary > 0 || crossed.uncut > 0 ? "near_surface" : "missed";
}

std::string idle_note(const IdleCutter& idle) {
    const splitting::CrossedEdges& crossed = idle.crossed;
    if (crossed.cut > 0)
        return "nothing was cut: all " + edges(crossed.cut) + " inside '" + idle.body_name +
               "' that it crosses were cut before; move it elsewhere, or leave it out";
    if (crossed.boundary > 0 || crossed.uncut > 0)
        return "nothing was cut: it stayed closer than a cell (" + text_of(idle.cell_size, idle.unit) +
               ") to the surface of '" + idle.body_name + "', where it crosses " +
               edges(crossed.boundary + crossed.uncut) +
               " of the grid; move it further in, or take a smaller " + idle.cell_option;
    const std::string missed = "nothing was cut: it missed '" + idle.body_name + "'; ";
    if (idle.plane) return missed + where_plane_is(*idle.plane, idle);
    const bool apart = !idle.cutter.meets(idle.body);
    if (!apart && idle.sweeps_nothing)
        return "nothing was cut: its edge stands still or moves along itself, and sweeps no area; move it "
               "across its edge";
    return missed + "its bounding box is " + text_of(idle.cutter, idle.unit) + ", that of '" +
           idle.body_name + "' " + text_of(idle.body, idle.unit) +
           (apart ? "" : std::string(", and where these overlap ") + passes_beside);
}

bool sweeps_nothing(const cutting::Blade& blade, double t0, double t1) {
    constexpr double rounding = 1e-6;  // relative to the area that a motion across the edge would sweep
    double area = 0, max_area = 0;
    for (const cutting::SweptBlade& part : cutting::sweep(blade, t0, t1))
        for (const geometry::MovingSegment& s : part.segments) {
            const double length = std::max((s.b0 - s.a0).norm(), (s.b1 - s.a1).norm());
            area += 0.5 * (s.b1 - s.a0).cross(s.a1 - s.b0).norm();
            max_area += length * std::max((s.a1 - s.a0).norm(), (s.b1 - s.b0).norm());
        }
    return area <= rounding * max_area;
}

nlohmann::ordered_json note_idle_tools(const body::IdleTools& tools, const body::World& world) {
    auto out = nlohmann::ordered_json::array();
    for (const body::IdleTool& idle : tools.idle(world)) {
        const std::string& name = world.tools()[idle.tool].blade.name();
        const ToolNote note = tool_note(idle, world);
        print_notes("tool '" + name + "'", {note.text});
        out.push_back({{"tool", name}, {"reason", note.reason}});
    }
    return out;
}

}  // namespace splitcubes::app
