// Ray tracing of the samples of occlusion disks with Embree, as a reference for their results and time.
#pragma once

#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/occlusion/disk.h>

#include <memory>
#include <span>
#include <vector>

namespace splitcubes::app {

/// A scene of triangles in Embree 3. In a build without Embree made() is false.
class EmbreeRays {
  public:
    explicit EmbreeRays(std::span<const geometry::OccluderTriangle> triangles);
    ~EmbreeRays();
    EmbreeRays(const EmbreeRays&) = delete;
    EmbreeRays& operator=(const EmbreeRays&) = delete;

    static bool built_in();
    double build_seconds() const { return build_seconds_; }
    /// Counts the unoccluded samples of each pair's disk with packets of 16 rays from the first phyxel
    /// (occluded16, coherent), then from the second for the samples that are not yet occluded.
    void count(std::span<const occlusion::PairQuery> pairs, const occlusion::DiskRaster& raster,
               std::span<int> visible) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
    double build_seconds_ = 0;
};

}  // namespace splitcubes::app
