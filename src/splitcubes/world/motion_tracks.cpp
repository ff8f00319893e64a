#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/world/motion_tracks.h>

#include <algorithm>
#include <memory>
#include <set>

namespace splitcubes::body {

namespace {

// Times, s, of a step, computed exactly as in World::step.
struct StepTimes {
    double begin, end;         // of the step
    double swept_from, swept;  // of the interval that tools cut; equal for the first step
};

StepTimes step_times(std::int64_t step, double dt) {
    const double begin = static_cast<double>(step) * dt;
    return {begin, begin + dt, static_cast<double>(std::max<std::int64_t>(step - 1, 0)) * dt, begin};
}

SampledMotion sampled(const std::set<double>& times, const std::function<Isometry(double)>& motion) {
    SampledMotion out;
    for (const double time : times) out.add(time, motion(time));
    return out;
}

// Removes the inner samples of runs of equal ones.
SampledMotion thinned(const SampledMotion& motion) {
    const auto& frames = motion.frames();
    SampledMotion out;
    for (std::size_t k = 0; k < frames.size(); ++k)
        if (k == 0 || k + 1 == frames.size() || frames[k].matrix() != frames[k - 1].matrix() ||
            frames[k].matrix() != frames[k + 1].matrix())
            out.add(motion.times()[k], frames[k]);
    return out;
}

std::string constraint_name(const Body& body, std::size_t index) {
    return body.name() + '/' + std::to_string(index);
}

}  // namespace

std::vector<MotionTrack> motion_tracks(const World& world, std::int64_t steps) {
    const double dt = world.settings().time_step;
    std::set<double> ends;
    for (std::int64_t k = 0; k < steps; ++k) {
        const StepTimes at = step_times(k, dt);
        ends.insert({at.begin, at.end});
    }
    std::vector<MotionTrack> out;
    for (const Tool& tool : world.tools()) {
        std::set<double> times = {0};
        for (std::int64_t k = 0; k < steps; ++k) {
            const StepTimes at = step_times(k, dt);
            times.insert({at.swept_from, at.swept});
            const std::vector<double> swept = cutting::sweep_times(tool.blade, at.swept_from, at.swept);
            times.insert(swept.begin(), swept.end());
        }
        // Tracks of tools are never thinned: each sample ends a part of a sweep.
        out.push_back({Driven::tool, tool.blade.name(),
                       sampled(times, [&](double time) { return tool.blade.frame(time); })});
    }
    const auto add = [&](Driven driven, const std::string& name, const auto& motion) {
        out.push_back({driven, name, thinned(sampled(ends, motion))});
    };
    for (const auto& body : world.bodies()) {
        for (std::size_t k = 0; k < body->constraints().size(); ++k)
            add(Driven::constraint, constraint_name(*body, k), body->constraints()[k].motion);
        for (const Handle& handle : body->handles()) add(Driven::handle, handle.name, handle.motion);
    }
    for (const Collider& collider : world.colliders())
        if (collider.motion) add(Driven::collider, collider.name, collider.motion);
    return out;
}

void follow_tracks(World& world, const std::vector<MotionTrack>& tracks) {
    for (const MotionTrack& track : tracks) {
        bool fits = false;
        const auto matches = [&](Driven driven, const std::string& name) {
            const bool same = track.driven == driven && track.name == name;
            fits = fits || same;
            return same;
        };
        const auto motion = std::make_shared<const SampledMotion>(track.motion);
        for (std::size_t k = 0; k < world.tools().size(); ++k)
            if (matches(Driven::tool, world.tools()[k].blade.name())) world.set_tool_path(k, *motion);
        const auto at = [motion](double time) { return motion->at(time); };
        for (const auto& body : world.bodies()) {
            for (std::size_t k = 0; k < body->constraints().size(); ++k)
                if (matches(Driven::constraint, constraint_name(*body, k)))
                    body->set_constraint_motion(k, at);
            for (std::size_t k = 0; k < body->handles().size(); ++k)
                if (matches(Driven::handle, body->handles()[k].name)) body->set_handle_motion(k, at);
        }
        for (std::size_t k = 0; k < world.colliders().size(); ++k)
            if (matches(Driven::collider, world.colliders()[k].name)) world.set_collider_motion(k, at);
        if (!fits)
            throw InputError("track '" + track.name + "'",
                             "there is nothing of this name that it could drive",
                             "name a tool, a handle, a collider, or a constraint as body/number");
    }
}

}  // namespace splitcubes::body
