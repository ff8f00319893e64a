#include <splitcubes/contact/detection/contact_sides.h>
#include <splitcubes/contact/detection/tuning.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>

namespace splitcubes::body {

using meshless::ContactSide;

namespace {

constexpr std::size_t min_slot_count = 256;  // a power of two

}  // namespace

void reproduce_affine_motion(std::span<const Vec3> rest, const Vec3& rest_point, double spacing,
                             ContactSide& side) {
    std::array<Vec3, ContactSide::max_phyxels> arm;
    Vec3 centre = Vec3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) {
        arm[k] = rest[side.phyxel[k]];
        centre += side.weight[k] * arm[k];
    }
    Mat3 spread = Mat3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) {
        arm[k] -= centre;
        spread += side.weight[k] * arm[k] * arm[k].transpose();
    }
    // In squared spacings. Each eigenvalue s contributes s / (s^2 + min_spread^2) instead of 1 / s
    // (Tikhonov regularisation), as one matrix that needs no eigenvectors.
    spread /= spacing * spacing;
    const Mat3 damped =
        spread * spread + tuning::samples::min_spread * tuning::samples::min_spread * Mat3::Identity();
    const Vec3 slope = spread * (damped.inverse() * (rest_point - centre)) / (spacing * spacing);
    for (std::uint32_t k = 0; k < side.count; ++k) side.weight[k] *= 1 + slope.dot(arm[k]);
}

void SideBlend::add(const ContactSide& side, double weight) {
    part_ = side.part;
    for (std::uint32_t k = 0; k < side.count; ++k) {
        if (!(side.weight[k] > 0)) continue;
        if (shares_.size() >= capacity()) reserve(shares_.size() + 1);
        const std::size_t at = slot_of(side.phyxel[k]);
        Slot& slot = slots_[at];
        if (slot.share == 0) {
            shares_.push_back({side.phyxel[k], static_cast<std::uint32_t>(at), 0});
            slot = {side.phyxel[k], static_cast<std::uint32_t>(shares_.size())};
        }
        shares_[slot.share - 1].weight += weight * side.weight[k];
    }
}

// Returns the slot of a phyxel, or the empty slot where it belongs.
std::size_t SideBlend::slot_of(std::uint32_t phyxel) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = phyxel & mask;
    while (slots_[at].share != 0 && slots_[at].phyxel != phyxel) at = (at + 1) & mask;
    return at;
}

void SideBlend::reserve(std::size_t phyxel_count) {
    if (phyxel_count <= capacity()) return;
    slots_.assign(std::max(min_slot_count, std::bit_ceil(2 * phyxel_count)), {});
    shares_.reserve(capacity());
    for (std::uint32_t k = 0; k < shares_.size(); ++k) {
        const std::size_t at = slot_of(shares_[k].phyxel);
        slots_[at] = {shares_[k].phyxel, k + 1};
        shares_[k].slot = static_cast<std::uint32_t>(at);
    }
}

ContactSide SideBlend::take(std::span<const Vec3> rest, const Vec3& rest_point, double spacing) {
    ContactSide out;
    out.part = part_;
    double total = 0;
    // The largest weights in descending order; of equal ones the smaller phyxel index first.
    for (const Share& share : shares_) {
        total += share.weight;
        std::uint32_t at = out.count;
        while (at > 0 && (out.weight[at - 1] < share.weight ||
                          (out.weight[at - 1] == share.weight && out.phyxel[at - 1] > share.phyxel)))
            --at;
        if (at >= ContactSide::max_phyxels) continue;
        if (out.count < ContactSide::max_phyxels) ++out.count;
        for (std::uint32_t k = out.count - 1; k > at; --k) {
            out.phyxel[k] = out.phyxel[k - 1];
            out.weight[k] = out.weight[k - 1];
        }
        out.phyxel[at] = share.phyxel;
        out.weight[at] = share.weight;
    }
    for (const Share& share : shares_) slots_[share.slot] = {};
    shares_.clear();
    if (out.count == 0) return out;
    while (out.count > 1 && !(out.weight[out.count - 1] > tuning::samples::min_weight_share * total))
        --out.count;
    double kept = 0;
    for (std::uint32_t k = 0; k < out.count; ++k) kept += out.weight[k];
    for (std::uint32_t k = 0; k < out.count; ++k)
        out.weight[k] = kept > 0 ? out.weight[k] / kept : 1.0 / out.count;
    reproduce_affine_motion(rest, rest_point, spacing, out);
    return out;
}

}  // namespace splitcubes::body
