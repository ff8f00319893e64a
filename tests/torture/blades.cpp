#include "blades.h"

#include <algorithm>

namespace splitcubes::torture {

namespace {

Json straight(const Vec3& half) {
    return {{"straight", {{"from", to_json(rounded(Vec3(-half)))}, {"to", to_json(rounded(half))}}}};
}

Json keyframe(double time, const Vec3& position) {
    return {{"time", rounded(time)}, {"position", to_json(rounded(position))}};
}

Json path(Json keyframes) {
    return {{"path", {{"keyframes", std::move(keyframes)}}}};
}

// A passage of a blade past the target.
struct Passage {
    const Target* target = nullptr;
    double from = 0, until = 0;                        // s
    Vec3 aim = Vec3::Zero();                           // m, on its way
    Vec3 along = Vec3::Zero(), across = Vec3::Zero();  // of the blade, of its motion; unit
};

Passage draw_passage(Draw& draw, const std::vector<Target>& targets, double duration, double time_step) {
    Passage out;
    out.target =
        &targets[static_cast<std::size_t>(draw.between(0, static_cast<std::int64_t>(targets.size()) - 1))];
    out.from = draw.real(0, 0.6) * duration;
    const double share = draw.real(0, 1);
    out.until = out.from + std::max(0.5 * time_step, share * share * 0.2 * duration);
    const Vec3 offset = draw.in_cube(0.5 * out.target->radius);
    out.aim = out.target->at((out.from + out.until) / 2) + offset;
    out.along = draw.direction();
    out.across = draw.across(out.along);
    return out;
}

Json sweep(const Passage& p, double before, double after) {
    return path({keyframe(p.from, p.aim - before * p.across), keyframe(p.until, p.aim + after * p.across)});
}

Json bent_blade(Draw& draw, const Passage& p) {
    const auto corners = draw.between(1, 3);
    const double r = p.target->radius;
    Json points = Json::array();
    const Vec3 side = p.along.cross(p.across);
    for (std::int64_t k = 0; k <= corners + 1; ++k) {
        const double s = 2.4 * static_cast<double>(k) / static_cast<double>(corners + 1) - 1.2;
        points.push_back(to_json(rounded(Vec3(r * (s * p.along + draw.real(-0.3, 0.3) * side)))));
    }
    return {{"polyline", {{"points", points}}}};
}

Json arc_blade(Draw& draw, const Passage& p) {
    const auto start = draw.between(0, 359);
    const auto angle = draw.chance(1, 3) ? 380 : draw.between(60, 300);
    return {{"arc",
             {{"radius", rounded(draw.real(0.2, 0.8) * p.target->radius)},
              {"axis", to_json(rounded(p.across))},
              {"start_angle_degrees", start},
              {"end_angle_degrees", start + angle},
              {"segments", draw.between(4, 24)}}}};
}

// Three keyframes on a smooth path, along which the blade turns.
Json turning_motion(Draw& draw, const Passage& p) {
    const double reach = 1.2 * p.target->radius;
    const Vec3 axis = draw.direction();
    const Vec3 bend = draw.real(-0.3, 0.3) * p.target->radius * p.along;
    Json keys = {keyframe(p.from, p.aim - reach * p.across), keyframe((p.from + p.until) / 2, p.aim + bend),
                 keyframe(p.until, p.aim + reach * p.across)};
    for (std::size_t k = 1; k < 3; ++k)
        keys[k]["rotation"] = {{"axis", to_json(rounded(axis))}, {"angle_degrees", draw.between(-60, 60)}};
    Json out = path(keys);
    out["path"]["interpolation"] = "smooth";
    return out;
}

Json circular_motion(Draw& draw, const Passage& p) {
    return {{"circular",
             {{"center", to_json(rounded(p.aim))},
              {"axis", to_json(rounded(p.along))},
              {"radius", rounded(draw.real(0.1, 0.7) * p.target->radius)},
              {"start_angle_degrees", draw.between(0, 359)},
              {"turns", rounded(draw.real(-1.2, 1.2))},
              {"from_time", rounded(p.from)},
              {"until_time", rounded(p.until)}}}};
}

// An earlier path once more, later.
Json again(const Json& earlier, double later) {
    Json tool = earlier;
    const auto shift = [&](Json& time) { time = rounded(time.get<double>() + later); };
    if (tool["motion"].contains("path")) {
        for (Json& key : tool["motion"]["path"]["keyframes"]) shift(key["time"]);
    } else {
        shift(tool["motion"]["circular"]["from_time"]);
        shift(tool["motion"]["circular"]["until_time"]);
    }
    return tool;
}

Json draw_tool(Draw& draw, const Passage& p, const Json& earlier) {
    const double r = p.target->radius, cell = p.target->cell_size;
    const auto kind = draw.between(0, 11);
    const auto made = [](const Json& blade, const Json& motion) {
        return Json{{"name", ""}, {"blades", Json::array({blade})}, {"motion", motion}};
    };
    // Short ones are more frequent, and most leave the body whole.
    const double share = draw.real(0, 1);
    const double half = (0.2 + share * share) * r;
    const Json across = straight(half * p.along);
    switch (kind) {
        case 0:  // ends inside
            return made(across, sweep(p, 1.2 * r, 0));
        case 1:  // of one node
            return made(straight(0.6 * cell * p.along), sweep(p, 1.2 * cell, 1.2 * cell));
        case 2:
            if (!earlier.empty()) {
                const auto last = static_cast<std::int64_t>(earlier.size()) - 1;
                return again(earlier[static_cast<std::size_t>(draw.between(0, last))], p.until - p.from);
            }
            return made(across, sweep(p, 1.2 * r, 1.2 * r));
        case 3:
            return made(bent_blade(draw, p), sweep(p, 1.2 * r, 1.2 * r));
        case 4:
            return made(arc_blade(draw, p), sweep(p, 1.2 * r, 1.2 * r));
        case 5:
            return made(across, turning_motion(draw, p));
        case 6:
            return made(across, circular_motion(draw, p));
        case 7: {  // two blades that meet
            Json tool = made(across, sweep(p, 1.2 * r, 1.2 * r));
            tool["blades"].push_back(straight(half * draw.direction()));
            return tool;
        }
        case 8: {  // along the surface
            Passage grazing = p;
            const Vec3 out = p.along.cross(p.across);
            grazing.aim = p.target->at((p.from + p.until) / 2) + draw.real(0.3, 0.7) * r * out;
            return made(across, sweep(grazing, 1.2 * r, 1.2 * r));
        }
        case 9:  // all the way across
            return made(straight(1.2 * r * p.along), sweep(p, 1.2 * r, 1.2 * r));
        default:
            return made(across, sweep(p, 1.2 * r, 1.2 * r));
    }
}

}  // namespace

Vec3 Target::at(double time) const {
    const double t = std::min(time, longest_fall);
    return center + t * velocity + 0.5 * t * t * gravity;
}

Json draw_tools(Draw& draw, const std::vector<Target>& targets, int count, double duration,
                double time_step) {
    Json tools = Json::array();
    for (int k = 0; k < count; ++k) {
        const Passage passage = draw_passage(draw, targets, duration, time_step);
        Json tool = draw_tool(draw, passage, tools);
        tool["name"] = "blade" + std::to_string(k);
        if (draw.chance(1, 8)) tool["bodies"] = Json::array({passage.target->name});
        if (draw.chance(1, 8)) {
            tool["side"] = rounded(draw.real(0, 1) * passage.target->radius);
            tool["friction"] = rounded(draw.real(0, 1));
        }
        tools.push_back(tool);
    }
    return tools;
}

}  // namespace splitcubes::torture
