#include "recorded_scene.h"

#include <splitcubes/scene/build.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/motion.h>

#include <fstream>
#include <map>
#include <string>

namespace splitcubes::view {

namespace {

std::vector<scene::MotionKeyframe> keyframes_of(const SampledMotion& motion, const Isometry& own) {
    std::vector<scene::MotionKeyframe> out;
    for (std::size_t k = 0; k < motion.times().size(); ++k) {
        const Isometry pose = motion.frames()[k] * own.inverse();
        out.push_back({motion.times()[k], pose.translation(), scene::rotation_of(Quat(pose.linear()))});
    }
    return out;
}

// The instrument is to be seen when it was.
void move(scene::ToolDescription& tool, const SampledMotion& motion) {
    const auto [from, until] = scene::shown_times(tool);
    tool.shown_from = std::max(from, 0.0);
    tool.shown_until = std::max(until, *tool.shown_from);
    tool.motion = scene::KeyframeMotion{keyframes_of(motion, Isometry::Identity())};
}

template <class Region>
void move_region(Region& region, const SampledMotion& motion) {
    region.keyframes = keyframes_of(motion, Isometry::Identity());
    region.pivot.setZero();
    region.relative_to.reset();
}

bool depends_on_state(const scene::SceneDescription& scene, const std::optional<scene::Carrier>& carrier) {
    return carrier && !scene::prescribed_motion(*carrier, scene.colliders, scene.tools);
}

}  // namespace

bool is_run_recording(const std::filesystem::path& file) {
    constexpr std::size_t looked_at = 200;  // bytes
    std::string text(looked_at, ' ');
    std::ifstream in(file, std::ios::binary);
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    return text.find("\"splitcubes recording ") != std::string::npos;
}

scene::SceneDescription scene_of_recording(const scene::Recording& recording) {
    const scene::SceneDescription& scene = recording.scene;
    std::map<std::pair<body::Driven, std::string>, const SampledMotion*> tracks;
    for (const body::MotionTrack& track : recording.tracks)
        if (!track.motion.empty()) tracks[{track.driven, track.name}] = &track.motion;
    const auto motion_of = [&](body::Driven driven, const std::string& name) {
        const auto found = tracks.find({driven, name});
        return found == tracks.end() ? nullptr : found->second;
    };
    scene::SceneDescription out = scene;
    for (scene::ToolDescription& tool : out.tools)
        if (const auto* motion = motion_of(body::Driven::tool, tool.name);
            motion != nullptr && scene::is_prescribed(tool))
            move(tool, *motion);
    for (scene::ColliderDescription& one : out.colliders) {
        const auto* motion = motion_of(body::Driven::collider, one.name);
        if (motion == nullptr || !scene::is_prescribed(one)) continue;
        one.keyframes = keyframes_of(*motion, scene::pose_of(one.placement));
        one.pivot.setZero();
    }
    for (scene::HandleDescription& one : out.handles)
        if (const auto* motion = motion_of(body::Driven::handle, one.name);
            motion != nullptr && !one.start_when && !depends_on_state(scene, one.relative_to))
            move_region(one, *motion);
    std::map<std::string, std::size_t> counts;
    for (scene::ConstraintDescription& one : out.constraints) {
        const std::string name = one.body + '/' + std::to_string(counts[one.body]++);
        const auto* motion = motion_of(body::Driven::constraint, name);
        if (motion == nullptr || one.start_when || depends_on_state(scene, one.relative_to)) continue;
        one.kind = scene::ConstraintKind::move;
        move_region(one, *motion);
    }
    return out;
}

}  // namespace splitcubes::view
