// Weights of moving least squares for neighbourhoods that are not symmetric.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <span>

namespace splitcubes::meshless {

/// Most links of a phyxel that balance_weights takes.
inline constexpr std::size_t max_balanced_links = 64;

/// Changes the weights of a phyxel's links so that their third moments, the sums of w_j x_a x_b x_c over the
/// links x, become small and their second moments stay about what they are. A first-order fit with such
/// weights finds the gradients of quadratic fields at the phyxel; without it the phyxels of a surface find
/// them at the centre of their one-sided neighbourhood, and bent bodies are too soft.
///
/// The weights become w_j (1 + p(x_j)), p a polynomial of the terms of degree 2 and 3, as in the corrected
/// kernels of reproducing kernel particle methods (Liu, Jun and Zhang 1995), with least squares of the
/// changes, weighted by w_j, of the third moments, and of the changes of the second moments. They stay above
/// a share of w_j, so that links neither end nor push. Moments that the links cannot change, as across a
/// single layer, keep their value. Linear fields are exact with any weights.
///
/// edge: m, rest space; weight: above zero, any unit; spacing: m, of the phyxels. Both lists have at most
/// max_balanced_links entries.
void balance_weights(std::span<const Vec3> edge, std::span<double> weight, double spacing);

}  // namespace splitcubes::meshless
