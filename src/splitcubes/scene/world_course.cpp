#include <splitcubes/body/body.h>
#include <splitcubes/scene/world_course.h>
#include <splitcubes/world/world.h>

#include <string>

namespace splitcubes::scene {

namespace {

// Bodies number their own constraints and handles in the order of the scene.
template <class Description>
std::vector<std::pair<std::size_t, std::size_t>> numbers_in_bodies(const SceneDescription& scene,
                                                                   const std::vector<Description>& things) {
    std::vector<std::pair<std::size_t, std::size_t>> out;
    std::vector<std::size_t> counts(scene.bodies.size());
    for (const Description& one : things) {
        std::size_t body = 0;
        while (scene.bodies[body].name != one.body) ++body;
        out.emplace_back(body, counts[body]++);
    }
    return out;
}

}  // namespace

WorldCourse::WorldCourse(const SceneDescription& scene, body::World& world)
    : scene_(scene),
      course_(std::make_shared<Course>(scene, samples_of(world))),
      constraints_(numbers_in_bodies(scene, scene.constraints)),
      handles_(numbers_in_bodies(scene, scene.handles)) {
    take_motions(world);
}

// Phyxels are only appended.
std::vector<BodySamples> WorldCourse::samples_of(const body::World& world) {
    at_start_.resize(world.bodies().size());
    std::vector<BodySamples> out;
    for (std::size_t b = 0; b < at_start_.size(); ++b) {
        const body::Body& body = *world.bodies()[b];
        const meshless::Phyxels& phyxels = body.phyxels();
        for (std::size_t i = at_start_[b].size(); i < phyxels.size(); ++i)
            at_start_[b].push_back(body.pose() * phyxels.rest_position[i]);
        out.push_back({at_start_[b], phyxels.position, phyxels.velocity, phyxels.mass, phyxels.piece,
                       body.pieces().count()});
    }
    return out;
}

// The world has the ground first, then the scene's colliders, then its solid tools.
void WorldCourse::take_motions(body::World& world) {
    const std::shared_ptr<const Course> course = course_;
    for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
        if (!course->decides_tool(k)) continue;
        SampledMotion path;
        path.add(world.time(), course->tool_frame(k, world.time()));
        world.set_tool_path(k, path);
    }
    std::size_t collider = scene_.ground ? 1 : 0;
    for (std::size_t k = 0; k < scene_.colliders.size(); ++k, ++collider)
        if (course->decides_collider(k))
            world.set_collider_motion(collider,
                                      [course, k](double t) { return course->collider_frame(k, t); });
    for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
        if (!scene_.tools[k].solid) continue;
        if (course->decides_tool(k))
            world.set_collider_motion(collider, [course, k](double t) { return course->tool_frame(k, t); });
        ++collider;
    }
    for (std::size_t k = 0; k < constraints_.size(); ++k)
        if (course->decides_constraint(k))
            world.bodies()[constraints_[k].first]->set_constraint_motion(
                constraints_[k].second, [course, k](double t) { return course->constraint_motion(k, t); });
    for (std::size_t k = 0; k < handles_.size(); ++k)
        if (course->decides_handle(k))
            world.bodies()[handles_[k].first]->set_handle_motion(
                handles_[k].second, [course, k](double t) { return course->handle_motion(k, t); });
    set_activity(world);
}

void WorldCourse::advance(body::World& world) {
    if (!course_->depends_on_state()) return;
    const double from = world.time(), step = world.settings().time_step;
    course_->advance(from, step, samples_of(world));
    if (moves_) move_tools(world, from, from + step);
    set_activity(world);
}

void WorldCourse::move_tools(body::World& world, double from, double to) const {
    for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
        if (!course_->decides_tool(k)) continue;
        for (const double time : course_->tool_times(k, from, to))
            world.move_tool(k, time, course_->tool_frame(k, time));
    }
}

void WorldCourse::set_activity(body::World& world) const {
    for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
        const auto [from, until] = course_->tool_activity(k);
        if (course_->decides_tool(k)) world.set_tool_active(k, from, until);
    }
    for (std::size_t k = 0; k < constraints_.size(); ++k) {
        const auto [from, until] = course_->constraint_activity(k);
        if (course_->decides_constraint(k))
            world.bodies()[constraints_[k].first]->set_constraint_active(constraints_[k].second, from, until);
    }
    for (std::size_t k = 0; k < handles_.size(); ++k) {
        const auto [from, until] = course_->handle_activity(k);
        if (course_->decides_handle(k))
            world.bodies()[handles_[k].first]->set_handle_active(handles_[k].second, from, until);
    }
}

// Paths follow from the course: they are sampled again at the times of the steps that were taken.
void WorldCourse::load(StateReader& reader, body::World& world) {
    course_->load(reader);
    const double start = world.settings().start_time, step = world.settings().time_step;
    for (std::int64_t k = 0; moves_ && k < world.step_count(); ++k) {
        const double from = start + static_cast<double>(k) * step;
        move_tools(world, from, from + step);
    }
    set_activity(world);
}

}  // namespace splitcubes::scene
