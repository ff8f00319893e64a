// Motion of rest points that are not phyxels: the nodes of the surface's grid.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/affine_displacement.h>
#include <splitcubes/samples/locator.h>
#include <splitcubes/samples/phyxels.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Visibility factor of a phyxel's weight at a point, before normalisation: 0 hidden .. 1 visible.
using Visible = std::function<double(std::size_t point, std::uint32_t phyxel)>;

/// Interpolation weights of each point over phyxels. Rows of variable length lie in
/// one pool; a row that outgrows its capacity moves to the pool's end.
struct NodeKernels {
    struct Row {
        std::uint32_t begin = 0, count = 0, capacity = 0;  // into phyxel and weight

        template <class Archive>
        void serialize(Archive& archive) {
            archive(begin, count, capacity);
        }
    };
    std::vector<Row> rows;              // per point; count 0: no phyxel influences it
    std::vector<std::uint32_t> phyxel;  // pool
    std::vector<double> weight;         // pool; a row sums to 1
    std::size_t unused = 0;             // pool entries that no row owns

    std::size_t size() const { return rows.size(); }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(rows, phyxel, weight, unused);
    }
};

/// Builds the rows of all points (m, rest space): phyxels of the point's piece whose
/// support reaches it, weighted by the kernel times visible(point, phyxel).
/// `visible` may be empty (all visible); it is called from several threads.
/// `locator` holds all rest positions of the phyxels.
NodeKernels build_kernels(std::span<const Vec3> points, std::span<const std::int32_t> piece,
                          const Phyxels& phyxels, const PhyxelLocator& locator, const Visible& visible,
                          const Parallel& parallel);

/// Rebuilds the rows of `subset` (point indices without repetitions; indices past
/// the existing rows extend them). Spans are over all points. Equal to a full build.
void rebuild_kernels(NodeKernels& kernels, std::span<const std::uint32_t> subset,
                     std::span<const Vec3> points, std::span<const std::int32_t> piece,
                     const Phyxels& phyxels, const PhyxelLocator& locator, const Visible& visible,
                     const Parallel& parallel);

/// Evaluates the frames of the points: position sum_i w_i (x_i + F_i (X - X_i)), Jacobian
/// sum_i w_i F_i (Splitting Cubes, eq. 5). Frames of rows without phyxels are left
/// unchanged. Exact at rest.
class FrameEvaluator {
  public:
    void operator()(const NodeKernels& kernels, std::span<const Vec3> rest_points,
                    std::span<const Vec3> rest_position, std::span<const Vec3> position,
                    std::span<const Mat3> deformation, std::span<geometry::Frame> out,
                    const Parallel& parallel);

    /// Evaluates only the points of `subset`; bitwise equal to an evaluation of all.
    void evaluate_some(std::span<const std::uint32_t> subset, const NodeKernels& kernels,
                       std::span<const Vec3> rest_points, std::span<const Vec3> rest_position,
                       std::span<const Vec3> position, std::span<const Mat3> deformation,
                       std::span<geometry::Frame> out, const Parallel& parallel);

  private:
    std::vector<geometry::AffineDisplacement> affine_;  // per phyxel
    std::vector<std::uint32_t> needed_;                 // scratch of evaluate_some: phyxels
    std::vector<std::uint8_t> is_needed_;               // the same, per phyxel
};

/// The same with a buffer of its own.
void evaluate_frames(const NodeKernels& kernels, std::span<const Vec3> rest_points, const Phyxels& phyxels,
                     std::span<geometry::Frame> out, const Parallel& parallel);
/// The same for another state of the phyxels (a step ago, say).
void evaluate_frames(const NodeKernels& kernels, std::span<const Vec3> rest_points, const Phyxels& phyxels,
                     std::span<const Vec3> position, std::span<const Mat3> deformation,
                     std::span<geometry::Frame> out, const Parallel& parallel);

}  // namespace splitcubes::meshless
