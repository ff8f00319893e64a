#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/played_scene.h>
#include <splitcubes/scene/tuning.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace splitcubes::scene {

namespace {

class Player {
  public:
    Player(const SceneDescription& scene, const Course& course, std::int64_t first, std::int64_t last)
        : scene_(scene), course_(course), first_(first), last_(last) {
        std::int64_t movers = 0;
        for (std::size_t k = 0; k < scene.tools.size(); ++k) movers += course.decides_tool(k);
        for (std::size_t k = 0; k < scene.colliders.size(); ++k) movers += course.decides_collider(k);
        for (std::size_t k = 0; k < scene.constraints.size(); ++k) movers += course.decides_constraint(k);
        for (std::size_t k = 0; k < scene.handles.size(); ++k) movers += course.decides_handle(k);
        stride_ =
            std::max<std::int64_t>(1, (last - first) * movers / tuning::course::max_played_keyframes + 1);
    }

    SceneDescription scene() const {
        SceneDescription out = scene_;
        out.tools.clear();
        out.constraints.clear();
        out.handles.clear();
        for (std::size_t k = 0; k < scene_.tools.size(); ++k) add_tool(k, out);
        for (std::size_t k = 0; k < scene_.colliders.size(); ++k)
            if (course_.decides_collider(k)) play_collider(k, out.colliders[k]);
        for (std::size_t k = 0; k < scene_.constraints.size(); ++k) {
            ConstraintDescription one = scene_.constraints[k];
            const auto motion = [&](double t) { return course_.constraint_motion(k, t); };
            if (course_.decides_constraint(k) && !play(one, course_.constraint_activity(k), motion)) continue;
            if (course_.decides_constraint(k)) {
                one.kind = ConstraintKind::move;
                one.relative_to.reset();
            }
            out.constraints.push_back(std::move(one));
        }
        for (std::size_t k = 0; k < scene_.handles.size(); ++k) {
            HandleDescription one = scene_.handles[k];
            const auto motion = [&](double t) { return course_.handle_motion(k, t); };
            if (course_.decides_handle(k) && !play(one, course_.handle_activity(k), motion)) continue;
            if (course_.decides_handle(k)) one.relative_to.reset();
            out.handles.push_back(std::move(one));
        }
        return out;
    }

  private:
    double time_of(std::int64_t step) const { return static_cast<double>(step) * scene_.time_step; }

    // At the steps that are in an interval; without the inner ones of runs of equal poses.
    template <class MotionAt>
    std::vector<MotionKeyframe> keyframes(const Course::Interval& within, const MotionAt& motion) const {
        std::vector<std::pair<double, Isometry>> poses;
        for (std::int64_t step = first_; step <= last_;
             step += std::min(stride_, std::max<std::int64_t>(1, last_ - step)))
            if (time_of(step) >= within.first && time_of(step) <= within.second)
                poses.emplace_back(time_of(step), motion(time_of(step)));
        std::vector<MotionKeyframe> out;
        for (std::size_t k = 0; k < poses.size(); ++k) {
            const Isometry& pose = poses[k].second;
            const bool inner = k > 0 && k + 1 < poses.size();
            if (inner && poses[k - 1].second.matrix() == pose.matrix() &&
                poses[k + 1].second.matrix() == pose.matrix())
                continue;
            out.push_back({poses[k].first, pose.translation(), rotation_of(Quat(pose.linear()))});
        }
        return out;
    }

    void add_tool(std::size_t k, SceneDescription& out) const {
        ToolDescription tool = scene_.tools[k];
        if (!course_.decides_tool(k)) return out.tools.push_back(std::move(tool));
        KeyframeMotion path;
        const auto [shown_from, shown_until] = course_.tool_shown(k);
        path.keyframes =
            keyframes({shown_from, shown_until}, [&](double t) { return course_.tool_frame(k, t); });
        if (path.keyframes.empty()) return;
        tool.shown_from = std::max(shown_from, 0.0);
        tool.shown_until = std::min(shown_until, time_of(last_) + scene_.time_step);
        const auto [from, until] = course_.tool_activity(k);
        // One that is active later is never active in this time.
        const double end = time_of(last_), later = end + scene_.time_step;
        tool.active_from = from > end ? later : std::max(from, 0.0);
        tool.active_until = from > end ? later : std::clamp(until, tool.active_from, end);
        tool.motion = std::move(path);
        tool.relative_to.reset();
        tool.start_when.reset();
        tool.end_when.reset();
        out.tools.push_back(std::move(tool));
    }

    // Displacements from where it is placed.
    void play_collider(std::size_t k, ColliderDescription& out) const {
        out.keyframes = keyframes({-Course::never, Course::never},
                                  [&](double t) { return Isometry(course_.collider_displacement(k, t)); });
        out.pivot.setZero();
        out.relative_to.reset();
        out.start_when.reset();
        out.end_when.reset();
    }

    template <class Description, class MotionAt>
    bool play(Description& one, const Course::Interval& activity, const MotionAt& motion) const {
        if (activity.first > time_of(last_) || !(activity.second > activity.first)) return false;
        one.keyframes = keyframes(activity, motion);
        if (one.keyframes.empty()) return false;
        one.pivot.setZero();
        one.from_time = std::max(0.0, activity.first);
        one.until_time.reset();
        if (activity.second <= time_of(last_)) one.until_time = activity.second;
        one.start_when.reset();
        one.release_when.reset();
        return !one.until_time || *one.until_time > one.from_time;
    }

    const SceneDescription& scene_;
    const Course& course_;
    std::int64_t first_, last_, stride_ = 1;
};

}  // namespace

SceneDescription played_scene(const SceneDescription& scene, const Course& course, std::int64_t first,
                              std::int64_t last) {
    return Player(scene, course, first, last).scene();
}

}  // namespace splitcubes::scene
