// Occlusion disks by OpenGL rendering (Pietroni et al. 2007, section 7.2).
#pragma once

#include <splitcubes/gl/context.h>
#include <splitcubes/occlusion/disk.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::occlusion {

struct OpenGlOptions {
    /// Texels per side of the atlas that holds the disks of a batch; a multiple of 32 in 32 .. 512. On Mesa's
    /// software rasteriser the cost of a query grows with the whole target, and targets above 512 gave wrong
    /// counts.
    int atlas_size = 256;
    /// Counts all disks by reading the texels back instead of by queries.
    bool count_texels = false;
    /// Counts by both methods and uses the texels; for tests.
    bool check_queries = false;
};

struct OpenGlStatistics {
    std::size_t disks = 0;          // drawn disks: those with triangles nearby
    std::size_t queries = 0;        // issued queries
    std::size_t wrong_counts = 0;   // impossible or (check_queries) different from the texels
    std::size_t counted_again = 0;  // batches recounted by their texels for that reason
};

/// Visibility backend on OpenGL. Each disk is a tile of an atlas. The surface is drawn into it from one
/// phyxel and from the other, mirrored so that a sample maps to the same texel; a texel passes the stencil
/// test once, and a samples-passed query counts those that do. Before that, boundary triangles drawn from the
/// first phyxel invert a stencil bit: an odd number means outside the body.
///
/// The results equal those of the other backends except for samples within rounding of a triangle's edge:
/// OpenGL snaps corners to a fraction of a texel (1/256 with most drivers). If a count is impossible (more
/// samples than the tile has), the batch is counted by its texels.
///
/// Must be used on the thread that made it; makes its context current.
class OpenGlBackend final : public VisibilityBackend {
  public:
    /// context: may be shared with other users. Throws InputError for options out of range, JobError if the
    /// driver refuses.
    OpenGlBackend(std::shared_ptr<const gl::HeadlessContext> context, const VisibilityOptions& options,
                  const OpenGlOptions& drawing = {});
    ~OpenGlBackend() override;

    std::string name() const override { return "opengl"; }
    void evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                  std::span<float> visibility, const Parallel& parallel) override;

    /// Returns the masks of the tiles after drawing, by pair; obscured is set for samples inside only.
    std::vector<DiskMasks> masks(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                                 const Parallel& parallel);

    const OpenGlStatistics& statistics() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Returns whether a query's counts are possible: 0 <= visible <= inside <= samples.
bool are_counts_possible(const DiskCounts& counts, const DiskRaster& raster);

}  // namespace splitcubes::occlusion
