// Free-form deformation: space is a trivariate Bezier volume whose control points
// move (Sederberg and Parry 1986). A cut changes nothing in it: the sides of a cut
// stay together unless the lattice bends them through each other.
#pragma once

#include <splitcubes/deformation/deformation.h>

namespace splitcubes::deformation {

/// Displacements of the control points at a time.
struct LatticeKeyframe {
    double time = 0;                 // s
    std::vector<Vec3> displacement;  // m, one a control point, x fastest
};

struct FreeFormSettings {
    Vec3i degree = Vec3i(1, 1, 1);           // of the polynomials, 1..12; degree + 1 control points an axis
    std::vector<LatticeKeyframe> keyframes;  // at least one, by strictly increasing time
};

/// Throws InputError for a degree, a time or a count of displacements that is wrong.
void check_free_form(const FreeFormSettings& settings);

/// x(X) = sum_ijk B_i(u) B_j(v) B_k(w) P_ijk, (u, v, w) being X in the box of the
/// nodes. Between keyframes the displacements are linear in s^2 (3 - 2 s), s being the
/// share of the time; before the first and after the last they stand still.
class FreeForm : public Deformation {
  public:
    /// The lattice spans `box` (m, rest space).
    FreeForm(NodeSet nodes, FreeFormSettings settings, const geometry::Box& box);

    void edges_cut(std::span<const NodeEdge> edges) override;
    MotionReport advance(const Motion& motion) override;
    void node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const override;
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;

    /// Where a rest point goes at a time (s).
    geometry::Frame frame_at(const Vec3& rest, double time) const;

  private:
    std::vector<Vec3> displacement_at(double time) const;
    geometry::Frame frame_of(const Vec3& rest, std::span<const Vec3> displacement) const;

    NodeSet nodes_;
    FreeFormSettings settings_;
    geometry::Box box_;
    double time_ = 0;
    std::vector<Vec3> displacement_;  // m, per control point, now
};

}  // namespace splitcubes::deformation
