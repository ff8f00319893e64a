// The winding number of many triangles at a point with its derivatives.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// A winding number and how it changes where no triangle is crossed.
struct WindingJet {
    double value = 0;
    Vec3 gradient = Vec3::Zero();
    Vec3 second = Vec3::Zero();  // along each axis, twice
    /// Sum of the squares of the bounds on each triangle's rounding error. The errors are independent, so
    /// that their sum keeps within a small multiple of the root (Higham and Mary 2019).
    double error2 = 0;
    bool sound = true;  // false: so close to a triangle that rounding decides which side the point is on
};

/// Triangles in single precision, one array a coordinate, each with the number that it has elsewhere.
/// Lengths are in a unit in which the points of interest lie about one apart.
class WindingTriangles {
  public:
    using Corners = std::array<Vec3, 3>;
    static constexpr std::size_t width = 16;

    std::size_t size() const { return ids_.size(); }
    std::uint32_t id(std::size_t k) const { return ids_[k]; }
    void clear();
    void add(const Corners& corners, std::uint32_t id);
    /// After the last one.
    void finish();

    /// Fills `kept` with the triangles whose rim comes closer to a ball than `gap`. Returns a bound on the
    /// sum of the integrals of r^-7 along the rims of the others, r being the distance to any point of the
    /// ball.
    double near(const Vec3& center, double radius, double gap, WindingTriangles& kept) const;

    // For the loops: coordinates of corners, then of the area vectors.
    const float* array(std::size_t k) const { return arrays_[k].data(); }

  private:
    std::array<std::vector<float>, 12> arrays_;
    std::vector<std::uint32_t> ids_;
};

/// The sums of triangles that are numbered by `all`.
class WindingJets {
  public:
    explicit WindingJets(std::vector<WindingTriangles::Corners> all);

    const WindingTriangles& triangles() const { return triangles_; }
    /// With derivatives or without.
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
