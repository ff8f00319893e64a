#include <splitcubes/body/contact_sides.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

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

std::size_t SideBetween::slot_of(std::uint32_t phyxel) const {
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = phyxel * 0x9e3779b9U >> 7 & mask;
    while (table_[slot] != 0 && shares_[table_[slot] - 1].phyxel != phyxel) slot = (slot + 1) & mask;
    return slot;
}

void SideBetween::grow_table() {
    table_.assign(std::max<std::size_t>(2 * table_.size(), 256), 0);
    for (std::uint32_t k = 0; k < shares_.size(); ++k) {
        shares_[k].slot = static_cast<std::uint32_t>(slot_of(shares_[k].phyxel));
        table_[shares_[k].slot] = k + 1;
    }
}

void SideBetween::add(const ContactSide& side, double weight) {
    part_ = side.part;
    for (std::uint32_t k = 0; k < side.count; ++k) {
        if (2 * (shares_.size() + 1) > table_.size()) grow_table();
        const std::size_t slot = slot_of(side.phyxel[k]);
        if (table_[slot] == 0) {
            shares_.push_back({side.phyxel[k], static_cast<std::uint32_t>(slot), 0});
            table_[slot] = static_cast<std::uint32_t>(shares_.size());
        }
        shares_[table_[slot] - 1].weight += weight * std::max(0.0, side.weight[k]);
    }
}

ContactSide SideBetween::take(std::span<const Vec3> rest, const Vec3& place, double spacing) {
    ContactSide out;
    out.part = part_;
    double total = 0;
    // The heaviest in order, of equal ones the first phyxel.
    for (const Share& share : shares_) {
        total += share.weight;
        table_[share.slot] = 0;
        std::uint32_t at = out.count;
        while (at > 0 && (out.weight[at - 1] < share.weight ||
                          (out.weight[at - 1] == share.weight && out.phyxel[at - 1] > share.phyxel)))
            --at;
        if (at >= ContactSide::most) continue;
        if (out.count < ContactSide::most) ++out.count;
        for (std::uint32_t k = out.count - 1; k > at; --k) {
            out.phyxel[k] = out.phyxel[k - 1];
            out.weight[k] = out.weight[k - 1];
        }
        out.phyxel[at] = share.phyxel;
        out.weight[at] = share.weight;
    }
    shares_.clear();
    if (out.count == 0) return out;
    while (out.count > 1 && !(out.weight[out.count - 1] > least_weight * total)) --out.count;
    double kept = 0;
    for (std::uint32_t k = 0; k < out.count; ++k) kept += out.weight[k];
    for (std::uint32_t k = 0; k < out.count; ++k)
        out.weight[k] = kept > 0 ? out.weight[k] / kept : 1.0 / out.count;
    carry_exactly(rest, place, spacing, out);
    return out;
}

}  // namespace splitcubes::body
