// Free-form deformation: space is a trivariate Bezier volume with moving control points (Sederberg and Parry
// 1986). Cuts do not affect it: the sides of a cut stay together unless the lattice bends them through each
// other.
#pragma once

#include <splitcubes/deformation/deformation.h>

namespace splitcubes::deformation {

/// Displacements of the control points at a time.
struct LatticeKeyframe {
    double time = 0;                 // s
    std::vector<Vec3> displacement;  // m, one per control point, x fastest
};

struct FreeFormSettings {
    Vec3i degree = Vec3i(1, 1, 1);           // of the polynomials, 1..12; degree + 1 control points per axis
    std::vector<LatticeKeyframe> keyframes;  // at least one, strictly increasing in time
};

/// Throws InputError for an invalid degree, time or count of displacements.
void check_free_form(const FreeFormSettings& settings);

/// Free-form deformation x(X) = sum_ijk B_i(u) B_j(v) B_k(w) P_ijk, where (u, v, w) is X relative to the
/// lattice's box. Between keyframes the displacements are interpolated with weight s^2 (3 - 2 s), where s is
/// the share of the time; before the first and after the last they are constant.
class FreeForm : public Deformation {
  public:
    /// box: extent of the lattice, m, rest space.
    FreeForm(NodeSet nodes, FreeFormSettings settings, const geometry::Box& box);

    void edges_cut(std::span<const NodeEdge> edges) override;
    MotionReport advance(const Motion& motion) override;
    void node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const override;
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;

    /// Returns the frame of a rest point at a time (s).
    geometry::Frame frame_at(const Vec3& rest, double time) const;

  private:
    std::vector<Vec3> displacement_at(double time) const;
    geometry::Frame frame_of(const Vec3& rest, std::span<const Vec3> displacement) const;

    NodeSet nodes_;
    FreeFormSettings settings_;
    geometry::Box box_;
    double time_ = 0;
    std::vector<Vec3> displacement_;  // m, per control point, at the present time
};

}  // namespace splitcubes::deformation
