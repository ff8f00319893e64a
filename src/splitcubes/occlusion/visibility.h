// Visibility of two phyxels past a body's surface.
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
    int disk_size = 16;                      // texels per side: 8, 16 or 32
    double full_occlusion_threshold = 0.05;  // a lower visibility counts as 0; 0 .. 1
};

/// Evaluates occlusion disks (Pietroni et al. 2007, sec. 7.1-7.2). The disk of a pair is in the perpendicular
/// bisector plane of its segment, about the midpoint, with half the distance as radius; its samples are the
/// texel centres of a disk_size x disk_size raster that are in it.
///
/// A sample is obscured if the closed segment to it from one of the two phyxels meets a triangle. The
/// segments start 1e-3 of the distance after the phyxel, which may be on a surface, and extend 1e-3 of the
/// distance past the disk, so that they meet a surface in the disk's own plane. Only samples inside the body
/// count: those with an even number of boundary triangles between them and the phyxel. If there are none, the
/// segment between the phyxels decides.
///
/// The paper's formula has the fraction inverted; here visibility = (samples inside and not obscured) /
/// (samples inside), 1 with nothing in between. The result is a function of the triangles and of the
/// unordered pair: (a, b) and (b, a) give the same bits, for any number of threads.
class VisibilityBackend {
  public:
    virtual ~VisibilityBackend() = default;
    virtual std::string name() const = 0;
    /// Computes the visibilities. visibility: output, one value in [0, 1] per pair; as long as pairs.
    /// Coincident phyxels have visibility 1. The caller must set the visibility of phyxels of different
    /// pieces to 0.
    virtual void evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                          std::span<float> visibility, const Parallel& parallel) = 0;
};

/// Makes the default backend, with bit masks and edge functions. It uses the widest vectors of the machine,
/// with the same bits on all. Throws InputError for options out of range.
std::unique_ptr<VisibilityBackend> make_cpu_backend(const VisibilityOptions& options);

/// Makes the slow reference for tests: one ray per sample and phyxel, in double precision. Throws InputError
/// for options out of range.
std::unique_ptr<VisibilityBackend> make_brute_force_backend(const VisibilityOptions& options);

/// Returns the box that a changed triangle's box must meet to change the pair's visibility, m, rest space.
geometry::Box double_cone_bounds(const PairQuery& pair);

}  // namespace splitcubes::occlusion
