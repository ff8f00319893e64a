// The strokes and pulls of a session as they were carried out, for export: undone ones are not among them.
#pragma once

#include "picking.h"

#include <splitcubes/scene/description.h>

#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <vector>

namespace splitcubes::view {

struct SceneSource;

/// A pose of a blade: world from own at a time, and the same in rest space, by the rigid motion that fits the
/// piece that was touched.
struct StrokeSample {
    double time = 0;  // s
    Isometry world = Isometry::Identity();
    Isometry rest = Isometry::Identity();
};

struct LoggedStroke {
    std::size_t body = 0;      // index of the body that was touched first
    std::vector<Vec3> points;  // of the edge, own frame, m
    std::vector<StrokeSample> samples;
    double end = std::numeric_limits<double>::infinity();  // s, when it was raised
    double begin() const { return samples.front().time; }
};

struct LoggedPull {
    std::size_t body = 0;
    Vec3 rest = Vec3::Zero();           // m, rest space, centre of the region
    double radius = 0;                  // m
    double stiffness = 0;               // N/m
    double limit = 0;                   // N, of the force; 0: none
    std::vector<StrokeSample> samples;  // of the target: world from rest; `rest` is not used
    double end = std::numeric_limits<double>::infinity();  // s, when it let go
    double begin() const { return samples.front().time; }
};

/// Ids of what is logged are given in order and stay valid until clear().
class StrokeLog {
  public:
    std::size_t begin_stroke(LoggedStroke stroke);
    void move_stroke(std::size_t id, const StrokeSample& sample, double step_start);
    void end_stroke(std::size_t id, double time);
    std::size_t begin_pull(LoggedPull pull);
    void move_pull(std::size_t id, const StrokeSample& sample, double step_start);
    void end_pull(std::size_t id, double time);
    void clear();
    /// Strokes and pulls that began at or after a time were undone.
    void go_back(double time);
    /// Strokes and pulls that began before a time were done again.
    void go_forward(double time);
    /// Nothing that was undone comes back.
    void forget_undone();

    /// In the order of their beginnings.
    std::vector<LoggedStroke> strokes() const;
    std::vector<LoggedPull> pulls() const;

  private:
    std::size_t next_ = 0;
    std::map<std::size_t, LoggedStroke> strokes_, undone_strokes_;
    std::map<std::size_t, LoggedPull> pulls_, undone_pulls_;
};

/// Returns the rigid motion, world from rest, that fits a piece of a surface best; of all its pieces for a
/// negative number.
Isometry fitted_motion(const SurfaceView& surface, std::int32_t piece);

/// Returns the scene with the strokes as tools and the pulls as handles, that lasts so many steps. Throws
/// InputError for a saved simulation.
scene::SceneDescription exported_scene(const SceneSource& source, const StrokeLog& log, std::int64_t steps);

/// Writes a path file (docs/scenes.md#path-files) for each body that was cut, in the coordinates of its mesh
/// file. The first has the name that is given, the n-th one has `-n` behind it. Returns the files.
std::vector<std::filesystem::path> write_paths(const std::filesystem::path& file, const SceneSource& source,
                                               const StrokeLog& log);

}  // namespace splitcubes::view
