#include <splitcubes/fracture/strength_field.h>
#include <splitcubes/fracture/tuning.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace splitcubes::body {

StrengthField::StrengthField(const TearSettings& settings, const splitting::NodeGrid& grid)
    : settings_(settings), cell_size_(grid.rest().cell_size) {
    if (!settings_.strength_factor) return;
    min_factor_ = std::numeric_limits<double>::infinity();
    for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick)
        for (std::uint64_t word = grid.inside_word(brick); word; word &= word - 1) {
            const auto local = static_cast<unsigned>(std::countr_zero(word));
            const Vec3i node = grid.bricks().base(brick) + splitting::BrickLayout::local_node(local);
            min_factor_ = std::min(min_factor_, settings_.strength_factor(grid.rest().node_position(node)));
        }
}

// From the second moments of the weakness (strongest over own strength, minus 1) at the grid points within
// the radius.
std::optional<WeakPlane> StrengthField::weak_plane_at(const Vec3& rest) const {
    if (!settings_.strength_factor) return std::nullopt;
    constexpr int radius = tuning::tearing::weak_plane_radius;
    std::vector<std::pair<Vec3, double>> samples;
    double strongest = 0;
    for (int z = -radius; z <= radius; ++z)
        for (int y = -radius; y <= radius; ++y)
            for (int x = -radius; x <= radius; ++x) {
                if (x * x + y * y + z * z > radius * radius) continue;
                const Vec3 offset = cell_size_ * Vec3(x, y, z);
                samples.emplace_back(offset, settings_.strength_factor(rest + offset));
                strongest = std::max(strongest, samples.back().second);
            }
    double total = 0, weakest = strongest;
    Vec3 mean = Vec3::Zero();
    Mat3 moment = Mat3::Zero();
    for (const auto& [offset, factor] : samples) {
        weakest = std::min(weakest, factor);
        const double weakness = strongest / std::max(factor, 1e-9 * strongest) - 1;
        total += weakness;
        mean += weakness * offset;
        moment += weakness * offset * offset.transpose();
    }
    if (!(weakest < 0.8 * strongest)) return std::nullopt;
    mean /= total;
    const SymmetricEigen eigen = eigen_symmetric(moment / total - mean * mean.transpose());
    if (!(eigen.values[2] < 0.6 * eigen.values[1])) return std::nullopt;
    return WeakPlane{rest + mean, eigen.vectors.col(2)};
}

}  // namespace splitcubes::body
