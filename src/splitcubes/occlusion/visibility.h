// How much two phyxels see of each other past a body's surface.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/occluder_grid.h>

#include <memory>
#include <span>
#include <string>

namespace splitcubes::occlusion {

/// Two phyxels.
struct PairQuery {
    Vec3 a, b;  // m, rest space
};

struct VisibilityOptions {
    int disk_size = 16;                      // texels a side: 8, 16 or 32
    double full_occlusion_threshold = 0.05;  // a visibility below counts as 0; 0 .. 1
};

/// Evaluates occlusion disks (Pietroni et al. 2007, sec. 7.1-7.2). The disk of a
/// pair lies on the perpendicular bisector plane of its segment, about the
/// midpoint, with half the distance as radius; its samples are the centres of a
/// disk_size x disk_size raster that lie within it. A sample is obscured when
/// the closed segment to it from one of the two phyxels meets a triangle. The
/// segments start 1e-3 of the distance after the phyxel, which may lie on a
/// surface, and reach 1e-3 of the distance past the disk, so that a surface in
/// the disk's own plane is met. Only samples inside the body count: those that
/// boundary triangles part from the phyxel an even number of times. Where there
/// are none, the segment between the phyxels decides.
/// The paper's formula has the fraction inverted; here visibility = (samples
/// inside and not obscured) / (samples inside), 1 where nothing is in between.
/// The answer is a function of the triangles present and of the unordered pair:
/// (a, b) and (b, a) give the same bits, and so does any number of threads.
class VisibilityBackend {
  public:
    virtual ~VisibilityBackend() = default;
    virtual std::string name() const = 0;
    /// visibility: one value in [0, 1] per pair, written; as long as pairs.
    /// Pairs at the same place see each other. That phyxels of different pieces
    /// do not is for the caller to apply.
    virtual void evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                          std::span<float> visibility, const Parallel& parallel) = 0;
};

/// Bit masks and edge functions; the default. Runs on the widest vectors that
/// the machine has, with the same bits on all. Throws InputError for options out of range.
std::unique_ptr<VisibilityBackend> make_cpu_backend(const VisibilityOptions& options);

/// One ray a sample and phyxel, in double precision: the slow truth, for tests.
/// Throws InputError for options out of range.
std::unique_ptr<VisibilityBackend> make_brute_force_backend(const VisibilityOptions& options);

/// What a changed triangle's box must meet to change the pair's visibility, m, rest space.
geometry::Box double_cone_bounds(const PairQuery& pair);

}  // namespace splitcubes::occlusion
