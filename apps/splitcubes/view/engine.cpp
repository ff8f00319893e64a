#include "engine.h"

#include "body_looks.h"
#include "scene_driver.h"
#include "vectors.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/scene/resolve.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <nlohmann/json.hpp>

namespace splitcubes::view {

namespace {

SimulationSettings simulation_settings(const scene::SceneDescription& d, const EngineSettings& settings) {
    SimulationSettings out{.time_step = d.time_step, .gravity = to_public(d.gravity)};
    if (d.ground) out.ground = Ground{.offset = d.ground->height, .friction = d.ground->friction};
    out.contact = {d.contact.pieces, d.contact.friction, d.contact.restitution};
    out.solver.explicit_steps = d.solver.kind == scene::SolverKind::explicit_steps;
    out.solver.integrator = static_cast<Integrator>(d.solver.integrator);
    out.solver.tolerance = d.solver.tolerance;
    out.solver.max_iterations = d.solver.max_iterations;
    out.history.automatic = false;
    out.history.memory_budget = settings.undo_bytes;
    out.thread_count = settings.threads > 0 ? settings.threads : d.threads;
    return out;
}

/// The arrays of a mesh as the public interface takes them.
struct FlatMesh {
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles;
    std::vector<float> uv;

    explicit FlatMesh(const io::Model& model) {
        for (const Vec3& p : model.mesh.positions) positions.insert(positions.end(), p.data(), p.data() + 3);
        for (const auto& t : model.mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
        for (const auto& corners : model.attributes.corner_uv)
            for (const auto& corner : corners) uv.insert(uv.end(), corner.begin(), corner.end());
    }
    MeshView view(const io::Model& model) const {
        return {positions, triangles, uv, model.attributes.triangle_material};
    }
};

void set_field(MaterialSettings& m, std::size_t index, double value) {
    switch (index) {
        case youngs_modulus:
            m.youngs_modulus = value;
            break;
        case poisson_ratio:
            m.poisson_ratio = value;
            break;
        case mass_damping:
            m.mass_damping = value;
            break;
        case stiffness_damping:
            m.stiffness_damping = value;
            break;
        case density:
            m.density = value;
            break;
        default:
            m.cutting_resistance = value;
    }
}

std::optional<TearingSettings> tearing_of(double strength) {
    if (!(strength > 0)) return {};
    return TearingSettings{.strength = strength};
}

}  // namespace

Engine::Engine(SceneSource source, const EngineSettings& settings, const Recording& script)
    : source_(std::make_unique<const SceneSource>(std::move(source))),
      settings_(settings),
      script_(script.commands.begin(), script.commands.end()),
      played_(script) {
    for (const auto& [name, value] : script.initial) changed_[parameter_index(name, "recording")] = value;
    start();
    for (const std::string& note : source_->notes) notify(note);
}

Engine::~Engine() = default;

void Engine::start() {
    source_->is_checkpoint ? start_from_checkpoint() : start_from_source();
    strokes_.clear();
    pulls_.clear();
    records_.clear();
    records_.resize(bodies_.size());
    recorded_.clear();
    log_.clear();
    curve_.clear();
    scene_forces_.clear();
    past_ = {};
    initial_.clear();
    for (const auto& [index, value] : changed_) initial_[std::string(parameter_list()[index].name)] = value;
    statistics_ = {};
    step_ = 0;
    spacing_ = bodies_.empty() ? 0 : simulation_->samples(bodies_.front()).spacing;
    keep_state(false);
}

// Changed parameters that a saved simulation has already are set again.
void Engine::start_from_checkpoint() {
    auto next = std::make_unique<Simulation>(simulation_settings(source_->description, settings_));
    next->load(source_->file.string());
    simulation_ = std::move(next);
    bodies_ = simulation_->bodies();
    driver_.reset();
    for (const auto& [index, value] : std::map(changed_)) set_parameter(index, value);
}

void Engine::start_from_source() {
    SimulationSettings settings = simulation_settings(source_->description, settings_);
    const auto changed = [&](std::size_t index, double& value) {
        if (const auto it = changed_.find(index); it != changed_.end()) value = it->second;
    };
    changed(time_step, settings.time_step);
    if (changed_.contains(gravity)) settings.gravity = {0, 0, -changed_[gravity]};
    changed(friction, settings.contact.friction);
    if (settings.ground) changed(friction, settings.ground->friction);
    auto next = std::make_unique<Simulation>(settings);
    std::vector<BodyId> bodies;
    for (const BodySource& body : source_->bodies) {
        const FlatMesh mesh(body.model);
        bodies.push_back(next->add_body(mesh.view(body.model), started_settings(body.settings)));
    }
    auto driver = std::make_unique<SceneDriver>(*source_, *next, bodies);
    simulation_ = std::move(next);
    bodies_ = std::move(bodies);
    driver_ = std::move(driver);
}

BodySettings Engine::started_settings(const BodySettings& settings) const {
    BodySettings out = settings;
    for (const auto& [index, value] : changed_) {
        if (index <= cutting_resistance) set_field(out.material, index, value);
        if (index == strength) out.tearing = tearing_of(value);
        if (index == cell_size) out.cell_size = value;
        if (index == phyxel_spacing) out.phyxel_spacing = value;
    }
    return out;
}

double Engine::time() const {
    return simulation_->time();
}

double Engine::step_length() const {
    return simulation_->time_step();
}

std::uint64_t Engine::state_hash() const {
    return simulation_->state_hash();
}

std::size_t Engine::pieces() const {
    std::size_t out = 0;
    for (const BodyId body : bodies_) out += simulation_->piece_count(body);
    return out;
}

void Engine::notify(const std::string& notice) {
    notice_ = notice;
    ++notices_;
}

void Engine::apply(const Command& command) {
    try {
        const bool travels = command.kind == CommandKind::undo || command.kind == CommandKind::redo;
        // One that does nothing could do something where the recording is repeated.
        if (travels && !travel(command.kind == CommandKind::undo)) return;
        if (!travels) carry_out(command);
        // A repetition is recorded already.
        if (is_recorded(command.kind) && !past_.is_shown) recorded_.push_back({step_, command});
        if (travels) keep_state(true);
    } catch (const std::exception& error) {
        notify(error.what());
    }
}

void Engine::carry_out(const Command& command) {
    switch (command.kind) {
        case CommandKind::set_parameter:
            return set_parameter(parameter_index(command.name, "command"), command.value);
        case CommandKind::apply_preset:
            return apply_preset(command.name);
        case CommandKind::drop:
            return forget_gestures();
        case CommandKind::begin_stroke:
            return begin_stroke(command);
        case CommandKind::move_stroke:
            return strokes_.move(command, *simulation_);
        case CommandKind::end_stroke:
            return strokes_.end(command.slot);
        case CommandKind::begin_pull:
            return begin_pull(command);
        case CommandKind::move_pull:
            if (!command.points.empty()) pulls_.move(command.slot, command.points.front());
            return;
        case CommandKind::end_pull:
        case CommandKind::unpin:
            return pulls_.end(command.slot, *simulation_, log_);
        case CommandKind::pin:
            return pulls_.set_pinned(command.slot);
        case CommandKind::restart:
            return start();
        case CommandKind::resume_at:
            return resume_at(static_cast<std::int64_t>(command.value));
        case CommandKind::save_surface:
        case CommandKind::save_pieces:
        case CommandKind::save_checkpoint:
        case CommandKind::save_recording:
        case CommandKind::save_scene:
        case CommandKind::save_path:
        case CommandKind::save_curve:
            return save(command);
        case CommandKind::show_field:
            field_ = static_cast<Field>(static_cast<int>(command.value));
            details_ = static_cast<unsigned>(command.slot);
            return;
        default:
            return;
    }
}

// Undo goes back to before what is begun.
void Engine::mark_undo_point() {
    if (!past_.is_shown) {
        simulation_->mark_undo_point();
        past_.undone.clear();
        past_.marks.push_back({recorded_.size(), step_});
        // The history drops the oldest states where memory ends.
        const std::size_t count = std::min(past_.marks.size(), simulation_->undo_count());
        past_.marks.erase(past_.marks.begin(), past_.marks.end() - static_cast<std::ptrdiff_t>(count));
    }
    log_.forget_undone();
}

void Engine::begin_stroke(const Command& command) {
    if (strokes_.empty()) mark_undo_point();
    strokes_.begin(command, *simulation_, log_);
}

// Of forceps the first jaw is the one to undo.
void Engine::begin_pull(const Command& command) {
    if (command.anchor.body >= bodies_.size()) return;
    if (command.partner > command.slot && strokes_.empty()) mark_undo_point();
    pulls_.begin(command, bodies_[command.anchor.body], *simulation_, log_);
}

void Engine::change_materials(const std::function<void(MaterialSettings&)>& change) {
    for (const BodyId body : bodies_) {
        MaterialSettings material = simulation_->material(body);
        change(material);
        simulation_->set_material(body, material);
    }
}

void Engine::change_strength(double strength_now) {
    for (const BodyId body : bodies_) simulation_->set_tearing(body, tearing_of(strength_now));
}

void Engine::change_steps(std::size_t index, double value) {
    StepSettings settings = simulation_->step_settings();
    if (index == gravity) settings.gravity = {0, 0, -value};
    if (index == time_step) settings.time_step = value;
    if (index == friction) {
        settings.contact_friction = value;
        if (settings.ground_friction) settings.ground_friction = value;
    }
    simulation_->set_step_settings(settings);
}

void Engine::set_parameter(std::size_t index, double value) {
    const Parameter& parameter = parameter_list()[index];
    if (!(value >= 0) || !std::isfinite(value))
        throw InputError(std::string(parameter.name), "is out of range (" + plain_number(value, 6) + ")",
                         "give " + plain_number(parameter.low, 6) + " to " + plain_number(parameter.high, 6));
    if (index <= cutting_resistance)
        change_materials([&](MaterialSettings& material) { set_field(material, index, value); });
    else if (index == strength)
        change_strength(value);
    else if (!parameter.restarts)
        change_steps(index, value);
    changed_[index] = value;
    if (parameter.restarts) notify(std::string(parameter.label) + ": takes effect with the next restart");
}

void Engine::apply_preset(const std::string& name) {
    const Preset& preset = preset_of(name, "preset");
    const auto values = preset.values();
    change_materials([&](MaterialSettings& material) {
        for (std::size_t k = 0; k < strength; ++k) set_field(material, k, values[k]);
    });
    change_strength(preset.strength);
    for (std::size_t k = 0; k < values.size(); ++k) changed_[k] = values[k];
}

double Engine::parameter_value(std::size_t index) const {
    if (bodies_.empty()) return 0;
    const BodyId body = bodies_.front();
    const StepSettings steps = simulation_->step_settings();
    const MaterialSettings m = simulation_->material(body);
    switch (index) {
        case youngs_modulus:
            return m.youngs_modulus;
        case poisson_ratio:
            return m.poisson_ratio;
        case mass_damping:
            return m.mass_damping;
        case stiffness_damping:
            return m.stiffness_damping;
        case density:
            return m.density;
        case cutting_resistance:
            return m.cutting_resistance;
        case strength: {
            const auto tearing = simulation_->tearing(body);
            return tearing && std::isfinite(tearing->strength) ? tearing->strength : 0;
        }
        case gravity:
            return to_eigen(steps.gravity).norm();
        case friction:
            return steps.ground_friction.value_or(steps.contact_friction);
        case time_step:
            return steps.time_step;
        default:
            break;
    }
    if (const auto it = changed_.find(index); it != changed_.end()) return it->second;
    return index == cell_size ? simulation_->cell_size(body) : spacing_;
}

// Gestures that are under way belong to the state that is left.
bool Engine::travel(bool back) {
    auto left = driver_ ? std::make_shared<const SceneDriver>(*driver_) : nullptr;
    if (!(back ? simulation_->undo() : simulation_->redo())) {
        notify(back ? "there is nothing to undo" : "there is nothing to redo");
        return false;
    }
    back ? log_.go_back(simulation_->time()) : log_.go_forward(simulation_->time());
    note_travel(back, std::move(left));
    return true;
}

void Engine::forget_gestures() {
    strokes_.clear();
    pulls_.after_travel(*simulation_, log_);
    remove_unowned();
}

void Engine::remove_unowned() {
    for (const ToolId tool : simulation_->tools())
        if (!driver_ || !driver_->owns(tool)) simulation_->remove_tool(tool);
    for (const HandleId handle : simulation_->handles())
        if (!pulls_.owns(handle) && (!driver_ || !driver_->owns(handle))) simulation_->remove_handle(handle);
}

void Engine::run_script() {
    while (!script_.empty() && script_.front().step <= step_) {
        const Command command = script_.front().command;
        script_.pop_front();
        apply(command);
    }
}

void Engine::step() {
    Stopwatch watch;
    run_script();
    try {
        if (driver_) driver_->advance(*simulation_);
        strokes_.before_step(*simulation_, log_);
        pulls_.before_step(*simulation_, log_);
        const StepResult result = simulation_->step();
        strokes_.take_forces(result);
        strokes_.after_step(*simulation_, log_);
        pulls_.take_forces(result);
        if (pulls_.slips(*simulation_, log_)) notify("the forceps slipped off: more Grip holds more");
        scene_forces_.clear();
        if (driver_) driver_->append_forces(result, simulation_->time(), scene_forces_);
        statistics_ = {};
        for (std::size_t k = 0; k < std::min(result.stages.size(), stage_count); ++k)
            statistics_.stage_ms[k] = static_cast<float>(1e3 * result.stages[k].seconds);
        statistics_.kinetic_energy = result.kinetic_energy;
        statistics_.elastic_energy = result.elastic_energy;
        for (const ToolResult& tool : result.tools) statistics_.tool_force += to_eigen(tool.force).norm();
        statistics_.tool_force += pulls_.total_force();
        statistics_.contacts = result.contacts;
        statistics_.new_cut_edges = result.new_cut_edges;
        statistics_.solver_iterations = result.solver_iterations;
        statistics_.warnings = result.warnings;
    } catch (const std::exception& error) {
        if (past_.is_shown) throw;
        notify(std::string(error.what()) + "; the scene starts again");
        start();
        return;
    }
    ++step_;
    statistics_.step_ms = 1e3 * watch.lap();
    count_step();
    if (strokes_.empty() && pulls_.is_idle()) keep_state(false);
    if (played_.steps == 0 || step_ != played_.steps) return;
    // The last commands came after the last step.
    run_script();
    notify(state_hash() == played_.state_hash ? "the recording has ended in the state that was recorded"
                                              : "the recording has ended in another state");
}

Recording Engine::recording() const {
    return {source_->file, initial_, step_, state_hash(), recorded_};
}

void Engine::count_step() {
    CurvePoint point{.step = step_,
                     .time = simulation_->time(),
                     .step_ms = statistics_.step_ms,
                     .pieces = pieces(),
                     .cut_edges = statistics_.new_cut_edges};
    for (const BodyRecord& record : records_) point.triangles += record.triangles;
    curve_.add(point);
}

void Engine::save_surfaces(const std::string& file) const {
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
        std::filesystem::path name = file;
        if (k > 0)
            name.replace_filename(name.stem().string() + "-" + std::to_string(k) + name.extension().string());
        simulation_->write_surface(bodies_[k], name.string());
    }
}

// Parameters have the values of now; those of a scene that were not changed stay.
scene::SceneDescription Engine::scene_with_strokes() const {
    scene::SceneDescription out = exported_scene(*source_, log_, step_ + 1);
    for (const auto& [index, value] : changed_) {
        if (index == gravity) out.gravity = Vec3(0, 0, -value);
        if (index == time_step) out.time_step = value;
        if (index == friction) out.contact.friction = value;
        if (index == friction && out.ground) out.ground->friction = value;
    }
    for (std::size_t b = 0; b < std::min(out.bodies.size(), bodies_.size()); ++b) {
        scene::BodyDescription& body = out.bodies[b];
        const MaterialSettings now = simulation_->material(bodies_[b]);
        body.material.density = now.density;
        body.material.youngs_modulus = now.youngs_modulus;
        body.material.poisson_ratio = now.poisson_ratio;
        body.material.mass_damping = now.mass_damping;
        body.material.stiffness_damping = now.stiffness_damping;
        body.material.cutting_resistance = now.cutting_resistance;
        if (const auto it = changed_.find(strength); it != changed_.end()) {
            if (!(it->second > 0)) body.material.tearing.reset();
            if (it->second > 0 && !body.material.tearing) body.material.tearing.emplace();
            if (it->second > 0) body.material.tearing->strength = it->second;
        }
        if (initial_.contains("cell_size")) {
            body.cells.reset();
            body.cell_size = initial_.at("cell_size");
        }
        if (initial_.contains("phyxel_spacing")) {
            body.phyxel_count.reset();
            body.phyxel_spacing = initial_.at("phyxel_spacing");
        }
    }
    return out;
}

void Engine::save(const Command& command) {
    const std::string& name = command.name;
    std::string saved = "saved " + name;
    switch (command.kind) {
        case CommandKind::save_surface:
            save_surfaces(name);
            break;
        case CommandKind::save_pieces:
            save_pieces(name);
            saved = "saved the pieces in " + name;
            break;
        case CommandKind::save_checkpoint:
            simulation_->save(name);
            break;
        case CommandKind::save_scene:
            write_file(name, scene::resolved_scene(scene_with_strokes(),
                                                   std::filesystem::absolute(name).parent_path())
                                     .dump(1) +
                                 '\n');
            break;
        case CommandKind::save_path: {
            const auto files = write_paths(name, *source_, log_);
            if (files.size() > 1) saved += " and " + std::to_string(files.size() - 1) + " more";
            break;
        }
        case CommandKind::save_curve:
            write_curve(name, source_->description.name, curve_.points());
            break;
        default:
            write_session_recording(name, recording());
    }
    notify(saved);
}

void Engine::save_pieces(const std::string& folder) const {
    std::filesystem::create_directories(folder);
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        for (std::size_t piece = 0; piece < simulation_->piece_count(bodies_[b]); ++piece) {
            const std::string name = "body-" + std::to_string(b) + "-piece-" + std::to_string(piece) + ".ply";
            simulation_->write_surface(bodies_[b], (std::filesystem::path(folder) / name).string(),
                                       static_cast<int>(piece));
        }
}

}  // namespace splitcubes::view
