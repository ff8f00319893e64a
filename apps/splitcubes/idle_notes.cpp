#include "idle_notes.h"

#include "report.h"

#include <nlohmann/json.hpp>

#include <sstream>

namespace splitcubes::app {

namespace {

std::string short_number(double value) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(4);
    out << value + 0.0;  // no minus before zero
    return out.str();
}

std::string text_of(const Vec3& p) {
    return '(' + short_number(p[0]) + ", " + short_number(p[1]) + ", " + short_number(p[2]) + ')';
}

std::string text_of(const geometry::Box& box) {
    return text_of(box.min) + " to " + text_of(box.max) + " m";
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
    return {idle_reason(crossed), idle_note({idle.sweep, idle.bounds, crossed, body.grid().rest().cell_size,
                                             body.name(), "cell_size"})};
}

}  // namespace

const char* idle_reason(const splitting::CrossedEdges& crossed) {
    if (crossed.cut > 0) return "already_cut";
    return crossed.skin > 0 || crossed.uncut > 0 ? "near_surface" : "missed";
}

std::string idle_note(const IdleCutter& idle) {
    const splitting::CrossedEdges& crossed = idle.crossed;
    if (crossed.cut > 0)
        return "nothing was cut: all " + edges(crossed.cut) + " inside '" + idle.body_name +
               "' that it crosses were cut before; move it elsewhere, or leave it out";
    if (crossed.skin > 0 || crossed.uncut > 0)
        return "nothing was cut: it stayed closer than a cell (" + short_number(idle.cell_size) +
               " m) to the surface of '" + idle.body_name + "', where it crosses " +
               edges(crossed.skin + crossed.uncut) + " of the grid; move it further in, or take a smaller " +
               idle.cell_option;
    const bool apart = !idle.cutter.meets(idle.body);
    return "nothing was cut: it missed '" + idle.body_name + "'; its bounding box is " +
           text_of(idle.cutter) + ", that of '" + idle.body_name + "' " + text_of(idle.body) +
           (apart ? ""
                  : ", and where these overlap it passes beside the body or between the nodes of its grid");
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
