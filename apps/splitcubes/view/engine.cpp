#include "engine.h"

#include "body_looks.h"
#include "scene_driver.h"
#include "vectors.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/attribute_transfer.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

namespace splitcubes::view {

namespace {

// Changes of a surface that a window may lag behind without copying the whole.
constexpr std::size_t max_changes = 64;

SimulationSettings simulation_settings(const scene::SceneDescription& d, const EngineSettings& settings) {
    SimulationSettings out{.time_step = d.time_step, .gravity = to_public(d.gravity)};
    if (d.ground) out.ground = Ground{.offset = d.ground->height, .friction = d.ground->friction};
    out.contact = {d.contact.pieces, d.contact.friction};
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

// Materials of the input have their own colours; cut faces are those of a fresh cut.
std::vector<Vec3> palette_of(const std::vector<std::string>& names,
                             const std::vector<geometry::Material>& materials) {
    constexpr double gamma = 2.2;  // materials are linear
    const Vec3 skin(0.90, 0.74, 0.62), cut(0.84, 0.20, 0.13);
    std::vector<Vec3> out;
    for (std::size_t k = 0; k < names.size(); ++k) {
        out.push_back(names[k].find(geometry::cut_material) != std::string::npos ? cut : skin);
        if (k < materials.size())
            for (int channel = 0; channel < 3; ++channel)
                out.back()[channel] =
                    std::pow(materials[k].colour[static_cast<std::size_t>(channel)], 1 / gamma);
    }
    return out;
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
    kept_.clear();
    initial_.clear();
    for (const auto& [index, value] : changed_) initial_[std::string(parameter_list()[index].name)] = value;
    statistics_ = {};
    step_ = 0;
    spacing_ = bodies_.empty() ? 0 : simulation_->samples(bodies_.front()).spacing;
    keep_state();
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
        carry_out(command);
        if (is_recorded(command.kind)) recorded_.push_back({step_, command});
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
        case CommandKind::undo:
            return travel(true);
        case CommandKind::redo:
            return travel(false);
        case CommandKind::begin_stroke:
            return begin_stroke(command);
        case CommandKind::move_stroke:
            return strokes_.move(command, *simulation_);
        case CommandKind::end_stroke:
            return strokes_.end(command.slot);
        case CommandKind::begin_pull:
            if (command.anchor.body < bodies_.size())
                pulls_.begin(command, bodies_[command.anchor.body], *simulation_);
            return;
        case CommandKind::move_pull:
            if (!command.points.empty()) pulls_.move(command.slot, command.points.front());
            return;
        case CommandKind::end_pull:
        case CommandKind::unpin:
            return pulls_.end(command.slot, *simulation_);
        case CommandKind::pin:
            return pulls_.set_pinned(command.slot);
        case CommandKind::restart:
            return start();
        case CommandKind::resume_at:
            return resume_at(static_cast<std::int64_t>(command.value));
        case CommandKind::save_surface:
            if (bodies_.empty()) return;
            for (std::size_t k = 0; k < bodies_.size(); ++k) {
                std::filesystem::path file = command.name;
                if (k > 0)
                    file.replace_filename(file.stem().string() + "-" + std::to_string(k) +
                                          file.extension().string());
                simulation_->write_surface(bodies_[k], file.string());
            }
            return notify("saved " + command.name);
        case CommandKind::save_pieces:
            return save_pieces(command.name), notify("saved the pieces in " + command.name);
        case CommandKind::save_checkpoint:
            return simulation_->save(command.name), notify("saved " + command.name);
        case CommandKind::save_recording:
            return write_session_recording(command.name, recording()), notify("saved " + command.name);
        case CommandKind::show_field:
            field_ = static_cast<Field>(static_cast<int>(command.value));
            shows_samples_ = command.radius > 0;
            return;
        default:
            return;
    }
}

// Undo goes back to before the stroke, blade and all.
void Engine::begin_stroke(const Command& command) {
    if (strokes_.empty()) simulation_->mark_undo_point();
    strokes_.begin(command, *simulation_);
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
    const std::array<double, 6> values = {preset.youngs_modulus, preset.poisson_ratio,
                                          preset.mass_damping,   preset.stiffness_damping,
                                          preset.density,        preset.cutting_resistance};
    change_materials([&](MaterialSettings& material) {
        for (std::size_t k = 0; k < values.size(); ++k) set_field(material, k, values[k]);
    });
    change_strength(preset.strength);
    for (std::size_t k = 0; k < values.size(); ++k) changed_[k] = values[k];
    changed_[strength] = preset.strength;
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
void Engine::travel(bool back) {
    if (!(back ? simulation_->undo() : simulation_->redo())) {
        notify(back ? "there is nothing to undo" : "there is nothing to redo");
        return;
    }
    forget_gestures();
}

void Engine::forget_gestures() {
    strokes_.clear();
    for (const ToolId tool : simulation_->tools())
        if (!driver_ || !driver_->owns(tool)) simulation_->remove_tool(tool);
    pulls_.after_travel(*simulation_);
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
        strokes_.before_step(*simulation_);
        pulls_.before_step(*simulation_);
        const StepResult result = simulation_->step();
        strokes_.after_step(*simulation_);
        pulls_.take_forces(result);
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
        notify(std::string(error.what()) + "; the scene starts again");
        start();
        return;
    }
    ++step_;
    statistics_.step_ms = 1e3 * watch.lap();
    if (strokes_.empty() && pulls_.is_idle()) keep_state();
    if (played_.steps > 0 && step_ == played_.steps)
        notify(state_hash() == played_.state_hash ? "the recording has ended in the state that was recorded"
                                                  : "the recording has ended in another state");
}

void Engine::keep_state() {
    const auto every =
        std::max<std::int64_t>(1, std::llround(settings_.keep_every / simulation_->time_step()));
    if (!kept_.empty() && step_ < kept_.back().step + every) return;
    kept_.push_back({step_, simulation_->keep(), pulls_});
    std::uint64_t bytes = 0;
    for (const Kept& kept : kept_) bytes += kept.state.bytes();
    while (kept_.size() > 1 && bytes > settings_.timeline_bytes) {
        bytes -= kept_.front().state.bytes();
        kept_.pop_front();
    }
}

std::vector<std::int64_t> Engine::kept_steps() const {
    std::vector<std::int64_t> out;
    for (const Kept& kept : kept_) out.push_back(kept.step);
    return out;
}

// Repeats what was done since the nearest kept state. Undo needs a history that is not there any more, so it
// is where the repetition stops.
void Engine::resume_at(std::int64_t step) {
    while (kept_.size() > 1 && kept_.back().step > step) kept_.pop_back();
    const Kept& from = kept_.back();
    simulation_->restore(from.state);
    simulation_->forget_history();
    strokes_.clear();
    pulls_ = from.pulls;
    step_ = from.step;
    std::vector<RecordedCommand> again;
    for (const RecordedCommand& one : recorded_)
        if (one.step >= step_) again.push_back(one);
    std::erase_if(recorded_, [&](const RecordedCommand& one) { return one.step >= from.step; });
    script_.clear();
    played_ = {};
    std::size_t next = 0;
    while (step_ < step) {
        for (; next < again.size() && again[next].step == step_; ++next) {
            if (again[next].command.kind == CommandKind::undo ||
                again[next].command.kind == CommandKind::redo) {
                notify("goes on from before the undo");
                return;
            }
            apply(again[next].command);
        }
        this->step();
    }
    forget_gestures();
}

Recording Engine::recording() const {
    return {source_->file, initial_, step_, state_hash(), recorded_};
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

std::shared_ptr<const SurfaceTopology> Engine::take_topology(BodyRecord& record, const SurfaceView& surface) {
    if (record.topology && record.topology->revision == surface.revision) return record.topology;
    const bool follows = record.topology && surface.revision == record.topology->revision + 1;
    if (!follows) record.changes.clear();
    if (follows) {
        record.changes.push_back({surface.revision,
                                  {surface.changed_vertices.begin(), surface.changed_vertices.end()},
                                  {surface.changed_triangles.begin(), surface.changed_triangles.end()}});
        if (record.changes.size() > max_changes) record.changes.pop_front();
    }
    auto out = std::make_shared<SurfaceTopology>();
    out->triangles.assign(surface.triangles.begin(), surface.triangles.end());
    out->origins.assign(surface.origins.begin(), surface.origins.end());
    out->materials.assign(surface.triangle_material.begin(), surface.triangle_material.end());
    out->pieces.assign(surface.pieces.begin(), surface.pieces.end());
    out->rest.assign(surface.rest_positions.begin(), surface.rest_positions.end());
    out->rest_and_depth = record.looks->rest_and_depth(surface, !follows);
    out->revision = surface.revision;
    out->changes.assign(record.changes.begin(), record.changes.end());
    record.topology = out;
    return out;
}

std::size_t Engine::pieces_of(const std::string& body) const {
    for (std::size_t k = 0; k < std::min(bodies_.size(), source_->bodies.size()); ++k)
        if (source_->bodies[k].settings.name == body) return simulation_->piece_count(bodies_[k]);
    return 0;
}

BodyState Engine::body_state(std::size_t index) {
    const BodyId body = bodies_[index];
    const SurfaceView surface = simulation_->surface(body);
    BodyState out;
    out.id = body;
    if (!records_[index].palette)
        records_[index].looks =
            std::make_shared<BodyLooks>(*source_, index, simulation_->material_names(body));
    out.topology = take_topology(records_[index], surface);
    out.positions.assign(surface.positions.begin(), surface.positions.end());
    out.normals.assign(surface.normals.begin(), surface.normals.end());
    if (!records_[index].palette)
        records_[index].palette = std::make_shared<const std::vector<Vec3>>(palette_of(
            simulation_->material_names(body), index < source_->bodies.size()
                                                   ? source_->bodies[index].model.attributes.materials
                                                   : std::vector<geometry::Material>()));
    out.palette = records_[index].palette;
    out.finishes = records_[index].looks->finishes();
    out.marks = records_[index].looks->marks(surface, simulation_->time(),
                                             [&](const std::string& name) { return pieces_of(name); });
    out.pieces = simulation_->piece_count(body);
    if (index < source_->bodies.size()) out.name = source_->bodies[index].settings.name;
    find_bounds(out);
    if (field_ == Field::none && !shows_samples_) return out;
    const SampleState samples = simulation_->samples(body);
    if (field_ != Field::none) out.field = records_[index].field.at_vertices(surface, samples, field_);
    if (!shows_samples_) return out;
    for (const Vector3& p : samples.positions)
        for (const double v : {p.x, p.y, p.z}) out.sample_positions.push_back(static_cast<float>(v));
    out.sample_field = SampleField::values(samples, field_);
    return out;
}

std::shared_ptr<PublishedState> Engine::publish() {
    auto out = std::make_shared<PublishedState>();
    out->number = ++published_;
    out->step = step_;
    out->time = simulation_->time();
    for (std::size_t b = 0; b < bodies_.size(); ++b) out->bodies.push_back(body_state(b));
    if (driver_) driver_->append_blades(out->time, out->blades);
    if (driver_) driver_->append_colliders(out->time, out->colliders);
    if (driver_) driver_->append_instruments(out->time, out->instruments);
    if (driver_) driver_->append_rods(out->time, *simulation_, out->bodies, out->rods);
    if (source_->description.ground) out->ground = source_->description.ground->height;
    out->camera = source_->description.camera;
    strokes_.append_blades(out->blades);
    pulls_.append_states(*simulation_, out->pulls);
    out->statistics = statistics_;
    out->undo_count = simulation_->undo_count();
    out->redo_count = simulation_->redo_count();
    out->title = source_->description.name;
    out->notice = notice_;
    out->notices = notices_;
    for (std::size_t k = 0; k < parameter_count; ++k) out->parameters.push_back(parameter_value(k));
    return out;
}

}  // namespace splitcubes::view
