// Plays the frames that `splitcubes run` wrote back as states.
#pragma once

#include "published_state.h"
#include "scene_source.h"

#include <filesystem>
#include <map>
#include <memory>
#include <vector>

namespace splitcubes::geometry {
class NearestPoint;
struct SurfaceMesh;
}  // namespace splitcubes::geometry

namespace splitcubes::scene {
class Course;
}

namespace splitcubes::view {

/// Tells whether it is a folder that `splitcubes run` wrote.
bool is_run(const std::filesystem::path& folder);

class RunPlayer {
  public:
    /// Throws InputError for a folder that holds no frames or no scene.
    explicit RunPlayer(const std::filesystem::path& folder);
    ~RunPlayer();

    /// Reads the present frame. Throws InputError for one that cannot be read.
    std::shared_ptr<PublishedState> publish();
    void step() { seek(frame_ + 1); }
    /// Beyond the ends: the first or last frame.
    void seek(std::int64_t frame);
    std::int64_t frame() const { return frame_; }
    bool is_at_end() const { return frame_ + 1 == count(); }
    std::int64_t count() const { return static_cast<std::int64_t>(files_.size()); }
    /// s, from this frame to the next.
    double frame_length() const;
    const std::vector<std::string>& notes() const { return source_.notes; }

  private:
    double time_of(std::int64_t frame) const;
    BodyState body_of(const geometry::SurfaceMesh& surface, std::int32_t body, bool is_only);
    void add_looks(const geometry::SurfaceMesh& surface, std::int32_t body,
                   const std::vector<std::int32_t>& materials, const std::vector<std::uint32_t>& vertices,
                   BodyState& out, SurfaceTopology& topology);
    const geometry::NearestPoint* uncut_surface(std::size_t body);

    SceneSource source_;
    std::unique_ptr<const scene::Course> course_;
    std::vector<std::filesystem::path> files_;
    std::vector<std::shared_ptr<const geometry::TriangleMesh>> collider_meshes_;
    std::map<std::size_t, std::unique_ptr<const geometry::NearestPoint>> uncut_;
    std::map<std::string, std::shared_ptr<const SurfacePicture>> pictures_;
    std::int64_t frame_ = 0;
    std::uint64_t published_ = 0;
};

}  // namespace splitcubes::view
