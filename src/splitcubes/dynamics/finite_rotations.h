// Rigid rotations within displacements, carried out as finite ones.
#pragma once

#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/samples/loops.h>
#include <splitcubes/samples/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Replaces, in the displacements of each piece in a step, their rigid rotation along straight lines by the
/// rotation by the same angle. A piece that turns by an angle a (rad) along straight lines is stretched by
/// a^2 / 2 across its axis.
///
/// This object holds buffers and the results of the last call only.
class FiniteRotations {
  public:
    /// Changes the displacements u (m, per phyxel) from the positions x (m, world). Pieces with a phyxel that
    /// is held (1 in `held`) and phyxels without a piece keep theirs.
    void apply(const Phyxels& phyxels, const Material& material, int piece_count,
               std::span<const std::uint8_t> held, std::span<const Vec3> x, std::span<Vec3> u,
               const Parallel& parallel);
    /// Replaces the displacements u by what the best rigid motion of each piece leaves of them (orthogonal
    /// Procrustes problem; Kabsch 1976). Those of pieces that are held stay.
    void keep_strain(const Phyxels& phyxels, int piece_count, std::span<const std::uint8_t> held,
                     std::span<const Vec3> x, std::span<Vec3> u, const Parallel& parallel);
    /// Replaces the velocities of pieces after a step of backward Euler by those of their rigid motion plus
    /// strain / dt, where `strain` is the result of keep_strain. Along a chord, a piece that turns by an
    /// angle a also grows at a rate a^2 / (2 dt). Momenta stay. skip: per phyxel; 1: its piece stays as it
    /// is.
    void straighten(Phyxels& phyxels, int piece_count, std::span<const std::uint8_t> skip,
                    std::span<const Vec3> strain, double dt, const Parallel& parallel);
    /// Returns the centripetal acceleration at x (m) of the last call of apply, times the square of the step,
    /// m; zero for pieces that it left as they were.
    Vec3 centripetal(std::int32_t piece, const Vec3& x) const;
    /// Returns the elastic energy that the replaced rotations would have stored, J.
    double stretch_energy() const { return stretch_energy_; }

  private:
    struct Motion {
        double mass = 0, volume = 0;  // kg, m^3
        Vec3 centre = Vec3::Zero();   // m
        Vec3 shift = Vec3::Zero();    // m
        Vec3 angle = Vec3::Zero();    // rad; while it is summed, kg m^2
        Mat3 inertia = Mat3::Zero();  // kg m^2
        Mat3 rotation = Mat3::Identity();
        bool is_held = false;
    };
    void find_motions(const Phyxels& phyxels, std::span<const std::uint8_t> held, std::span<const Vec3> x,
                      std::span<const Vec3> u);

    std::vector<Motion> motion_;  // per piece, and one for phyxels without a piece
    double stretch_energy_ = 0;
};

}  // namespace splitcubes::meshless
