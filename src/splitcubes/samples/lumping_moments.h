// Correction of lumping shares so that they preserve the moments of the nodes' mass.
#pragma once

#include <splitcubes/samples/phyxels.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Corrects rows of shares. Each thread needs its own.
class LumpingMoments {
  public:
    /// Changes the shares of a node, which are > 0 and sum to 1, so that the phyxels of the row
    /// reproduce the node's volume, centre and second moments: sum_i s_i q(x_i - x_node) = q(0) for all
    /// quadratic q (reproducing conditions; Liu, Jun and Zhang 1995), as closely as the row's phyxels permit.
    /// A piece's centre of mass and moments of inertia are then independent of its phyxels, so that a split
    /// neither moves the pieces nor changes their angular velocity. Shares can become negative.
    void keep(const Vec3& node, const Phyxels& phyxels, std::span<const std::uint32_t> phyxel,
              std::span<double> share);

  private:
    static constexpr std::size_t count = 9;  // linear and quadratic monomials
    /// Monomials, padded so that sums over them fill vectors.
    using Moments = std::array<double, count + 1>;
    using Products = std::array<Moments, count>;

    static bool solve_damped(const Moments& mean, Products& product, Moments& change);
    void apply(const Moments& mean, const Moments& change, std::span<double> share);

    std::vector<Moments> at_;      // per entry of the row, the monomials of its phyxel
    std::vector<double> factors_;  // per entry
};

}  // namespace splitcubes::meshless
