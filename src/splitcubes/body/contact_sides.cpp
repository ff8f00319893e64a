#include <splitcubes/body/contact_sides.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

using meshless::ContactSide;

namespace {

// Spread of a side's phyxels along a direction, in squared spacings, below which nothing is
// extrapolated along it.
constexpr double least_spread = 0.005;
// Of a phyxel among those of several sides: smaller weights carry nothing.
constexpr double least_weight = 1e-6;

}  // namespace

void carry_exactly(std::span<const Vec3> rest, const Vec3& place, double spacing, ContactSide& side) {
    Vec3 centre = Vec3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) centre += side.weight[k] * rest[side.phyxel[k]];
    Mat3 spread = Mat3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) {
        const Vec3 arm = rest[side.phyxel[k]] - centre;
        spread += side.weight[k] * arm * arm.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
    const double least = least_spread * spacing * spacing;
    Vec3 slope = Vec3::Zero();
    for (int a = 0; a < 3; ++a) {
        const double along = axes.eigenvalues()[a];
        const Vec3 axis = axes.eigenvectors().col(a);
        slope += along / (along * along + least * least) * axis.dot(place - centre) * axis;
    }
    for (std::uint32_t k = 0; k < side.count; ++k)
        side.weight[k] *= 1 + slope.dot(rest[side.phyxel[k]] - centre);
}

ContactSide side_between(std::span<const ContactSide> sides, std::span<const double> weights,
                         std::span<const Vec3> rest, const Vec3& place, double spacing) {
    struct Share {
        std::uint32_t phyxel;
        double weight;
    };
    std::vector<Share> shares;
    for (std::size_t s = 0; s < sides.size(); ++s)
        for (std::uint32_t k = 0; k < sides[s].count; ++k)
            shares.push_back({sides[s].phyxel[k], weights[s] * std::max(0.0, sides[s].weight[k])});
    std::stable_sort(shares.begin(), shares.end(),
                     [](const Share& a, const Share& b) { return a.phyxel < b.phyxel; });
    std::size_t count = 0;
    double total = 0;
    for (const Share& share : shares) {
        total += share.weight;
        if (count > 0 && shares[count - 1].phyxel == share.phyxel)
            shares[count - 1].weight += share.weight;
        else
            shares[count++] = share;
    }
    shares.resize(count);
    std::stable_sort(shares.begin(), shares.end(),
                     [](const Share& a, const Share& b) { return a.weight > b.weight; });
    ContactSide out;
    out.part = sides[0].part;
    double kept = 0;
    for (const Share& share : shares) {
        if (out.count >= ContactSide::most || !(share.weight > least_weight * total)) break;
        out.phyxel[out.count] = share.phyxel;
        out.weight[out.count++] = share.weight;
        kept += share.weight;
    }
    if (out.count == 0) return sides[0];
    for (std::uint32_t k = 0; k < out.count; ++k) out.weight[k] /= kept;
    carry_exactly(rest, place, spacing, out);
    return out;
}

}  // namespace splitcubes::body
