#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider_overlaps.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/restitution.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/math/state_numbers.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/world/island_step.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <limits>

namespace splitcubes::body {

namespace {

bool has_fragments(std::span<const BodyView> views) {
    return std::any_of(views.begin(), views.end(),
                       [](const BodyView& view) { return !view.phyxels.rigid.empty(); });
}

}  // namespace

World::World(const WorldSettings& settings, std::shared_ptr<const Parallel> parallel)
    : settings_(settings),
      parallel_(std::move(parallel)),
      contact_finder_(std::make_unique<ContactFinder>()),
      rigid_contacts_(std::make_unique<RigidContacts>()),
      collider_overlaps_(std::make_unique<ColliderOverlaps>()),
      restitution_(std::make_unique<Restitution>()),
      island_step_(std::make_unique<IslandStep>()) {
    if (!(settings.time_step > 0)) throw InputError("time step", "must be positive");
    if (settings.ground)
        colliders_.push_back({"ground",
                              geometry::make_plane_distance(settings.ground->normal, settings.ground->offset),
                              {},
                              settings.ground->friction});
}

World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

std::span<const TopologyChange> World::topology_changes() const {
    return topology_changes_;
}

Body& World::add_body(const geometry::TriangleMesh& mesh, const BodySettings& settings) {
    bodies_.push_back(std::make_unique<Body>(mesh, settings, *parallel_));
    return *bodies_.back();
}

void World::add_tool(cutting::Blade blade, std::vector<std::size_t> bodies, const BladeSides& sides) {
    tools_.push_back({std::move(blade), sides, std::move(bodies), {}, next_cut_number_++});
}

// Returns the colliders with their frames at the start and the end of the step.
std::vector<meshless::Obstacle> World::obstacles_now() const {
    std::vector<meshless::Obstacle> out;
    for (const Collider& collider : colliders_)
        out.push_back({collider.solid.get(), collider.at(time()), collider.at(time() + settings_.time_step),
                       collider.friction});
    return out;
}

void World::set_tool_path(std::size_t tool, const SampledMotion& path) {
    cutting::Blade& blade = tools_[tool].blade;
    cutting::BladeOptions options;
    options.active_from = blade.active_from();
    options.active_until = blade.active_until();
    blade = cutting::Blade(blade.name(), blade.shape(), path, options);
}

StepReport World::step() {
    const std::vector<meshless::Obstacle> obstacles = obstacles_now();
    const StepContext context{
        time(),    settings_.time_step, settings_.gravity, settings_.ground,
        obstacles, settings_.solver,    *parallel_,        settings_.contact.pieces || !colliders_.empty()};
    for (auto& body : bodies_) body->draw_as_moved(context);
    StepReport report;
    Stopwatch watch;
    const auto done = [&](Stage stage) { report.stage_seconds(stage) += watch.lap(); };

    std::vector<std::vector<cutting::SweptBlade>> swept(tools_.size());
    if (step_count_ > 0)
        for (std::size_t k = 0; k < tools_.size(); ++k)
            swept[k] = cutting::sweep(tools_[k].blade, step_start(step_count_ - 1), time());
    done(Stage::move_tools);

    report.tools.resize(tools_.size());
    topology_changes_.resize(bodies_.size());
    for (TopologyChange& change : topology_changes_) change.clear();
    const auto each_body = [&](const auto& stage) {
        for (std::size_t b = 0; b < bodies_.size(); ++b) stage(*bodies_[b], topology_changes_[b]);
    };
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        for (std::size_t k = 0; k < tools_.size(); ++k) {
            Tool& tool = tools_[k];
            tool.last_normal.resize(bodies_.size(), Vec3::Zero());
            const bool cuts_it = tool.bodies.empty() ||
                                 std::find(tool.bodies.begin(), tool.bodies.end(), b) != tool.bodies.end();
            if (cuts_it && !swept[k].empty())
                bodies_[b]->cut_edges(swept[k], tool.cut_number, tool.last_normal[b], context,
                                      topology_changes_[b], report,
                                      tool.blade.frame(time() - settings_.time_step),
                                      tool.blade.frame(time()), report.tools[k]);
        }
    done(Stage::cut_edges);
    each_body([&](Body& body, TopologyChange& change) { body.tear(context, change, report); });
    done(Stage::tear);

    each_body(
        [&](Body& body, TopologyChange& change) { body.retessellate(context.parallel, change, report); });
    done(Stage::retessellate);
    each_body([&](Body& body, TopologyChange& change) { body.label_pieces(change); });
    done(Stage::label_pieces);
    each_body([&](Body& body, TopologyChange& change) { body.update_visibility(context, change, report); });
    done(Stage::update_visibility);
    each_body([&](Body& body, TopologyChange& change) { body.resample(context, change, report); });
    done(Stage::resample);
    each_body([&](Body& body, TopologyChange& change) { body.rebuild_neighbourhoods(context, change); });
    done(Stage::rebuild_neighbourhoods);
    std::vector<BodyView> views = views_of(bodies_);
    contact_finder_->find(
        {views, colliders_, settings_.contact, time(), settings_.time_step, settings_.gravity}, *parallel_,
        contact_islands_);
    const auto rigid = [&]() -> RigidContacts::Task {
        return {views, obstacles, settings_.contact.friction, settings_.time_step, settings_.gravity};
    };
    if (settings_.contact.pieces)
        rigid_contacts_->find(rigid(), *contact_finder_, contact_islands_, *parallel_);
    done(Stage::detect_contacts);
    begin_hits(views);
    begin_overlaps(context, report);
    integrate(context, report);
    if (settings_.contact.pieces) {
        views = views_of(bodies_);  // with what constraints hold in this step
        // Fragments take energy that no hit of elastic pieces lost.
        if (settings_.contact.restitution && has_fragments(views)) restitution_->measure(hit_task(views));
        const RigidContacts::Outcome pushed = rigid_contacts_->push(rigid(), *parallel_);
        report.totals.kinetic_energy += pushed.kinetic_energy;
        report.totals.momentum += pushed.momentum;
        report.totals.angular_momentum += pushed.angular_momentum;
        report.counts.contacts += pushed.contacts;
        report.work.holds += pushed.hold_work;
    }
    done(Stage::integrate);
    for (auto& body : bodies_) body->update_node_frames(context, report);
    done(Stage::update_node_frames);
    for (auto& body : bodies_) body->move_surface(context);
    undo_overlaps(context, report);
    finish_hits(report);
    for (auto& body : bodies_) body->finish_surface(context, report);
    done(Stage::update_surface);

    for (std::size_t k = 0; k < tools_.size(); ++k) accumulate_side_friction(tools_[k], report.tools[k]);

    ++step_count_;
    report.time = time();
    if (settings_.validate_each_step)
        for (const auto& body : bodies_)
            for (const std::string& line : body->validate())
                throw JobError("body '" + body->name() + "' after step " + std::to_string(step_count_) +
                               ": " + line);
    return report;
}

// Moves surfaces that a cut changed, so that what it moved is not taken for motion of the step.
void World::begin_overlaps(const StepContext& context, StepReport& report) {
    if (colliders_.empty()) return;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        if (topology_changes_[b].cells.empty()) continue;
        bodies_[b]->update_node_frames(context, report);
        bodies_[b]->move_surface(context);
    }
    const std::vector<BodyView> views = views_of(bodies_);
    collider_overlaps_->begin({views, colliders_, time(), settings_.time_step}, context.parallel);
}

// Lifts pieces out of colliders and moves their surfaces along.
void World::undo_overlaps(const StepContext& context, StepReport& report) {
    const std::vector<BodyView> views = views_of(bodies_);
    const ColliderOverlaps::Task task{views, colliders_, time(), settings_.time_step};
    const ColliderOverlaps::Outcome lifted = collider_overlaps_->undo(task, context.parallel);
    report.totals.kinetic_energy += lifted.kinetic_energy;
    report.totals.momentum += lifted.momentum;
    report.totals.angular_momentum += lifted.angular_momentum;
    report.counts.contacts += lifted.pieces;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        if (!collider_overlaps_->moved(b)) continue;
        bodies_[b]->update_node_frames(context, report);
        bodies_[b]->move_surface(context);
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        if (collider_overlaps_->found_deep(b)) draw_on_colliders(b, time());
}

// Draws vertices of a body where colliders allow it. start: s, of the step at whose end the surface is.
void World::draw_on_colliders(std::size_t body, double start) {
    const std::vector<BodyView> views = views_of(bodies_);
    const ColliderOverlaps::Task task{views, colliders_, start, settings_.time_step};
    for (const ColliderOverlaps::Drawn& drawn : collider_overlaps_->drawn(task, body, *parallel_))
        bodies_[body]->draw_vertex(drawn.vertex, drawn.position);
}

geometry::SurfaceMesh World::surface_mesh() const {
    geometry::SurfaceMesh all;
    std::int32_t first_piece = 0;
    for (const auto& body : bodies_) {
        geometry::SurfaceMesh one = body->surface_mesh();
        for (std::int32_t& piece : one.vertex_piece) piece += first_piece;
        first_piece += static_cast<std::int32_t>(body->pieces().count());
        all.append(one);
    }
    return all;
}

void World::save(StateWriter& writer) const {
    writer.add(step_count_);
    writer.add(std::uint64_t{cached_contacts_.size()});
    for (const meshless::CachedContact& cached : cached_contacts_) {
        writer.add(cached.key);
        for (const Vec3* vector : {&cached.tangential_displacement, &cached.force})
            write_numbers(writer, *vector);
        for (const double number : {cached.normal_force, cached.stiffness, cached.rest_gap, cached.gap,
                                    cached.drift, cached.energy})
            writer.add(number);
    }
    restitution_->save(writer);
    for (const Tool& tool : tools_) {
        writer.add(std::uint64_t{tool.last_normal.size()});
        writer.add(numbers_of(tool.last_normal));
    }
    for (const auto& body : bodies_) body->save(writer);
}

void World::load(StateReader& reader) {
    step_count_ =
        reader.number<std::int64_t>(0, std::numeric_limits<std::int32_t>::max(), "an invalid step count");
    cached_contacts_.assign(reader.count(sizeof(meshless::CachedContact)), {});
    for (meshless::CachedContact& cached : cached_contacts_) {
        cached.key = reader.number<std::uint64_t>();
        for (Vec3* vector : {&cached.tangential_displacement, &cached.force})
            read_numbers(reader, *vector, "a contact with an invalid force");
        for (double* number : {&cached.normal_force, &cached.stiffness, &cached.rest_gap, &cached.gap,
                               &cached.drift, &cached.energy})
            *number = reader.number<double>(-largest_state_number, largest_state_number,
                                            "a contact with an invalid force");
        require_state(cached.normal_force >= 0 && cached.stiffness >= 0 && cached.rest_gap <= cached.drift &&
                          cached.drift <= 0,
                      "a contact with a negative normal force");
    }
    const auto by_key = [](const meshless::CachedContact& a, const meshless::CachedContact& b) {
        return a.key >= b.key;
    };
    require_state(std::adjacent_find(cached_contacts_.begin(), cached_contacts_.end(), by_key) ==
                      cached_contacts_.end(),
                  "contacts out of order");
    restitution_->load(reader);
    for (Tool& tool : tools_) {
        const std::size_t count = reader.count(sizeof(Vec3));
        require_state(count == 0 || count == bodies_.size(), "a tool with a wrong number of bodies");
        read_numbers(reader, count, tool.last_normal, "a tool with an invalid normal");
    }
    for (auto& body : bodies_) body->load(reader, *parallel_);
    for (std::size_t b = 0; step_count_ > 0 && b < bodies_.size(); ++b)
        draw_on_colliders(b, step_start(step_count_ - 1));
    for (const auto& body : bodies_)
        require_state(body->step_count() <= step_count_, "a body with more steps than the world");
}

StateHash World::state_hash() const {
    StateHash hash;
    hash.add(step_count_);
    for (const meshless::CachedContact& cached : cached_contacts_) {
        hash.add(cached.key);
        hash.add(std::span<const double>(cached.tangential_displacement.data(), 3));
        hash.add(cached.normal_force);
        hash.add(cached.stiffness);
        hash.add(cached.rest_gap);
        hash.add(cached.gap);
        hash.add(cached.drift);
        hash.add(cached.energy);
        hash.add(std::span<const double>(cached.force.data(), 3));
    }
    restitution_->add_to_hash(hash);
    for (const auto& body : bodies_) body->add_to_hash(hash);
    return hash;
}

}  // namespace splitcubes::body
