// Seams: planes along which a material of uneven strength is weak.
#include <splitcubes/body/tearing.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>

namespace splitcubes::body {

// The plane along which the material around a place is weak, if it is so along a
// plane: by the moments of the weakness over the nodes around.
std::optional<Tearing::Plane> Tearing::weak_plane_at(const Vec3& rest) const {
    if (!settings_.strength_factor) return std::nullopt;
    constexpr int around = 3;  // cells
    std::vector<std::pair<Vec3, double>> samples;
    double strongest = 0;
    for (int z = -around; z <= around; ++z)
        for (int y = -around; y <= around; ++y)
            for (int x = -around; x <= around; ++x) {
                if (x * x + y * y + z * z > around * around) continue;
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
    return Plane{rest + mean, eigen.vectors.col(2)};
}

}  // namespace splitcubes::body
