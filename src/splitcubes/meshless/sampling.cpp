#include <splitcubes/core/error.h>
#include <splitcubes/meshless/sampling.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>

namespace splitcubes::meshless {

namespace {

// Points in cells of a hash grid, so that points can be added while it is asked.
class GrowingGrid {
  public:
    explicit GrowingGrid(double cell_size) : cell_size_(cell_size) {}

    void add(const Vec3& point) {
        next_.push_back(-1);
        points_.push_back(point);
        const auto [cell, is_new] = head_.try_emplace(key(cell_of(point)), -1);
        next_.back() = cell->second;
        cell->second = static_cast<std::int64_t>(points_.size()) - 1;
    }
    /// radius <= cell_size
    bool any_within(const Vec3& point, double radius) const {
        const Cell center = cell_of(point);
        for (std::int64_t dz = -1; dz <= 1; ++dz)
            for (std::int64_t dy = -1; dy <= 1; ++dy)
                for (std::int64_t dx = -1; dx <= 1; ++dx) {
                    const auto cell = head_.find(key({center.x + dx, center.y + dy, center.z + dz}));
                    if (cell == head_.end()) continue;
                    for (std::int64_t k = cell->second; k >= 0; k = next_[static_cast<std::size_t>(k)])
                        if ((points_[static_cast<std::size_t>(k)] - point).squaredNorm() < radius * radius)
                            return true;
                }
        return false;
    }
    std::vector<Vec3> take() { return std::move(points_); }

  private:
    struct Cell {
        std::int64_t x, y, z;
    };
    Cell cell_of(const Vec3& point) const {
        const Vec3 cell = (point / cell_size_).array().floor();
        return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                static_cast<std::int64_t>(cell.z())};
    }
    // 21 bits an axis; cells further apart share a list, which costs time only.
    static std::uint64_t key(const Cell& cell) {
        constexpr std::uint64_t mask = (std::uint64_t{1} << 21) - 1;
        return (static_cast<std::uint64_t>(cell.x) & mask) |
               (static_cast<std::uint64_t>(cell.y) & mask) << 21 |
               (static_cast<std::uint64_t>(cell.z) & mask) << 42;
    }

    double cell_size_;
    std::vector<Vec3> points_;
    std::vector<std::int64_t> next_;                        // per point, next in its cell or -1
    std::unordered_map<std::uint64_t, std::int64_t> head_;  // per cell, its latest point
};

void check_input(const geometry::Box& box, double spacing, double cover_radius) {
    if (box.empty() || !box.min.allFinite() || !box.max.allFinite())
        throw InputError("sampling box", "is empty or not finite", "give the bounds of a solid");
    if (!(spacing > 0) || !std::isfinite(spacing))
        throw InputError("phyxel spacing", "is not positive (" + std::to_string(spacing) + ")",
                         "give a length in metres");
    if (!(cover_radius > 0) || !std::isfinite(cover_radius))
        throw InputError("cover radius", "is not positive (" + std::to_string(cover_radius) + ")",
                         "give a length in metres");
}

}  // namespace

std::vector<Vec3> sample_solid(const geometry::Box& box, double spacing,
                               const PlaceInMaterial& place_in_material, std::span<const Vec3> must_cover,
                               double cover_radius) {
    check_input(box, spacing, cover_radius);
    // A whole number of spacings gives that number of samples, despite rounding.
    const Vec3 counts = (box.size() / spacing - Vec3::Constant(1e-6)).array().ceil().max(1.0);
    if (counts.prod() > 0x1p27)
        throw InputError("phyxel spacing", "gives too many phyxels (" + std::to_string(spacing) + " m)",
                         "give a larger spacing");
    const Vec3i n = counts.cast<int>();
    const Vec3 low = box.center() - 0.5 * spacing * (counts - Vec3::Ones());
    GrowingGrid samples(std::max(0.5 * spacing, cover_radius));
    for (int z = 0; z < n.z(); ++z)
        for (int y = 0; y < n.y(); ++y)
            for (int x = 0; x < n.x(); ++x) {
                const Vec3 candidate = low + spacing * Vec3(x, y, z);
                const std::optional<Vec3> placed = place_in_material(candidate);
                if (placed && !samples.any_within(*placed, 0.5 * spacing)) samples.add(*placed);
            }
    for (const Vec3& point : must_cover)
        if (!samples.any_within(point, cover_radius)) samples.add(point);
    return samples.take();
}

}  // namespace splitcubes::meshless
