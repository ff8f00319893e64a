#include "viewer.h"

#include "parameters.h"

#include <splitcubes/core/error.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace splitcubes::view {

namespace {

constexpr double speed_step = 1.5;  // a key press

}  // namespace

/// A number that `set` events change.
struct Viewer::Slot {
    std::string_view name;
    std::function<double(const Viewer&)> get;
    std::function<void(Viewer&, double)> set;
};

const std::vector<Viewer::Slot>& Viewer::slots() {
    using V = Viewer;
    const auto number = [](auto member) {
        return std::pair{[member](const V& v) { return v.tools_.settings.*member; },
                         [member](V& v, double value) { v.tools_.settings.*member = std::max(0.0, value); }};
    };
    const auto flag = [](bool Display::*member) {
        return std::pair{[member](const V& v) { return v.display_.*member ? 1.0 : 0.0; },
                         [member](V& v, double value) { v.display_.*member = value != 0; }};
    };
    const auto slot = [](std::string_view name, const auto& both) {
        return Slot{name, both.first, both.second};
    };
    static const std::vector<Slot> all = {
        slot("shadows", flag(&Display::shadows)),
        slot("panels", flag(&Display::panels)),
        slot("wireframe", flag(&Display::wireframe)),
        slot("phyxels", flag(&Display::phyxels)),
        slot("links", flag(&Display::links)),
        slot("contacts", flag(&Display::contacts)),
        slot("forces", flag(&Display::forces)),
        slot("gallery", flag(&Display::gallery)),
        slot("help", flag(&Display::help)),
        slot("clip", flag(&Display::clips)),
        {"clip_axis", [](const V& v) { return static_cast<double>(v.display_.clip_axis); },
         [](V& v, double value) { v.display_.clip_axis = std::clamp(static_cast<int>(value), 0, 2); }},
        {"clip_offset", [](const V& v) { return v.display_.clip_offset; },
         [](V& v, double value) { v.display_.clip_offset = std::clamp(value, 0.0, 1.0); }},
        {"colouring", [](const V& v) { return static_cast<double>(v.display_.colouring); },
         [](V& v, double value) {
             v.display_.colouring = static_cast<Colouring>(
                 std::clamp(static_cast<int>(value), 0, static_cast<int>(colouring_names.size()) - 1));
         }},
        {"colour_range", [](const V& v) { return v.display_.range; },
         [](V& v, double value) { v.display_.range = std::max(0.0, value); }},
        {"knife_through", [](const V& v) { return v.tools_.settings.knife_through ? 1.0 : 0.0; },
         [](V& v, double value) { v.tools_.settings.knife_through = value != 0; }},
        slot("knife_depth", number(&ToolSettingsOfUser::knife_depth)),
        slot("scalpel_depth", number(&ToolSettingsOfUser::scalpel_depth)),
        {"scalpel_tilt", [](const V& v) { return v.tools_.settings.scalpel_tilt; },
         [](V& v, double value) { v.tools_.settings.scalpel_tilt = std::clamp(value, -80.0, 80.0); }},
        slot("scissors_length", number(&ToolSettingsOfUser::scissors_length)),
        slot("pull_strength", number(&ToolSettingsOfUser::pull_strength)),
        slot("blade_length", number(&ToolSettingsOfUser::blade_length)),
        slot("forceps_width", number(&ToolSettingsOfUser::forceps_width)),
        slot("forceps_grip", number(&ToolSettingsOfUser::forceps_grip)),
        {"speed", [](const V& v) { return v.speed_; },
         [](V& v, double value) {
             v.speed_ = std::clamp(value, 0.01, 4.0);
             v.send(CommandKind::set_speed, v.speed_);
         }},
        {"timeline", [](const V& v) { return v.scrubbed_ ? static_cast<double>(*v.scrubbed_) : -1.0; },
         [](V& v, double value) {
             v.scrubbed_.reset();
             if (value < 0) return;
             if (v.playing_) v.act("pause", {});
             if (v.shows_run()) return v.send(CommandKind::seek, value);
             v.scrubbed_ = static_cast<std::int64_t>(value);
             v.send(CommandKind::seek, value);
         }},
    };
    return all;
}

// Lengths of tools follow the body, and the rest belongs to a session.
std::vector<std::string> Viewer::kept_settings() {
    return {"shadows", "panels",    "wireframe",     "phyxels",      "links",         "contacts",
            "forces",  "colouring", "knife_through", "scalpel_tilt", "pull_strength", "forceps_grip"};
}

Viewer::Viewer() = default;

ToolContext Viewer::context() const {
    return {*state_, camera_, size_};
}

geometry::Box Viewer::bounds() const {
    geometry::Box out;
    if (!state_) return out;
    for (const BodyState& body : state_->bodies)
        if (!body.bounds.empty()) out.add(body.bounds);
    return out;
}

void Viewer::show(State state) {
    state_ = std::move(state);
    if (state_ && std::pair(state_->scene, state_->notices) != before_opening_) opening_.clear();
    // A run pauses by itself at its end.
    if (shows_run()) playing_ = state_->playing;
    if (!state_ || state_->scene == scene_ || state_->bodies.empty()) return;
    scene_ = state_->scene;
    scrubbed_.reset();
    playing_ = state_->playing;
    tools_.cancel(commands_);
    tools_.suit(bounds().size().norm());
    place_camera();
    update_field();
}

// A restart leaves the camera where it is.
void Viewer::place_camera() {
    if (state_->title == title_) return;
    title_ = state_->title;
    if (keeps_camera_) return;
    const scene::CameraDescription& wanted = state_->camera;
    if (wanted.eye && wanted.target) return camera_.look(*wanted.eye, *wanted.target);
    camera_.look(wanted.direction, Vec3::Zero());
    camera_.focus(bounds());
}

std::vector<Command> Viewer::take_commands() {
    std::vector<Command> out;
    out.swap(commands_);
    return out;
}

std::pair<WindowAct, std::string> Viewer::take_act() {
    if (acts_.empty()) return {WindowAct::none, {}};
    const auto out = acts_.front();
    acts_.pop_front();
    return out;
}

void Viewer::notify(const std::string& text) {
    notice_ = text;
    ++notices_;
}

void Viewer::send(CommandKind kind, double value, const std::string& name) {
    Command command;
    command.kind = kind;
    command.value = value;
    command.name = name;
    commands_.push_back(std::move(command));
}

Field Viewer::field() const {
    switch (display_.colouring) {
        case Colouring::von_mises_stress:
            return Field::von_mises_stress;
        case Colouring::principal_stress:
            return Field::principal_stress;
        case Colouring::principal_strain:
            return Field::principal_strain;
        default:
            return Field::none;
    }
}

void Viewer::update_field() {
    Command command;
    command.kind = CommandKind::show_field;
    command.value = static_cast<double>(field());
    command.slot =
        static_cast<int>((display_.phyxels ? show_samples : 0U) | (display_.links ? show_links : 0U) |
                         (display_.contacts ? show_contacts : 0U));
    commands_.push_back(std::move(command));
}

void Viewer::take(const ViewerInput& input) {
    switch (input.kind) {
        case InputKind::resize:
            size_ = {std::max(1.0, input.x), std::max(1.0, input.y)};
            return;
        case InputKind::press:
            return press(input);
        case InputKind::move:
            return move(input);
        case InputKind::release:
            if (drag_ == Drag::tool && state_) {
                move(input);
                tools_.release(context(), commands_);
            }
            drag_ = Drag::none;
            return;
        case InputKind::wheel:
            return wheel(input);
        case InputKind::six_axis:
            return six_axis(input);
        case InputKind::key:
            return key(input);
        case InputKind::set:
            return set(input.name, input.value);
        case InputKind::act:
            return act(input.name, input.text);
    }
}

// Tools act on the newest state only.
void Viewer::press(const ViewerInput& input) {
    x_ = input.x;
    y_ = input.y;
    const bool alt = (input.modifiers & alt_key) != 0, shift = (input.modifiers & shift_key) != 0;
    if (input.button == Button::middle || (input.button == Button::right && shift)) {
        drag_ = Drag::pan;
    } else if (input.button == Button::right || alt || shows_run()) {
        drag_ = Drag::orbit;
    } else if (state_ && !scrubbed_) {
        drag_ = Drag::tool;
        const std::size_t before = commands_.size();
        tools_.press(x_, y_, context(), commands_);
        // Tools that take hold of the material have sent something or begun something.
        if (!tools_.is_busy() && commands_.size() == before)
            notify("there is nothing under the pointer: begin on the body");
    }
}

// The free blade follows the device; with any other tool it moves the view.
void Viewer::six_axis(const ViewerInput& input) {
    if (state_ && !scrubbed_ && tools_.kind() == ToolKind::free_blade)
        return tools_.six_axis(input.axes, context(), commands_);
    const double pixels = size_.height;
    camera_.pan(pixels * input.axes[0], -pixels * input.axes[1], size_);
    camera_.zoom(10 * input.axes[2], camera_.target);
    camera_.orbit(pixels * input.axes[4], pixels * input.axes[3]);
}

void Viewer::move(const ViewerInput& input) {
    const double dx = input.x - x_, dy = input.y - y_;
    x_ = input.x;
    y_ = input.y;
    if (drag_ == Drag::orbit) camera_.orbit(dx, dy);
    if (drag_ == Drag::pan) camera_.pan(dx, dy, size_);
    if (state_ && !shows_run() && (drag_ == Drag::tool || drag_ == Drag::none))
        tools_.move(x_, y_, context(), commands_);
}

void Viewer::wheel(const ViewerInput& input) {
    if (state_ && input.modifiers == 0 && tools_.wheel(input.value, context(), commands_)) return;
    camera_.zoom(input.value, camera_.ray(x_, y_, size_).at(camera_.distance));
}

bool Viewer::select_by_key(const std::string& name) {
    for (std::size_t k = 0; k < tool_count; ++k) {
        if (tool_list()[k].key != name) continue;
        tools_.select(static_cast<ToolKind>(k), commands_);
        return true;
    }
    return false;
}

void Viewer::key(const ViewerInput& input) {
    const std::string& name = input.name;
    if ((input.modifiers & control_key) != 0) {
        const bool shift = (input.modifiers & shift_key) != 0;
        if (name == "z") act(shift ? "redo" : "undo", {});
        if (name == "y") act("redo", {});
        if (name == "q") act("quit", {});
        return;
    }
    if (select_by_key(name)) return;
    if (state_ && tools_.key(name, context(), commands_)) return;
    const auto toggle = [&](const char* setting_name) {
        set(setting_name, setting(setting_name) == 0 ? 1 : 0);
    };
    if (name == "space") act(playing_ ? "pause" : "play", {});
    if (name == ".") act("step", {});
    if (name == "r") act("restart", {});
    if (name == "f") act("focus", {});
    if (name == "m") toggle("wireframe");
    if (name == "o") toggle("phyxels");
    if (name == "l") toggle("links");
    if (name == "k") toggle("contacts");
    if (name == "n") toggle("forces");
    if (name == "g") toggle("gallery");
    if (name == "c") toggle("clip");
    if (name == "v")
        set("colouring", std::fmod(setting("colouring") + 1, static_cast<double>(colouring_names.size())));
    if (name == "f11") act("record_film", {});
    if (name == "tab") toggle("panels");
    if (name == "f1") toggle("help");
    if (name == "f12") act("save_picture", {});
    if (name == "+") set("speed", speed_ * speed_step);
    if (name == "-") set("speed", speed_ / speed_step);
    if (name == "escape") {
        tools_.cancel(commands_);
        drag_ = Drag::none;
        scrubbed_.reset();
    }
}

void Viewer::act(const std::string& name, const std::string& text) {
    struct Sent {
        std::string_view name;
        CommandKind kind;
    };
    static constexpr std::array<Sent, 16> sent = {{
        {"play", CommandKind::play},
        {"pause", CommandKind::pause},
        {"step", CommandKind::single_step},
        {"restart", CommandKind::restart},
        {"undo", CommandKind::undo},
        {"redo", CommandKind::redo},
        {"open", CommandKind::open},
        {"preset", CommandKind::apply_preset},
        {"save_surface", CommandKind::save_surface},
        {"save_pieces", CommandKind::save_pieces},
        {"save_checkpoint", CommandKind::save_checkpoint},
        {"save_recording", CommandKind::save_recording},
        {"save_scene", CommandKind::save_scene},
        {"save_path", CommandKind::save_path},
        {"save_curve", CommandKind::save_curve},
        {"resume", CommandKind::resume_at},
    }};
    if (name == "focus") return camera_.focus(bounds());
    static constexpr std::array<std::pair<std::string_view, WindowAct>, 4> own = {
        {{"quit", WindowAct::quit},
         {"save_picture", WindowAct::save_picture},
         {"save_film", WindowAct::save_film},
         {"record_film", WindowAct::record_film}}};
    for (const auto& [own_name, window_act] : own)
        if (own_name == name) return void(acts_.emplace_back(window_act, text));
    const auto* found =
        std::find_if(sent.begin(), sent.end(), [&](const Sent& one) { return one.name == name; });
    if (found == sent.end()) throw InputError("action", "there is no '" + printable(name) + "'");
    if (found->kind == CommandKind::open) {
        display_.gallery = false;
        opening_ = text;
        before_opening_ = {0, 0};
        if (state_) before_opening_ = {state_->scene, state_->notices};
    }
    if (found->kind == CommandKind::play) playing_ = true;
    if (found->kind == CommandKind::pause || found->kind == CommandKind::single_step) playing_ = false;
    if (found->kind != CommandKind::resume_at) {
        if (playing_ || found->kind != CommandKind::pause) scrubbed_.reset();
        return send(found->kind, 0, text);
    }
    if (!scrubbed_) return;
    playing_ = false;
    send(CommandKind::resume_at, static_cast<double>(*scrubbed_));
    scrubbed_.reset();
}

double Viewer::setting(const std::string& name) const {
    for (const Slot& slot : slots())
        if (slot.name == name) return slot.get(*this);
    throw InputError("setting", "there is no '" + printable(name) + "'");
}

bool Viewer::set_own(const std::string& name, double value) {
    for (const Slot& slot : slots()) {
        if (slot.name != name) continue;
        slot.set(*this, value);
        if (name == "colouring" || name == "phyxels" || name == "links" || name == "contacts") update_field();
        return true;
    }
    return false;
}

void Viewer::set(const std::string& name, double value) {
    if (!std::isfinite(value)) throw InputError(name, "is no finite number");
    if (set_own(name, value)) return;
    parameter_index(name, "setting");
    send(CommandKind::set_parameter, value, name);
}

}  // namespace splitcubes::view
