#include "panels.h"

#include "graphs.h"

#include <splitcubes/core/plain_number.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <epoxy/gl.h>
#include <imgui.h>

namespace splitcubes::view {

namespace {

constexpr ImGuiWindowFlags panel_flags = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                         ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings;
constexpr double notice_seconds = 8;

// Widths in units of the font's height, so that panels grow with it.
float em(double count) {
    return std::round(static_cast<float>(count) * ImGui::GetFontSize());
}

float left_width() {
    return em(17.5);
}
float right_width() {
    return em(19);
}
float bottom_height() {
    return em(4.6);
}

// The first of NAME-1.ENDING, NAME-2.ENDING, ... that is not there.
std::string unused_name(const std::string& stem, const std::string& ending) {
    for (int k = 1;; ++k) {
        std::string name = stem + "-" + std::to_string(k) + ending;
        if (!std::filesystem::exists(name)) return name;
    }
}

void begin_panel(const char* name, float x, float y, float width, float height) {
    ImGui::SetNextWindowPos({x, y});
    ImGui::SetNextWindowSize({width, height});
    ImGui::SetNextWindowBgAlpha(0);  // see fill_behind_panels()
    ImGui::Begin(name, nullptr, panel_flags | ImGuiWindowFlags_NoTitleBar);
}

void tooltip(std::string_view text) {
    if (!text.empty() && ImGui::IsItemHovered())
        ImGui::SetTooltip("%.*s", static_cast<int>(text.size()), text.data());
}

bool button(const char* label, bool is_on, const ImVec2& size) {
    if (is_on) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
    const bool pressed = ImGui::Button(label, size);
    if (is_on) ImGui::PopStyleColor();
    return pressed;
}

}  // namespace

render::PixelArea picture_area(const Viewer& viewer, int width, int height) {
    if (!viewer.display().panels) return {0, 0, width, height};
    const double scale = width / viewer.size().width;
    const auto pixels = [&](float length) {
        return static_cast<int>(std::lround(scale * static_cast<double>(length)));
    };
    const int left = pixels(left_width()), bottom = pixels(bottom_height());
    return {left, bottom, std::max(1, width - left - pixels(right_width())), std::max(1, height - bottom)};
}

void fill_behind_panels(const Viewer& viewer, int width, int height) {
    const render::PixelArea area = picture_area(viewer, width, height);
    const ImVec4 colour = ImGui::GetStyleColorVec4(ImGuiCol_WindowBg);
    glClearColor(colour.x, colour.y, colour.z, 1);
    glEnable(GL_SCISSOR_TEST);
    const auto fill = [](int x, int y, int columns, int rows) {
        if (columns <= 0 || rows <= 0) return;
        glScissor(x, y, columns, rows);
        glClear(GL_COLOR_BUFFER_BIT);
    };
    const int right = area.x + area.width;
    fill(0, 0, area.x, height);
    fill(right, 0, width - right, height);
    fill(area.x, 0, area.width, area.y);
    glDisable(GL_SCISSOR_TEST);
}

void Panels::set(const std::string& name, double value) {
    out_->push_back({.kind = InputKind::set, .name = name, .value = value});
}

void Panels::act(const std::string& name, const std::string& text) {
    out_->push_back({.kind = InputKind::act, .name = name, .text = text});
}

void Panels::slider(const Viewer& viewer, const char* label, const char* setting, double low, double high,
                    const char* format, bool logarithmic) {
    auto value = static_cast<float>(viewer.setting(setting));
    ImGui::PushID(setting);
    ImGui::SetNextItemWidth(em(6.6));
    if (ImGui::SliderFloat(label, &value, static_cast<float>(low), static_cast<float>(high), format,
                           logarithmic ? ImGuiSliderFlags_Logarithmic : 0))
        set(setting, value);
    ImGui::PopID();
}

void Panels::check(const Viewer& viewer, const char* label, const char* setting) {
    bool on = viewer.setting(setting) != 0;
    if (ImGui::Checkbox(label, &on)) set(setting, on ? 1 : 0);
}

void Panels::tool_bar(const Viewer& viewer) {
    const float width = 0.5F * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
    for (std::size_t k = 0; k < tool_count; ++k) {
        const ToolInfo& tool = tool_list()[k];
        const std::string label = std::string(tool.key) + "  " + std::string(tool.name);
        if (k % 2 == 1) ImGui::SameLine();
        if (button(label.c_str(), viewer.tools().kind() == static_cast<ToolKind>(k), {width, 0}))
            out_->push_back({.kind = InputKind::key, .name = std::string(tool.key)});
        tooltip(tool.help);
    }
    if (tool_count % 2 == 1) ImGui::SameLine();
    if (ImGui::Button("F1  Help", {width, 0})) set("help", viewer.setting("help") == 0 ? 1 : 0);
}

void Panels::tool_settings(const Viewer& viewer) {
    const double size = std::max(viewer.bounds().size().norm(), 1e-9);
    const ToolInfo& tool = tool_list()[static_cast<std::size_t>(viewer.tools().kind())];
    ImGui::PushTextWrapPos(0);
    ImGui::TextDisabled("%.*s", static_cast<int>(tool.help.size()), tool.help.data());
    ImGui::PopTextWrapPos();
    switch (viewer.tools().kind()) {
        case ToolKind::knife:
            check(viewer, "All the way through", "knife_through");
            if (viewer.setting("knife_through") == 0)
                slider(viewer, "Depth, m", "knife_depth", 0.005 * size, 0.6 * size, "%.4f");
            break;
        case ToolKind::scalpel:
            slider(viewer, "Depth, m", "scalpel_depth", 0.005 * size, 0.5 * size, "%.4f");
            slider(viewer, "Tilt", "scalpel_tilt", -80, 80, "%.0f deg");
            break;
        case ToolKind::scissors:
            slider(viewer, "Blades, m", "scissors_length", 0.02 * size, 0.8 * size, "%.4f");
            break;
        case ToolKind::free_blade:
            slider(viewer, "Length, m", "blade_length", 0.05 * size, 2 * size, "%.4f");
            break;
        case ToolKind::forceps:
            slider(viewer, "Opening, m", "forceps_width", 0.01 * size, 0.4 * size, "%.4f");
            slider(viewer, "Grip", "forceps_grip", 0.05, 20, "%.2f x", true);
            ImGui::Text("Holds up to %.3g N", viewer.tools().grip_limit(*viewer.state()));
            break;
        default:
            slider(viewer, "Pull", "pull_strength", 0.1, 10, "%.2f x", true);
    }
}

// The value goes out when the slider is let go: a change of the material makes the bodies again.
void Panels::parameter(const Viewer& viewer, std::size_t index) {
    const Parameter& p = parameter_list()[index];
    if (!is_edited_[index]) edited_[index] = static_cast<float>(viewer.state()->parameters[index]);
    ImGui::PushID(static_cast<int>(index));
    ImGui::SetNextItemWidth(em(6.6));
    const std::string label = std::string(p.label) + (p.unit.empty() ? "" : ", ") + std::string(p.unit);
    const char* format = p.high >= 100 ? "%.0f" : p.high >= 1 ? "%.3f" : "%.4f";
    ImGui::SliderFloat(label.c_str(), &edited_[index], static_cast<float>(p.low), static_cast<float>(p.high),
                       format, p.logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
    tooltip(p.help);
    is_edited_[index] = ImGui::IsItemActive();
    if (ImGui::IsItemDeactivatedAfterEdit()) set(std::string(p.name), edited_[index]);
    ImGui::PopID();
}

void Panels::materials(const Viewer& viewer) {
    ImGui::SetNextItemWidth(em(6.6));
    const Preset* now = preset_like(viewer.state()->parameters);
    if (ImGui::BeginCombo("Material", now == nullptr ? "choose" : now->name.data())) {
        for (const Preset& preset : preset_list()) {
            const std::string name(preset.name);
            if (ImGui::Selectable(name.c_str(), &preset == now)) act("preset", name);
            tooltip(preset.source);
        }
        ImGui::EndCombo();
    }
    if (now != nullptr) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextDisabled("%.*s", static_cast<int>(now->source.size()), now->source.data());
        ImGui::PopTextWrapPos();
    }
    for (std::size_t k = 0; k < parameter_count; ++k) {
        if (k == gravity) ImGui::Separator();
        if (k == cell_size) ImGui::TextDisabled("With the next restart:");
        parameter(viewer, k);
    }
    if (ImGui::Button("Restart (R)")) act("restart");
}

void Panels::display(const Viewer& viewer) {
    int colouring = static_cast<int>(viewer.display().colouring);
    ImGui::SetNextItemWidth(em(9));
    const auto name = [](void*, int k, const char** text) {
        *text = colouring_names[static_cast<std::size_t>(k)].data();
        return true;
    };
    if (ImGui::Combo("Colour (V)", &colouring, name, nullptr, static_cast<int>(colouring_names.size())))
        set("colouring", colouring);
    const auto two = [&](const char* label, const char* name_of_setting, const char* help) {
        check(viewer, label, name_of_setting);
        tooltip(help);
    };
    two("Edges (M)", "wireframe", "Edges of the triangles");
    ImGui::SameLine(em(8.5));
    two("Shadows", "shadows", "Shadows and ambient occlusion");
    if (!viewer.shows_run()) {
        two("Phyxels (O)", "phyxels", "The elastic samples");
        ImGui::SameLine(em(8.5));
        two("Links (L)", "links", "Between phyxels: red where a cut hides them from each other");
        two("Contacts (K)", "contacts", "Points that push: orange on things, purple between pieces");
        ImGui::SameLine(em(8.5));
        two("Forces (N)", "forces", "Of tools and pulls on the body");
    }
    two("Clip (C)", "clip", "Hides what is in front of a plane");
    if (!viewer.display().clips) return;
    int axis = viewer.display().clip_axis;
    for (int k = 0; k < 3; ++k) {
        if (k > 0) ImGui::SameLine();
        const char* names[] = {"x", "y", "z"};
        if (ImGui::RadioButton(names[k], &axis, k)) set("clip_axis", k);
    }
    slider(viewer, "Plane", "clip_offset", 0, 1, "%.2f");
}

void Panels::files(const Viewer& viewer, const PanelData& data) {
    const std::string stem = viewer.state()->title.empty() ? "splitcubes" : viewer.state()->title;
    const float width = 0.5F * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
    bool is_left = true;
    const auto place = [&] {
        if (!is_left) ImGui::SameLine();
        is_left = !is_left;
    };
    const auto save = [&](const char* label, const char* action, const char* ending, const char* help) {
        place();
        if (ImGui::Button(label, {width, 0})) act(action, unused_name(stem, ending));
        tooltip(help);
    };
    save("Picture (F12)", "save_picture", ".png", "What the window shows, without panels");
    save("Film so far", "save_film", ".mp4", "What the timeline holds, as it is shown now");
    place();
    if (button(data.is_recording ? "Stop film (F11)" : "Film on (F11)", data.is_recording, {width, 0}))
        act("record_film", data.is_recording ? "" : unused_name(stem, ".mp4"));
    tooltip("Films what comes from now on, until it is pressed again");
    if (viewer.shows_run()) return;
    save("Mesh", "save_surface", ".ply", "The surface of each body");
    save("Pieces", "save_pieces", "-pieces", "A folder with a mesh of each piece");
    save("State", "save_checkpoint", ".splitcubes", "To open again and go on from");
    save("Recording", "save_recording", ".jsonl", "All that was done; opening it repeats it to the last bit");
    save("Strokes as scene", "save_scene", ".json",
         "For `splitcubes run`: the scene with your strokes in it");
    save("Strokes as path", "save_path", "-path.json",
         "For `splitcubes cut --path`: your strokes on the mesh");
    save("Rate curve", "save_curve", ".svg", "Steps a second and triangles over the session");
    save("Rate table", "save_curve", ".csv", "The same as numbers");
}

void Panels::measures(const Viewer& viewer, const PanelData& data) {
    const PublishedState& state = *viewer.state();
    std::size_t pieces = 0;
    for (const BodyState& body : state.bodies) pieces += body.pieces;
    std::size_t triangles = 0;
    for (const BodyState& body : state.bodies) triangles += body.topology->origins.size();
    if (viewer.shows_run())
        ImGui::Text("%zu piece%s   %zu triangles", pieces, pieces == 1 ? "" : "s", triangles);
    else
        ImGui::Text("%zu piece%s   %zu contacts   %d iterations", pieces, pieces == 1 ? "" : "s",
                    state.statistics.contacts, state.statistics.solver_iterations);
    if (!data.quality.empty()) {
        ImGui::Text("in motion: %s", data.quality.c_str());
        tooltip("Chosen by the time that a picture takes; fine at rest");
    }
    const Spread latency = data.latencies.spread();
    if (data.frame_ms > 0)
        ImGui::Text("frame %.1f ms, %.1f of it not OpenGL", data.frame_ms, data.interface_ms);
    if (data.latencies.count() > 0)
        ImGui::Text("input to picture %.0f ms, worst %.0f", latency.median, latency.worst);
    else if (data.frame_ms > 0)
        ImGui::TextDisabled("input to picture: nothing done yet");
    if (viewer.shows_run()) return;
    const float width = ImGui::GetContentRegionAvail().x;
    ImGui::TextUnformatted("Time of a step");
    draw_stage_graph(data.history, 1e3 * state.parameters[time_step], width, em(6));
    ImGui::TextUnformatted("Energy");
    draw_energy_graph(data.history, width, em(3.4));
    ImGui::TextUnformatted("Force of tools");
    draw_force_graph(data.history, width, em(3.4));
    if (ImGui::CollapsingHeader("Stages of a step, ms")) draw_stage_table(data.history);
}

void Panels::run_control(const Viewer& viewer) {
    const PublishedState& state = *viewer.state();
    // In a narrow window keys give way, so that undo and redo are still there.
    const bool is_wide = ImGui::GetContentRegionAvail().x > em(40);
    const auto label = [&](const char* text, const char* key) {
        return std::string(text) + (is_wide ? key : "");
    };
    if (button(label(viewer.is_playing() ? "Pause" : "Play", " (Space)").c_str(), !viewer.is_playing(),
               {em(is_wide ? 8 : 4), 0}))
        act(viewer.is_playing() ? "pause" : "play");
    ImGui::SameLine();
    if (ImGui::Button(label("Step", " (.)").c_str())) act("step");
    ImGui::SameLine();
    if (ImGui::Button(label(viewer.shows_run() ? "Start" : "Restart", " (R)").c_str())) act("restart");
    ImGui::SameLine();
    if (!viewer.shows_run()) {
        const std::string undo = "Undo (" + std::to_string(state.undo_count) + ")";
        if (ImGui::Button(undo.c_str())) act("undo");
        tooltip("Ctrl+Z: back to before the last stroke of a blade or grip of forceps");
        ImGui::SameLine();
        const std::string redo = "Redo (" + std::to_string(state.redo_count) + ")";
        if (ImGui::Button(redo.c_str())) act("redo");
        ImGui::SameLine();
    }
    slider(viewer, "Speed", "speed", 0.02, 2, "%.2f x", true);
    ImGui::SameLine();
    ImGui::Text("  Time %.2f s", state.time);
    if (!viewer.is_playing() || !(state.real_time_factor > 0)) return;
    ImGui::SameLine();
    ImGui::Text("runs at %.2f x", state.real_time_factor);
}

void Panels::timeline(const Viewer& viewer, const PanelData& data) {
    run_control(viewer);
    std::optional<std::pair<std::int64_t, std::int64_t>> range = data.timeline;
    if (viewer.shows_run()) range = std::pair{std::int64_t{0}, viewer.state()->run_frames - 1};
    if (!range) return;
    const std::int64_t shown =
        viewer.shows_run() ? viewer.state()->step : viewer.scrubbed().value_or(range->second);
    auto step = static_cast<int>(shown);
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - em(viewer.scrubbed() ? 17 : 6));
    if (ImGui::SliderInt("Timeline", &step, static_cast<int>(range->first), static_cast<int>(range->second),
                         viewer.shows_run() ? "frame %d" : "step %d"))
        set("timeline", step);
    if (!viewer.scrubbed()) return;
    ImGui::SameLine();
    if (ImGui::Button("Go on from here")) act("resume");
    ImGui::SameLine();
    if (ImGui::Button("Now")) set("timeline", -1);
}

void Panels::legend(const Legend& legend) {
    if (legend.title.empty()) return;
    const float width = em(14);
    ImGui::SetNextWindowPos({left_width() + em(1), em(1)});
    ImGui::SetNextWindowSize({width, em(4.6)});
    ImGui::SetNextWindowBgAlpha(0.8F);
    ImGui::Begin("legend", nullptr, panel_flags | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoInputs);
    ImGui::TextUnformatted(legend.title.c_str());
    const ImVec2 at = ImGui::GetCursorScreenPos();
    constexpr int bands = 48;
    const float band = (width - em(1.3)) / bands;
    for (int k = 0; k < bands; ++k) {
        const double share = static_cast<double>(k) / (bands - 1);
        const Vec3 c = legend.is_of_links ? Vec3(link_colour(share))
                                          : render::scale_colour(legend.reversed ? 1 - share : share);
        ImGui::GetWindowDrawList()->AddRectFilled({at.x + band * static_cast<float>(k), at.y},
                                                  {at.x + band * static_cast<float>(k + 1), at.y + em(0.9)},
                                                  IM_COL32(255 * c.x(), 255 * c.y(), 255 * c.z(), 255));
    }
    ImGui::Dummy({0, em(0.8)});
    ImGui::TextUnformatted("0");
    const std::string text = plain_number(legend.high, 3);
    ImGui::SameLine(width - em(1) - ImGui::CalcTextSize(text.c_str()).x);
    ImGui::TextUnformatted(text.c_str());
    ImGui::End();
}

// The newest line of the simulation or of the window.
void Panels::notice(const Viewer& viewer, double seconds) {
    const PublishedState& state = *viewer.state();
    const auto show = [&](std::uint64_t& seen, std::uint64_t now, const std::string& text) {
        if (seen == now) return;
        seen = now;
        notice_ = text;
        notice_since_ = seconds;
    };
    show(notices_, state.notices, state.notice);
    show(own_notices_, viewer.notices(), viewer.notice());
    if (notice_.empty() || seconds > notice_since_ + notice_seconds) return;
    const float y = static_cast<float>(viewer.size().height) - bottom_height() - em(0.6);
    ImGui::SetNextWindowPos({left_width() + em(1), y}, 0, {0, 1});
    ImGui::SetNextWindowSizeConstraints(
        {0, 0}, {static_cast<float>(viewer.size().width) - left_width() - right_width() - em(2), em(20)});
    ImGui::SetNextWindowBgAlpha(0.9F);
    ImGui::Begin("notice", nullptr,
                 panel_flags | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoInputs);
    ImGui::PushTextWrapPos(static_cast<float>(viewer.size().width) - left_width() - right_width() - em(3));
    ImGui::TextUnformatted(notice_.c_str());
    ImGui::PopTextWrapPos();
    ImGui::End();
}

// Numbers at arrows.
void Panels::numbers(const Viewer& viewer, const PanelData& data) {
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    for (const NumberLabel& label : data.labels) {
        const Vec3 at = viewer.camera().project(label.at, viewer.size());
        if (!(at.z() > 0)) continue;
        const ImVec2 size = ImGui::CalcTextSize(label.text.c_str());
        const ImVec2 low{static_cast<float>(at.x()) - 0.5F * size.x,
                         static_cast<float>(at.y()) - 0.5F * size.y};
        list->AddRectFilled({low.x - 4, low.y - 2}, {low.x + size.x + 4, low.y + size.y + 2},
                            IM_COL32(255, 255, 255, 215), 4);
        list->AddText(low, IM_COL32(165, 20, 20, 255), label.text.c_str());
    }
}

// A line says how to begin, or that the window is busy.
void Panels::hint(const Viewer& viewer, const PanelData& data) {
    std::string text = data.film;
    if (!viewer.opening().empty())
        text = "Opening " + std::filesystem::path(viewer.opening()).filename().string() + " ...";
    if (text.empty() && viewer.scrubbed())
        text = "This is the past.  'Go on from here' below goes on from it, Esc goes back to now.";
    if (text.empty() && !viewer.is_playing())
        text = viewer.shows_run() ? "Press Space to play.  Drag to turn the view."
                                  : "Paused: press Space to play.  Strokes wait until then.";
    const ViewArea picture{left_width(), 0, viewer.size().width - right_width(),
                           viewer.size().height - bottom_height()};
    if (text.empty() && !viewer.is_button_down() &&
        has_left(viewer.bounds(), viewer.camera(), viewer.size(), picture))
        text = "It has left the picture.  F shows all of it.";
    if (text.empty()) return;
    const float middle = 0.5F * (left_width() + static_cast<float>(viewer.size().width) - right_width());
    ImGui::SetNextWindowPos({middle, em(0.8)}, 0, {0.5F, 0});
    ImGui::SetNextWindowBgAlpha(0.8F);
    ImGui::Begin("hint", nullptr,
                 panel_flags | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoInputs);
    ImGui::TextUnformatted(text.c_str());
    ImGui::End();
}

void Panels::help(const Viewer& viewer) {
    const bool beside_panels = viewer.display().panels && !viewer.display().gallery && viewer.state() &&
                               !viewer.state()->bodies.empty();
    const float left = beside_panels ? left_width() : 0, right = beside_panels ? right_width() : 0;
    const float width = static_cast<float>(viewer.size().width) - left - right - em(2);
    ImGui::SetNextWindowPos({left + em(1), em(4)});
    ImGui::SetNextWindowSize({std::max(width, em(20)), 0});
    const float tallest = static_cast<float>(viewer.size().height) - em(5);
    ImGui::SetNextWindowSizeConstraints({0, 0}, {std::max(width, em(20)), std::max(tallest, em(10))});
    ImGui::SetNextWindowBgAlpha(0.95F);
    ImGui::Begin("Help  (F1 closes it)", nullptr, panel_flags);
    ImGui::PushTextWrapPos(0);
    for (const ToolInfo& tool : tool_list()) {
        ImGui::TextUnformatted(tool.key.data());
        ImGui::SameLine(em(2));
        ImGui::TextUnformatted(tool.name.data());
        ImGui::SameLine(em(7.5));
        ImGui::TextUnformatted(tool.help.data());
    }
    ImGui::Separator();
    for (
        const char* line :
        {"Left button: the tool.   Right button: turn the view.   Middle button, or Shift and right: move "
         "it.",
         "Wheel: zoom.   F: show everything.   Tab: panels.   Esc: stop the tool, back from the timeline.",
         "Space: play and pause.   . : one step.   R: restart.   + and -: speed.   Ctrl+Z, Ctrl+Y: undo and "
         "redo.",
         "V: colour.   M: edges.   O: phyxels.   L: links.   K: contacts.   N: forces.   C: clip plane.",
         "F12: picture.   F11: film from now on, and again to end it.   G: gallery.   Ctrl+Q: quit.",
         "Buttons under Save (right) write films, meshes, pieces, recordings, and your strokes as a scene or "
         "a path.",
         "A mouse with six axes (through spacenavd) moves the free blade; its buttons lower it. With other "
         "tools it moves the view.",
         "Drop a scene, a mesh, a recording, a saved state or the folder of a run on the window to open it."})
        ImGui::TextUnformatted(line);
    ImGui::PopTextWrapPos();
    end_panel();
}

void Panels::end_panel() {
    const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    covered_.push_back({at.x, at.y, size.x, size.y});
    ImGui::End();
}

void Panels::draw_help(const Viewer& viewer) {
    covered_.clear();
    if (viewer.display().help) help(viewer);
}

bool Panels::covers(double x, double y) const {
    const auto px = static_cast<float>(x), py = static_cast<float>(y);
    return std::any_of(covered_.begin(), covered_.end(), [&](const std::array<float, 4>& r) {
        return px >= r[0] && py >= r[1] && px < r[0] + r[2] && py < r[1] + r[3];
    });
}

void Panels::draw(const Viewer& viewer, const PanelData& data, std::vector<ViewerInput>& out) {
    out_ = &out;
    covered_.clear();
    const auto width = static_cast<float>(viewer.size().width),
               height = static_cast<float>(viewer.size().height);
    notice(viewer, data.seconds);
    legend(data.legend);
    numbers(viewer, data);
    if (viewer.display().help) help(viewer);
    if (!viewer.display().panels) return;
    hint(viewer, data);
    begin_panel("left", 0, 0, left_width(), height);
    ImGui::Text("%s", viewer.state()->title.c_str());
    if (viewer.shows_run()) {
        ImGui::TextDisabled("Frames of a run, played back.");
    } else {
        tool_bar(viewer);
        tool_settings(viewer);
        ImGui::Separator();
        materials(viewer);
    }
    if (ImGui::Button("Gallery (G)")) set("gallery", 1);
    end_panel();
    begin_panel("right", width - right_width(), 0, right_width(), height);
    display(viewer);
    ImGui::Separator();
    ImGui::TextUnformatted("Save");
    files(viewer, data);
    ImGui::Separator();
    measures(viewer, data);
    end_panel();
    begin_panel("bottom", left_width(), height - bottom_height(), width - left_width() - right_width(),
                bottom_height());
    timeline(viewer, data);
    end_panel();
}

}  // namespace splitcubes::view
