// The samples of occlusion disks traced with Embree: what the disks are compared with.
#pragma once

#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/occlusion/disk.h>

#include <memory>
#include <span>
#include <vector>

namespace splitcubes::app {

/// A scene of triangles in Embree 3. Where the program was built without, made() is false.
class EmbreeRays {
  public:
    explicit EmbreeRays(std::span<const geometry::OccluderTriangle> triangles);
    ~EmbreeRays();
    EmbreeRays(const EmbreeRays&) = delete;
    EmbreeRays& operator=(const EmbreeRays&) = delete;

    static bool built_in();
    double build_seconds() const { return build_seconds_; }
    /// Unobscured samples of each pair's disk: packets of 16 rays from the first
    /// phyxel (occluded16, coherent), then from the second for those not yet obscured.
    void count(std::span<const occlusion::PairQuery> pairs, const occlusion::DiskRaster& raster,
               std::span<int> visible) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
    double build_seconds_ = 0;
};

}  // namespace splitcubes::app
