#include "graphs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include <imgui.h>

namespace splitcubes::view {

namespace {

constexpr ImU32 back_colour = IM_COL32(255, 255, 255, 14), text_colour = IM_COL32(225, 228, 232, 255),
                limit_colour = IM_COL32(255, 255, 255, 130);

ImU32 stage_colour(std::size_t stage) {
    const ImVec4 colour =
        ImColor::HSV(std::fmod(0.58F + 0.381966F * static_cast<float>(stage), 1.0F), 0.55F, 0.88F);
    return ImGui::ColorConvertFloat4ToU32(colour);
}

// Top of a graph of zeros.
constexpr double least_top = 1e-9;

// The next of 1, 2, 5, 10, ... that is not below.
double round_up(double value) {
    if (!(value > least_top)) return least_top;
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= value) return factor * power;
    return 10 * power;
}

struct Area {
    ImVec2 low, high;
    ImDrawList* list;
    float column;

    Area(float width, float height)
        : low(ImGui::GetCursorScreenPos()),
          high(low.x + width, low.y + height),
          list(ImGui::GetWindowDrawList()),
          column(width / static_cast<float>(history_length)) {
        ImGui::Dummy({width, height});
        list->AddRectFilled(low, high, back_colour);
    }
    float height() const { return high.y - low.y; }
    float x(std::size_t step, std::size_t count) const {
        return high.x - column * static_cast<float>(count - step);
    }
    void label(const std::string& text) const {
        list->AddText({low.x + 4, low.y + 2}, text_colour, text.c_str());
    }
};

std::string label_of(const char* format, double value) {
    if (value <= least_top) value = 0;
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

void draw_series(const Area& area, const StepHistory& history, double top, ImU32 colour,
                 const std::function<double(const StepStatistics&)>& value) {
    std::vector<ImVec2> points;
    const auto& steps = history.steps();
    for (std::size_t k = 0; k < steps.size(); ++k) {
        const double share = std::clamp(value(steps[k]) / top, 0.0, 1.0);
        points.push_back({area.x(k, steps.size()), area.high.y - static_cast<float>(share) * area.height()});
    }
    area.list->AddPolyline(points.data(), static_cast<int>(points.size()), colour, 0, 1.5F);
}

double largest(const StepHistory& history, const std::function<double(const StepStatistics&)>& value) {
    double out = 0;
    for (const StepStatistics& step : history.steps()) out = std::max(out, value(step));
    return out;
}

}  // namespace

// Single slow steps do not flatten the rest: the scale is that of the 99th percentile.
void draw_stage_graph(const StepHistory& history, double step_length_ms, float width, float height) {
    const Area area(width, height);
    const Spread total = history.total();
    const double top = round_up(std::max(1.1 * total.high, 0.1));
    const auto& steps = history.steps();
    for (std::size_t k = 0; k < steps.size(); ++k) {
        double sum = 0;
        for (std::size_t stage = 0; stage < stage_count; ++stage) {
            const double from = std::min(sum / top, 1.0);
            sum += steps[k].stage_ms[stage];
            const double to = std::min(sum / top, 1.0);
            if (to <= from) continue;
            const float x = area.x(k, steps.size());
            area.list->AddRectFilled(
                {x, area.high.y - static_cast<float>(to) * area.height()},
                {x + std::max(1.0F, area.column), area.high.y - static_cast<float>(from) * area.height()},
                stage_colour(stage));
        }
    }
    if (step_length_ms < top) {
        const float y = area.high.y - static_cast<float>(step_length_ms / top) * area.height();
        area.list->AddLine({area.low.x, y}, {area.high.x, y}, limit_colour);
    }
    area.label(label_of("%.3g ms", top));
}

void draw_stage_table(const StepHistory& history) {
    if (!ImGui::BeginTable("stages", 4, ImGuiTableFlags_SizingStretchProp)) return;
    ImGui::TableSetupColumn("ms", 0, 1.9F);
    for (const char* name : {"median", "99 %", "worst"}) ImGui::TableSetupColumn(name, 0, 1.0F);
    ImGui::TableHeadersRow();
    const auto row = [](const char* name, const Spread& spread, ImU32 colour) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        ImGui::PushStyleColor(ImGuiCol_Text, colour);
        ImGui::TextUnformatted(name);
        ImGui::PopStyleColor();
        for (const double value : {spread.median, spread.high, spread.worst}) {
            ImGui::TableNextColumn();
            ImGui::Text(value < 100 ? "%.2f" : "%.0f", value);
        }
    };
    row("whole step", history.total(), text_colour);
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        const Spread spread = history.stage(stage);
        if (spread.worst >= 0.01) row(stage_labels()[stage].data(), spread, stage_colour(stage));
    }
    ImGui::EndTable();
}

void draw_energy_graph(const StepHistory& history, float width, float height) {
    const Area area(width, height);
    const auto kinetic = [](const StepStatistics& s) { return s.kinetic_energy; };
    const auto elastic = [](const StepStatistics& s) { return s.elastic_energy; };
    const double top = round_up(std::max(largest(history, kinetic), largest(history, elastic)));
    draw_series(area, history, top, IM_COL32(240, 190, 90, 255), kinetic);
    draw_series(area, history, top, IM_COL32(110, 190, 250, 255), elastic);
    area.label(label_of("%.6g J", top));
    ImGui::TextColored({0.94F, 0.75F, 0.35F, 1}, "kinetic");
    ImGui::SameLine();
    ImGui::TextColored({0.43F, 0.75F, 0.98F, 1}, "elastic");
}

void draw_force_graph(const StepHistory& history, float width, float height) {
    const Area area(width, height);
    const auto force = [](const StepStatistics& s) { return s.tool_force; };
    const double top = round_up(largest(history, force));
    draw_series(area, history, top, IM_COL32(240, 120, 120, 255), force);
    area.label(label_of("%.6g N", top));
}

}  // namespace splitcubes::view
