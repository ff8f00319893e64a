// Vectorised search for the nearest plane that a point faces.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Tangent planes of surface samples as structure of arrays. Memory is reused from list to list.
class PlaneLanes {
  public:
    /// Removes all planes and makes room for so many.
    void reset(std::size_t capacity);
    /// Appends a plane. position: m; normal: unit. Not more than the capacity.
    void add(const Vec3& position, const Vec3& normal);
    std::size_t size() const { return size_; }

    /// Computes all squared distances from the point (m), and returns the index of the nearest plane whose
    /// normal makes no acute angle with `outwards`; the first of several; size() if there is none. The result
    /// is the same on every processor.
    std::size_t find_nearest(const Vec3& point, const Vec3& outwards);
    /// Squared distances (m^2) from the last point to the positions of the planes.
    std::span<const double> squared_distances() const { return {squared_distances_.data(), size_}; }

  private:
    std::array<std::vector<double>, 6> lanes_;  // positions, normals; padded
    std::vector<double> squared_distances_;     // padded
    std::size_t size_ = 0;
};

}  // namespace splitcubes::body
