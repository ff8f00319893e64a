// Winding number of many triangles at a point, with derivatives.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// A winding number and its derivatives away from the triangles.
struct WindingJet {
    double value = 0;
    Vec3 gradient = Vec3::Zero();
    Vec3 second = Vec3::Zero();  // second derivative along each axis
    /// Sum of the squared bounds on each triangle's rounding error. The errors are independent, so their sum
    /// stays within a small multiple of the square root (Higham and Mary 2019).
    double error2 = 0;
    bool sound = true;  // false: so close to a triangle that rounding decides the side
};

/// Triangles in single precision, one array per coordinate, each with an id given by the caller. The unit of
/// length is such that points of interest are about one apart.
class WindingTriangles {
  public:
    using Corners = std::array<Vec3, 3>;
    static constexpr std::size_t width = 16;

    std::size_t size() const { return ids_.size(); }
    std::uint32_t id(std::size_t k) const { return ids_[k]; }
    void clear();
    void add(const Corners& corners, std::uint32_t id);
    /// To be called after the last triangle.
    void finish();

    /// Fills `kept` with the triangles whose boundary is closer to a ball than `gap`. Returns a bound on the
    /// sum of the integrals of r^-7 along the boundaries of the others, r being the distance to any point of
    /// the ball.
    double near(const Vec3& center, double radius, double gap, WindingTriangles& kept) const;

    // For the vectorised loops: coordinates of corners, then of the area vectors.
    const float* array(std::size_t k) const { return arrays_[k].data(); }

  private:
    std::array<std::vector<float>, 12> arrays_;
    std::vector<std::uint32_t> ids_;
};

/// Evaluates the winding number of triangles whose ids are indices into `all`.
class WindingJets {
  public:
    explicit WindingJets(std::vector<WindingTriangles::Corners> all);

    const WindingTriangles& triangles() const { return triangles_; }
    /// Sums with derivatives; value() sums without.
    WindingJet jet(const WindingTriangles& some, const Vec3& point) const;
    WindingJet value(const WindingTriangles& some, const Vec3& point) const;

  private:
    template <bool with_derivatives>
    WindingJet sum(const WindingTriangles& some, const Vec3& point) const;

    std::vector<WindingTriangles::Corners> all_;
    WindingTriangles triangles_;
    float reach_ = 0;  // largest coordinate
};

}  // namespace splitcubes::geometry
