// Elasticity as the solvers use it: the formulas of elasticity.h in single precision over
// slices of links.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/elasticity/elasticity.h>
#include <splitcubes/elasticity/simd/slice_kernels.h>

#include <algorithm>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Deformation, forces and stiffness. Strains and forces are single precision, positions and
/// sums double. Strains are computed relative to a rotated frame that follows the body, so the
/// error of a strain e is about 1e-7 (e + r), where r is the rotation of the phyxel against
/// the frame, rad, independent of the body's size, position and orientation. At rest and under
/// pure translation forces are exactly zero.
///
/// For corotated material without plasticity and volume stiffness, rotations are computed
/// sixteen at a time by the Newton-Schulz iteration. Rows that are too distorted for it or
/// have rank < 3, and all rows of other materials, are evaluated one by one in double
/// precision ("fallback" rows).
///
/// The object holds buffers; calls on one object must not overlap. It allocates only if
/// there are more phyxels or links than before.
class SlicedElasticity {
  public:
    struct Configuration {
        std::span<const Vec3> rest_position;   // m
        std::span<const Vec3> position;        // m, world
        std::span<const Mat3> last_rotation;   // for phyxels whose neighbours do not determine R
        std::span<const Mat3> plastic_strain;  // read only if the material has plasticity
        bool is_rotated = true;                // the frame is the mean of last_rotation; false: the identity
        bool has_tangents = true;              // false: apply_stiffness must not be called for this state
    };
    /// Computes deformation, rotation, stress and tangents at a configuration. Returns the number of phyxels
    /// that were not finite; they keep their last rotation.
    std::size_t take_state(const Neighbourhoods& neighbourhoods, const Material& material,
                           const Configuration& configuration, const Parallel& parallel);

    /// The same, and also computes the energy, so that `energy` need not read the links again.
    std::size_t take_state_and_energy(const Neighbourhoods& neighbourhoods, const Material& material,
                                      const Configuration& configuration, const Parallel& parallel);

    /// State that defines the twists.
    struct TwistState {
        std::span<const Mat3> deformation, rotation;  // F, R, per phyxel
        std::span<const std::int32_t> piece;          // per phyxel; empty: twists are those of the state
        std::span<const std::uint8_t> restrained;     // per piece, whether it is held or pulled
    };
    /// Computes the twists (Tangent::twist) of the tangents from a state that may differ from that of the
    /// last take_state, such as the start of a step. Each phyxel's strain is reduced by the squared angle of
    /// the rotation between the two states: a linear step runs along straight lines, which stretches material
    /// that rotates, and the twist of that would resist the rotation. With `piece`, pieces that are not
    /// restrained have no twist, as they are under no lasting tension; in others the twists are scaled so
    /// that their sum is that of the exact ones, or zero, so that bending does not resist a rotation either.
    /// Phyxels that are distorted in the last state and not taut have the majorizer's twist.
    void take_twists(const TwistState& from, const Parallel& parallel);
    /// Returns the twist of phyxel i, Pa, and whether it is the majorizer's.
    Mat3 twist(std::size_t i) const;
    /// Returns how the completed directions of phyxel i follow a change.
    Completion completion(std::size_t i) const;
    /// Returns dT, N m, of a change dH of the fitted gradient of phyxel i by the tangents, in double
    /// precision: V dP less the fitted part of the penalty, so that dT : dH is twice the energy of both but
    /// for the pull of displacements off a flat phyxel's plane. twist_share: factor on the twist.
    Mat3 tension_change(std::size_t i, const Mat3& dH, double twist_share) const;
    bool is_majorizer(std::size_t i) const { return twists_.majorizer[i] > 0; }

    // The following refer to the last state.

    /// Writes F and R of all phyxels.
    void read_deformation(std::span<Mat3> deformation, std::span<Mat3> rotation,
                          const Parallel& parallel) const;
    /// Returns meshless::is_distorted of phyxel i.
    bool is_distorted(std::size_t i) const { return twists_.distortion[i] > 0; }
    /// Returns E of elasticity.h, J; `configuration` must be the one of the last take_state.
    /// Writes each phyxel's own energy to `rows` unless that is empty.
    double energy(const Configuration& configuration, const Parallel& parallel, std::span<double> rows = {});
    /// Computes -dE/dx, N, into `force`.
    void forces(std::span<Vec3> force, const Parallel& parallel);
    /// The same; component k of phyxel i is at k * stride() + i. Valid until the next call.
    const float* forces(const Parallel& parallel);
    /// Computes out = (diagonal + factor K + twist_factor K_t) dx, N for dx in m and diagonal in N/m; returns
    /// dx . out. K_t is the part of the twists (Tangent::twist) but the majorizer's, K the rest.
    double apply_stiffness(double factor, std::span<const double> diagonal, std::span<const Vec3> dx,
                           std::span<Vec3> out, const Parallel& parallel, double twist_factor = 1);
    /// The same for row arrays (3 * stride(), stride()).
    double apply_stiffness(float factor, const float* diagonal, const float* dx, float* out,
                           const Parallel& parallel, float twist_factor = 1);

    /// Length of the row arrays for the last neighbourhoods.
    std::size_t stride() const { return slices_ ? slices_->stride() : 0; }
    std::size_t slice_count() const { return slices_ ? slices_->slice_count() : 0; }

  private:
    SliceState arrays();
    SliceState arrays_of_tangents();
    void choose_frame(const Configuration& configuration);
    void turn_to_world(std::size_t i);
    void size_buffers(const Neighbourhoods& neighbourhoods, const Material& material);
    void take_displacement(const Configuration& configuration, const Parallel& parallel);
    void take_rows(const Configuration& configuration, const SliceRange& range, std::size_t& bad);
    bool take_row(const Configuration& configuration, std::size_t i);
    double row_energy(const Configuration& configuration, std::size_t i) const;
    double range_energy(const Configuration& configuration, const SliceRange& range);
    void take_configuration(const Neighbourhoods& neighbourhoods, const Material& material,
                            const Configuration& configuration, const Parallel& parallel);
    void change_stress(const SliceRange& range, double twist_share);
    Mat3 matrix_at(const FloatArray& array, std::size_t i) const;
    void set_matrix(FloatArray& array, std::size_t i, const Mat3& matrix) const;
    void twists_of_slice(const TwistState& from, std::size_t slice);
    void sum_twists(const TwistState& from);
    double twist_factor(const TwistState& from, std::size_t i) const;
    void set_symmetric(FloatArray& array, std::size_t i, const Mat3& matrix) const;
    Mat3 stress_change(std::size_t i, const Mat3& dF, double twist_share) const;
    Mat3 tension_change(std::size_t i, const Completion& completion, const Mat3& dH,
                        double twist_share) const;
    void list_off_plane_rows();
    void add_off_plane_forces(float* force) const;
    void change_deficient_rows(const SliceRange& range, const float* dx, double twist_share, bool weights);
    void add_off_plane_changes(float* force) const;

    /// Twists of the tangents, and what they depend on; arrays as in SliceState.
    struct Twists {
        FloatArray stiffness, sum, distortion, majorizer;
        std::vector<double> exact, positive;  // N m, sums of each piece
    };

    /// Rotated frame in which strains and forces are computed.
    struct StrainFrame {
        Mat3 world = Mat3::Identity();  // world from frame
        bool is_rotated = false;        // `world` is not the identity
        FloatArray turn;                // 9, R - I in the world; only if it is rotated
    };

    /// Energies of the last configuration that they were computed for.
    struct Energies {
        std::vector<double> row, range;  // J, per row, per chunk
        bool are_taken = false;          // they are of the last state
    };

    /// Flat phyxels (rank 2) with neighbours off their plane.
    struct OffPlane {
        std::vector<std::uint32_t> rows;
        std::vector<Vec3> normal_change;  // per phyxel, of the direction; only those of `rows` are valid
    };

    const Neighbourhoods* neighbourhoods_ = nullptr;
    const LinkSlices* slices_ = nullptr;
    Material material_;
    bool corotated_ = false;                          // is_frame_sufficient
    FloatArray high_, low_;                           // 3, m
    FloatArray gradient_, turn_, tension_, penalty_;  // as in SliceState
    FloatArray direction_, force_, diagonal_;         // 3, 3, 1
    FloatArray energy_;                               // 1, J
    Energies energies_;
    std::vector<std::uint16_t> fallback_;       // per slice
    std::vector<Mat3> deformation_, rotation_;  // per phyxel, set for fallback rows
    StrainFrame frame_;
    Twists twists_;
    OffPlane off_plane_;
    std::vector<Tangent> tangent_;  // per phyxel, unless corotated_
    ChunkSumOf<double> sum_;
    ChunkSumOf<std::size_t> count_;
};

/// Returns the number of slices per chunk for `count` slices: enough chunks to balance the threads, but few,
/// as each costs some tenths of a microsecond of scheduling. Results depend on it, as on phyxel_grain.
inline std::size_t slice_grain(std::size_t count) {
    return std::clamp<std::size_t>(count / 48, 16, 64);
}

/// Calls body(SliceRange) over all slices.
template <class Body>
void for_slices(const Parallel& parallel, std::size_t count, const Body& body) {
    const auto chunk = [&](std::size_t begin, std::size_t end) { body(SliceRange{begin, end}); };
    parallel.for_chunks(count, slice_grain(count), std::cref(chunk));
}

}  // namespace splitcubes::meshless
