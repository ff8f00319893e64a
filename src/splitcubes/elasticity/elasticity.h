// Elasticity on moving least squares gradients: deformation, energy, force and stiffness
// for implicit steps, for any material.
//
// E = sum_i V_i psi(F_i)  (constitutive.h)
//   + sum_i sum_j c_i w_ij / 2 |e_ij|^2,  e_ij = F_i x_ij - (x_j - x_i).
// The second term controls zero-energy modes (Ganzenmueller 2015) with the weights of the
// fit of F_i. Hence sum_j w_ij e_ij x_ij^T = 0, its derivative through F_i vanishes, and
// with w_ij x_ij = A_i g_ij the force becomes
// f_i = T_i G_i - sum_j T_j g_ji + sum_j m_ij (u_j - u_i),
// T = V P - c H A, H = F - I, G_i = sum_j g_ij, m_ij = c_i w_ij + c_j w_ji, u = x - X:
// one more number per link than without the penalty. With rank 2 F also has the completed
// normal n: neighbours off the plane pull on it by c_i sum_j w_ij s_j e_ij, s_j their height,
// and it turns with the images of the kept directions (Completion::resolve_normal). The code
// here evaluates e_ij in double precision and is the reference for SlicedElasticity.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/samples/loops.h>
#include <splitcubes/samples/neighbourhoods.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Computes F_i (completed) and R_i of all phyxels at world positions `position`. With
/// rank 3 F_i = sum_j (x_j - x_i) g_ij^T. With rank 2 F maps the dropped direction to the
/// unit normal of the images of the kept ones; with rank 1 R is `last_rotation` turned by
/// the smallest angle onto the kept direction; with rank 0 both are `last_rotation`.
/// Completed directions are free of stress. `rotation` may alias `last_rotation`. Returns
/// the number of phyxels whose F was not finite; both are set to their last rotation.
std::size_t compute_deformation(const Neighbourhoods& neighbourhoods, std::span<const Vec3> rest_position,
                                std::span<const Vec3> position, std::span<const Mat3> last_rotation,
                                std::span<Mat3> deformation, std::span<Mat3> rotation,
                                const Parallel& parallel);

/// The same for phyxel i. Returns false if F was not finite.
bool compute_deformation_of(std::size_t i, const Neighbourhoods& neighbourhoods,
                            std::span<const Vec3> rest_position, std::span<const Vec3> position,
                            const Mat3& last_rotation, Mat3& deformation, Mat3& rotation);

/// The same from H = sum_j (u_j - u_i) g_ij^T, u = x - X. Returns false if
/// F was not finite.
bool complete_deformation(const Neighbourhoods& neighbourhoods, std::size_t i, const Mat3& H,
                          const Mat3& last_rotation, Mat3& deformation, Mat3& rotation);

/// Derivative of the completed F of a phyxel (compute_deformation) by the fitted H: with rank 2 the normal,
/// with rank 1 the plane across the line turns with the images of the kept directions. So a rigid rotation
/// changes F by that rotation, and material of any rank does not resist it. Where F is far from R, R stands
/// for it, as the derivative grows without bound where images vanish.
class Completion {
  public:
    /// Completes nothing, as with rank 3.
    Completion() = default;
    /// basis: as Neighbourhoods::basis.
    Completion(int rank, const Mat3& basis, const Mat3& F, const Mat3& R);

    /// Returns dF of dH, whose dropped directions are zero.
    Mat3 complete(const Mat3& dH) const;
    /// Returns Q with Q : dH = P : complete(dH) for all dH.
    Mat3 resolve(const Mat3& P) const;
    /// Returns the change of the image of the dropped direction; zero unless the rank is 2.
    Vec3 normal_change(const Mat3& dH) const;
    /// Returns Q with Q : dH = f . normal_change(dH) for all dH.
    Mat3 resolve_normal(const Vec3& f) const;

  private:
    std::uint8_t rank_ = 3;
    Vec3 direction_ = Vec3::Zero();  // rank 2: the dropped direction; 1: the kept one; rest space
    Vec3 image_ = Vec3::Zero();      // rank 2: the unit normal; 1: image of the line over its squared length
    Mat3 follow_ = Mat3::Zero();     // rank 2: sum_a dual_a e_a^T; 1: R (1 - e e^T)
};

/// Returns the plastic strain projected onto the kept directions of phyxel i: the material
/// has no strain in the dropped ones, and stress there would cause a torque.
Mat3 resolved_plastic_strain(const Neighbourhoods& neighbourhoods, const Material& material, std::size_t i,
                             std::span<const Mat3> plastic_strain);

/// Updates phyxels.deformation and rotation from the positions, for use after a rebuild
/// if they are read before the next step.
void update_deformation(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Parallel& parallel);

/// State of a body, one entry per phyxel; `deformation` and `rotation` are results of
/// compute_deformation at `position`.
struct ElasticState {
    std::span<const Vec3> position;        // m, world
    std::span<const Mat3> deformation;     // F
    std::span<const Mat3> rotation;        // R
    std::span<const Mat3> plastic_strain;  // rest space; read only if the material has plasticity
};

/// Returns sum_j c_i w_ij / 2 |e_ij|^2 of phyxel i, J.
double penalty_energy(const Neighbourhoods& neighbourhoods, std::size_t i, const Mat3& deformation,
                      std::span<const Vec3> position);

/// Forces and stiffness, with the buffers they need. One per solver: a call
/// uses the buffers, so calls of one object must not overlap.
class ElasticForces {
  public:
    /// Computes -dE/dx, N. Plastic strain counts in the kept directions only. The forces sum to zero up to
    /// rounding.
    void forces(const Neighbourhoods& neighbourhoods, const Material& material, const ElasticState& state,
                std::span<Vec3> force, const Parallel& parallel);

    /// Returns E, J (formula at the head of this file).
    double energy(const Neighbourhoods& neighbourhoods, const Material& material, const ElasticState& state,
                  const Parallel& parallel);

    /// Computes the tangents (constitutive.h, Completion) at a state, for apply_stiffness.
    void linearise(const Neighbourhoods& neighbourhoods, const Material& material, const ElasticState& state,
                   const Parallel& parallel);

    /// Replaces the twist of a phyxel, as Tangent::twist and is_majorizer, after linearise.
    void set_twist(std::size_t i, const Mat3& twist, bool is_majorizer) {
        tangent_[i].twist = twist;
        tangent_[i].is_majorizer = is_majorizer;
    }

    /// Computes out = (diagonal + factor K + twist_factor K_t) dx, in N for dx in m and
    /// diagonal in N/m. K_t is the part of the twists but the majorizer's; K is the stiffness from the rest
    /// of the tangents of the last linearise and the penalties. Both are symmetric and
    /// positive semi-definite. Returns dx . out.
    double apply_stiffness(const Neighbourhoods& neighbourhoods, const Material& material, double factor,
                           std::span<const double> diagonal, std::span<const Vec3> dx, std::span<Vec3> out,
                           const Parallel& parallel, double twist_factor = 1);

  private:
    Vec3 gather_force(const Neighbourhoods& neighbourhoods, std::size_t i, std::span<const Mat3> gradient,
                      std::span<const Vec3> displacement) const;

    std::vector<Mat3> gradient_;          // per phyxel, dF
    std::vector<Mat3> tension_;           // per phyxel, V P, N m
    std::vector<Tangent> tangent_;        // per phyxel
    std::vector<Completion> completion_;  // per phyxel
    ChunkSum sum_;
};

}  // namespace splitcubes::meshless
