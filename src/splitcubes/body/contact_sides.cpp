#include <splitcubes/body/contact_sides.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdint>
#include <tuple>
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

void SideBetween::add(const ContactSide& side, double weight) {
    part_ = side.part;
    for (std::uint32_t k = 0; k < side.count; ++k)
        shares_.push_back({side.phyxel[k], static_cast<std::uint32_t>(shares_.size()),
                           weight * std::max(0.0, side.weight[k])});
}

ContactSide SideBetween::take(std::span<const Vec3> rest, const Vec3& place, double spacing) {
    // Sums in the order of adding, whatever sorts.
    std::sort(shares_.begin(), shares_.end(), [](const Share& a, const Share& b) {
        return std::tie(a.phyxel, a.number) < std::tie(b.phyxel, b.number);
    });
    std::size_t count = 0;
    double total = 0;
    for (const Share& share : shares_) {
        total += share.weight;
        if (count > 0 && shares_[count - 1].phyxel == share.phyxel)
            shares_[count - 1].weight += share.weight;
        else
            shares_[count++] = share;
    }
    shares_.resize(count);
    std::sort(shares_.begin(), shares_.end(), [](const Share& a, const Share& b) {
        return a.weight != b.weight ? a.weight > b.weight : a.phyxel < b.phyxel;
    });
    ContactSide out;
    out.part = part_;
    double kept = 0;
    for (const Share& share : shares_) {
        if (out.count >= ContactSide::most) break;
        if (out.count > 0 && !(share.weight > least_weight * total)) break;
        out.phyxel[out.count] = share.phyxel;
        out.weight[out.count++] = share.weight;
        kept += share.weight;
    }
    shares_.clear();
    if (out.count == 0) return out;
    for (std::uint32_t k = 0; k < out.count; ++k)
        out.weight[k] = kept > 0 ? out.weight[k] / kept : 1.0 / out.count;
    carry_exactly(rest, place, spacing, out);
    return out;
}

}  // namespace splitcubes::body
