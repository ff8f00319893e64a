// A run in one animated GLB.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::io {

/// Collects frames and moving solids, and writes them as one animated glTF 2.0 scene. Cuts change the
/// topology between frames, so each frame is a mesh and a node of its own, and an animation in steps gives
/// one node after the other its size while the others have none: what every program that reads animated glTF
/// shows.
class AnimationWriter {
  public:
    /// path: ends in .glb. Throws InputError if no file can be written there.
    explicit AnimationWriter(std::filesystem::path path);
    ~AnimationWriter();

    /// Adds a frame; times, s, increase. Attributes as of write_mesh. Pictures in files of their own are
    /// referred to relative to the file. Throws InputError for a surface that write_mesh would refuse.
    void add_frame(double time, const geometry::SurfaceMesh& surface);
    /// Adds a solid that moves: its frames, world from own, at times that increase.
    void add_solid(const std::string& name, const geometry::TriangleMesh& mesh,
                   const geometry::Material& material, const std::vector<double>& times,
                   const std::vector<Isometry>& frames);
    /// Writes the file, whole or not at all. Throws InputError if there is no frame or it is more than a GLB
    /// can hold, JobError where the file cannot be written.
    void finish();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace splitcubes::io
