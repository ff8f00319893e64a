// Elasticity as the solvers use it: the formulas of elasticity.h in single precision,
// over slices of links.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/meshless/elasticity.h>
#include <splitcubes/meshless/slice_kernels.h>

#include <algorithm>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Deformation, forces and stiffness. Strains and forces are single precision, positions and
/// sums double: of a strain e some 1e-7 is lost where the body is turned, and some 1e-7 e
/// where it is not, whatever the body's size and place. At rest, and moved without turning,
/// forces are zero exactly.
///
/// Of plain corotated material rotations are found sixteen at a time by the iteration of
/// Newton and Schulz; rows that are distorted too far for it or have lost a rank, and all rows
/// of other materials, go through the double precision functions one by one.
///
/// The object holds buffers; calls of one object must not overlap. It allocates only when
/// there are more phyxels or links than before.
class SlicedElasticity {
  public:
    struct Configuration {
        std::span<const Vec3> rest_position;   // m
        std::span<const Vec3> position;        // m, world
        std::span<const Mat3> last_rotation;   // for phyxels whose neighbours do not tell it
        std::span<const Mat3> plastic_strain;  // read only of a material with plasticity
    };
    /// Takes deformation, rotation, stress and tangents where the body is. Returns the number of phyxels
    /// that were not finite; they keep their last rotation.
    std::size_t take_state(const Neighbourhoods& neighbourhoods, const Material& material,
                           const Configuration& configuration, const Parallel& parallel);

    /// The same, and `energy` of that place is known when it is asked for, without reading the links again.
    std::size_t take_state_and_energy(const Neighbourhoods& neighbourhoods, const Material& material,
                                      const Configuration& configuration, const Parallel& parallel);

    // Of the state taken last.

    /// F and R of all phyxels.
    void read_deformation(std::span<Mat3> deformation, std::span<Mat3> rotation,
                          const Parallel& parallel) const;
    /// Tangent::turning of phyxel i.
    bool is_distorted(std::size_t i) const { return majorizer_[i] > 0; }
    /// E of elasticity.h, J; `place` is what the state was taken of. Each phyxel's own part
    /// goes to `rows` where that is not empty.
    double energy(const Configuration& configuration, const Parallel& parallel, std::span<double> rows = {});
    /// -dE/dx, N, into `force`.
    void forces(std::span<Vec3> force, const Parallel& parallel);
    /// The same; component k of phyxel i is at k * stride() + i. Valid until the next call.
    const float* forces(const Parallel& parallel);
    /// out = (diagonal + factor K) dx, N for dx in m and diagonal in N/m; returns dx . out.
    double apply_stiffness(double factor, std::span<const double> diagonal, std::span<const Vec3> dx,
                           std::span<Vec3> out, const Parallel& parallel);
    /// The same of row arrays (3 * stride(), stride()).
    double apply_stiffness(float factor, const float* diagonal, const float* dx, float* out,
                           const Parallel& parallel);

    /// Of the neighbourhoods taken last.
    std::size_t stride() const { return slices_ ? slices_->stride() : 0; }
    std::size_t slice_count() const { return slices_ ? slices_->slice_count() : 0; }

  private:
    SliceState arrays();
    void size_buffers(const Neighbourhoods& neighbourhoods, const Material& material);
    void take_displacement(const Configuration& configuration, const Parallel& parallel);
    void take_rows(const Configuration& configuration, const SliceRange& range, std::size_t& bad);
    bool take_row(const Configuration& configuration, std::size_t i);
    double row_energy(const Configuration& configuration, std::size_t i) const;
    double range_energy(const Configuration& configuration, const SliceRange& range);
    void take_configuration(const Neighbourhoods& neighbourhoods, const Material& material,
                            const Configuration& configuration, const Parallel& parallel);
    void change_stress(const SliceRange& range);
    Mat3 matrix_at(const FloatArray& array, std::size_t i) const;
    void set_matrix(FloatArray& array, std::size_t i, const Mat3& matrix) const;
    void add_leaning(float* force) const;

    const Neighbourhoods* neighbourhoods_ = nullptr;
    const LinkSlices* slices_ = nullptr;
    Material material_;
    bool corotated_ = false;                                      // is_frame_sufficient
    FloatArray high_, low_;                                       // 3, m
    FloatArray gradient_, turn_, majorizer_, tension_, penalty_;  // as in SliceState
    FloatArray direction_, force_, diagonal_;                     // 3, 3, 1
    FloatArray energy_;                                           // 1, J
    std::vector<double> row_energy_;                              // J, per row
    std::vector<double> range_energy_;                            // J, per chunk
    bool energy_is_taken_ = false;              // the two before it, of the state taken last
    std::vector<std::uint16_t> odd_;            // per slice
    std::vector<Mat3> deformation_, rotation_;  // per phyxel, of odd rows
    std::vector<Tangent> tangent_;              // per phyxel, where not corotated_
    ChunkSumOf<double> sum_;
    ChunkSumOf<std::size_t> count_;
};

/// Slices a chunk, of so many: chunks enough for all threads to end together, and not many more, as handing
/// one out costs some tenths of a microsecond. Part of the result, as phyxel_grain is.
inline std::size_t slice_grain(std::size_t count) {
    return std::clamp<std::size_t>(count / 48, 16, 64);
}

/// body(SliceRange) over all slices.
template <class Body>
void for_slices(const Parallel& parallel, std::size_t count, const Body& body) {
    const auto chunk = [&](std::size_t begin, std::size_t end) { body(SliceRange{begin, end}); };
    parallel.for_chunks(count, slice_grain(count), std::cref(chunk));
}

}  // namespace splitcubes::meshless
