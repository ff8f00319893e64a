#include "stroke_log.h"

#include "scene_source.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <Eigen/SVD>

#include <nlohmann/json.hpp>

namespace splitcubes::view {

namespace {

constexpr std::size_t fitted_points = 2000;     // about, of a surface
constexpr std::size_t exported_samples = 9000;  // of a stroke; path files take a few more

// Between samples blades stood still: what comes later than the step before begins with it.
void append_sample(std::vector<StrokeSample>& samples, const StrokeSample& sample, double step_start) {
    if (samples.back().time < step_start - 1e-9) {
        samples.push_back(samples.back());
        samples.back().time = step_start;
    }
    if (sample.time > samples.back().time) samples.push_back(sample);
}

template <class Entry>
void undo(std::map<std::size_t, Entry>& done, std::map<std::size_t, Entry>& undone, double time) {
    for (auto it = done.begin(); it != done.end();) {
        if (it->second.begin() < time - 1e-9) {
            it->second.end = std::min(it->second.end, time);
            std::vector<StrokeSample>& samples = it->second.samples;
            while (samples.size() > 1 && samples.back().time > time + 1e-9) samples.pop_back();
            ++it;
        } else {
            undone.insert(done.extract(it++));
        }
    }
}

template <class Entry>
void redo(std::map<std::size_t, Entry>& done, std::map<std::size_t, Entry>& undone, double time) {
    for (auto it = undone.begin(); it != undone.end();)
        if (it->second.begin() < time - 1e-9)
            done.insert(undone.extract(it++));
        else
            ++it;
}

template <class Entry>
std::vector<Entry> values_of(const std::map<std::size_t, Entry>& entries) {
    std::vector<Entry> out;
    for (const auto& [id, entry] : entries) out.push_back(entry);
    return out;
}

scene::Rotation turn_of(const Mat3& matrix) {
    const Eigen::AngleAxisd turn(matrix);
    return {turn.axis(), turn.angle() * 180 / std::numbers::pi};
}

std::vector<StrokeSample> thinned(const std::vector<StrokeSample>& samples) {
    const std::size_t every = samples.size() / exported_samples + 1;
    std::vector<StrokeSample> out;
    for (std::size_t k = 0; k < samples.size(); k += every) out.push_back(samples[k]);
    if (out.back().time < samples.back().time) out.push_back(samples.back());
    return out;
}

/// Maps rest space to the coordinates of a mesh file, as far as it is a motion with one scale.
struct MeshFrame {
    double scale = 1;  // mesh lengths a metre
    Isometry mesh_from_rest = Isometry::Identity();

    explicit MeshFrame(const scene::BodyDescription& body) {
        const scene::PlacementDescription& placement = body.placement;
        const bool has_file = std::holds_alternative<scene::MeshShape>(body.shape);
        if (!has_file || placement.scale != Vec3::Constant(placement.scale.x())) return;
        scale = 1 / placement.scale.x();
        const Mat3 turn = Eigen::AngleAxisd(placement.rotation.angle_degrees * std::numbers::pi / 180,
                                            placement.rotation.axis.normalized())
                              .toRotationMatrix();
        mesh_from_rest.linear() = turn.transpose();
        mesh_from_rest.translation() = -turn.transpose() * placement.position;
    }
    Isometry frame(const Isometry& rest) const {
        Isometry out = mesh_from_rest * rest;
        out.translation() *= scale;
        return out;
    }
};

std::string vector_text(const Vec3& v) {
    return nlohmann::json{v.x(), v.y(), v.z()}.dump();
}

std::string keyframe_text(double time, const Isometry& frame) {
    const scene::Rotation rotation = turn_of(frame.linear());
    return "          {\"time\": " + nlohmann::json(time).dump() +
           ", \"position\": " + vector_text(frame.translation()) +
           ", \"rotation\": {\"axis\": " + vector_text(rotation.axis) +
           ", \"angle_degrees\": " + nlohmann::json(rotation.angle_degrees).dump() + "}}";
}

std::string stroke_text(const LoggedStroke& stroke, const std::string& name, const MeshFrame& mesh) {
    std::string out =
        "    {\n      \"name\": \"" + name + "\",\n      \"blades\": [{\"polyline\": {\"points\": [";
    for (std::size_t k = 0; k < stroke.points.size(); ++k)
        out += (k > 0 ? ", " : "") + vector_text(mesh.scale * stroke.points[k]);
    out += "]}}],\n      \"motion\": {\n        \"path\": {\"keyframes\": [\n";
    const std::vector<StrokeSample> samples = thinned(stroke.samples);
    for (std::size_t k = 0; k < samples.size(); ++k)
        out += keyframe_text(samples[k].time, mesh.frame(samples[k].rest)) +
               (k + 1 < samples.size() ? ",\n" : "\n");
    return out + "        ]}\n      }\n    }";
}

scene::ToolDescription tool_of(const LoggedStroke& stroke, const std::string& name) {
    scene::ToolDescription out;
    out.name = name;
    out.blades = {scene::PolylineBlade{stroke.points}};
    scene::KeyframeMotion motion;
    for (const StrokeSample& sample : thinned(stroke.samples))
        motion.keyframes.push_back({sample.time, sample.world.translation(), turn_of(sample.world.linear())});
    out.active_from = stroke.begin();
    out.active_until = std::max(motion.keyframes.back().time, std::min(stroke.end, 1e6));
    out.motion = std::move(motion);
    return out;
}

// A scene that was exported before has such names already.
template <class Things>
std::string free_name(const std::string& stem, int& number, const Things& things) {
    for (;; ++number) {
        std::string name = stem + "-" + std::to_string(number);
        if (std::none_of(things.begin(), things.end(), [&](const auto& one) { return one.name == name; }))
            return name;
    }
}

scene::HandleDescription handle_of(const LoggedPull& pull, const std::string& name, const std::string& body) {
    scene::HandleDescription out;
    out.name = name;
    out.body = body;
    out.region = scene::SphereRegion{pull.rest, pull.radius};
    out.pivot = pull.rest;
    out.stiffness = pull.stiffness;
    if (pull.limit > 0) out.force_limit = pull.limit;
    out.from_time = pull.begin();
    if (std::isfinite(pull.end)) out.until_time = std::max(pull.end, pull.begin() + 1e-6);
    for (const StrokeSample& sample : thinned(pull.samples))
        out.keyframes.push_back(
            {sample.time, sample.world * pull.rest - pull.rest, turn_of(sample.world.linear())});
    return out;
}

}  // namespace

std::size_t StrokeLog::begin_stroke(LoggedStroke stroke) {
    strokes_[next_] = std::move(stroke);
    return next_++;
}

void StrokeLog::move_stroke(std::size_t id, const StrokeSample& sample, double step_start) {
    if (const auto it = strokes_.find(id); it != strokes_.end())
        append_sample(it->second.samples, sample, step_start);
}

void StrokeLog::end_stroke(std::size_t id, double time) {
    if (const auto it = strokes_.find(id); it != strokes_.end()) it->second.end = time;
}

std::size_t StrokeLog::begin_pull(LoggedPull pull) {
    pulls_[next_] = std::move(pull);
    return next_++;
}

void StrokeLog::move_pull(std::size_t id, const StrokeSample& sample, double step_start) {
    if (const auto it = pulls_.find(id); it != pulls_.end())
        append_sample(it->second.samples, sample, step_start);
}

void StrokeLog::end_pull(std::size_t id, double time) {
    if (const auto it = pulls_.find(id); it != pulls_.end()) it->second.end = time;
}

void StrokeLog::clear() {
    strokes_.clear();
    pulls_.clear();
    forget_undone();
}

void StrokeLog::go_back(double time) {
    undo(strokes_, undone_strokes_, time);
    undo(pulls_, undone_pulls_, time);
}

void StrokeLog::go_forward(double time) {
    redo(strokes_, undone_strokes_, time);
    redo(pulls_, undone_pulls_, time);
}

void StrokeLog::forget_undone() {
    undone_strokes_.clear();
    undone_pulls_.clear();
}

std::vector<LoggedStroke> StrokeLog::strokes() const {
    return values_of(strokes_);
}

std::vector<LoggedPull> StrokeLog::pulls() const {
    return values_of(pulls_);
}

Isometry fitted_motion(const SurfaceView& surface, std::int32_t piece) {
    const std::size_t every = surface.vertex_slots() / fitted_points + 1;
    Vec3 rest_mean = Vec3::Zero(), world_mean = Vec3::Zero();
    Mat3 sums = Mat3::Zero();
    double count = 0;
    const auto at = [](std::span<const float> values, std::size_t v) {
        return Vec3(Eigen::Map<const Vec3f>(values.data() + 3 * v).cast<double>());
    };
    for (std::size_t v = 0; v < surface.vertex_slots(); v += every) {
        if (surface.pieces[v] < 0 || (piece >= 0 && surface.pieces[v] != piece)) continue;
        const Vec3 rest = at(surface.rest_positions, v), world = at(surface.positions, v);
        rest_mean += rest;
        world_mean += world;
        sums += world * rest.transpose();
        ++count;
    }
    if (count < 3) return piece >= 0 ? fitted_motion(surface, -1) : Isometry::Identity();
    rest_mean /= count;
    world_mean /= count;
    sums = sums / count - world_mean * rest_mean.transpose();
    const Eigen::JacobiSVD<Mat3> svd(sums, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 mirror = Mat3::Identity();
    mirror(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    Isometry out = Isometry::Identity();
    out.linear() = svd.matrixU() * mirror * svd.matrixV().transpose();
    out.translation() = world_mean - out.linear() * rest_mean;
    return out.matrix().allFinite() ? out : Isometry::Identity();
}

scene::SceneDescription exported_scene(const SceneSource& source, const StrokeLog& log, std::int64_t steps) {
    if (source.is_checkpoint)
        throw InputError("scene", "a saved state has none", "open the scene or the mesh in place of it");
    scene::SceneDescription out = source.description;
    out.frames = static_cast<int>(std::clamp<std::int64_t>(steps, 1, 1000000));
    int number = 1;
    for (const LoggedStroke& stroke : log.strokes())
        out.tools.push_back(tool_of(stroke, free_name("hand-stroke", number, out.tools)));
    number = 1;
    for (const LoggedPull& pull : log.pulls())
        if (pull.body < out.bodies.size())
            out.handles.push_back(
                handle_of(pull, free_name("hand-pull", number, out.handles), out.bodies[pull.body].name));
    return out;
}

std::vector<std::filesystem::path> write_paths(const std::filesystem::path& file, const SceneSource& source,
                                               const StrokeLog& log) {
    if (source.is_checkpoint)
        throw InputError("path", "a saved state has no mesh", "open the scene or the mesh in place of it");
    std::map<std::size_t, std::string> texts;
    int number = 0;
    for (const LoggedStroke& stroke : log.strokes()) {
        if (stroke.samples.size() < 2 || stroke.body >= source.description.bodies.size()) continue;
        std::string& text = texts[stroke.body];
        text += (text.empty() ? "" : ",\n") + stroke_text(stroke, "stroke-" + std::to_string(++number),
                                                          MeshFrame(source.description.bodies[stroke.body]));
    }
    if (texts.empty()) throw InputError("path", "there is no stroke yet", "cut something first");
    std::vector<std::filesystem::path> out;
    for (const auto& [body, text] : texts) {
        std::filesystem::path name = file;
        if (!out.empty())
            name.replace_filename(file.stem().string() + "-" + std::to_string(out.size() + 1) +
                                  file.extension().string());
        const std::string title = nlohmann::json("Strokes on " + source.description.bodies[body].name).dump();
        write_file(name, "{\n  \"name\": " + title + ",\n  \"tools\": [\n" + text + "\n  ]\n}\n");
        out.push_back(name);
    }
    return out;
}

}  // namespace splitcubes::view
