// Occlusion disks by rendering, as Pietroni et al. 2007, section 7.2, do it.
#pragma once

#include <splitcubes/gl/context.h>
#include <splitcubes/occlusion/disk.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::occlusion {

struct OpenGlOptions {
    /// Texels along a side of the atlas that holds the disks of a batch; a
    /// multiple of 32, 32 .. 512. On Mesa's software rasteriser a query costs by
    /// the whole target, and targets beyond 512 gave wrong counts.
    int atlas_size = 256;
    /// Counts all disks by reading the texels back, not by queries.
    bool count_texels = false;
    /// Does both and takes the texels; for tests.
    bool check_queries = false;
};

struct OpenGlStatistics {
    std::size_t disks = 0;          // drawn: had triangles near
    std::size_t queries = 0;        // asked
    std::size_t wrong_counts = 0;   // that cannot be, or (check_queries) differ from the texels
    std::size_t counted_again = 0;  // batches counted by their texels on account of that
};

/// Each disk is a tile of an atlas. The surface is drawn into it from one phyxel
/// and from the other, mirrored so that a sample lands on the same texel; a texel
/// passes the stencil test once, and a samples-passed query counts those that
/// do. Before that, boundary triangles drawn from the first phyxel invert a
/// stencil bit: what is odd, is outside the body. Equals the other backends but
/// for samples within rounding of a triangle's edge: OpenGL snaps corners to a
/// fraction of a texel (1/256 with most drivers). A count that cannot be, more
/// samples than the tile has, makes the batch be counted by its texels.
/// To be used on the thread that it was made on; makes its context current.
class OpenGlBackend final : public VisibilityBackend {
  public:
    /// context: may be shared with others. Throws InputError for options out of
    /// range, JobError where the driver refuses.
    OpenGlBackend(std::shared_ptr<const gl::HeadlessContext> context, const VisibilityOptions& options,
                  const OpenGlOptions& drawing = {});
    ~OpenGlBackend() override;

    std::string name() const override { return "opengl"; }
    void evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                  std::span<float> visibility, const Parallel& parallel) override;

    /// What the tiles hold after drawing, by pair; obscured is set for samples inside only.
    std::vector<DiskMasks> masks(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                                 const Parallel& parallel);

    const OpenGlStatistics& statistics() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Whether a query's counts can be: 0 <= visible <= inside <= samples.
bool counts_can_be(const DiskCounts& counts, const DiskRaster& raster);

}  // namespace splitcubes::occlusion
