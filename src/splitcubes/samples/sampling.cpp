#include <splitcubes/core/error.h>
#include <splitcubes/samples/sampling.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

namespace splitcubes::meshless {

namespace {

// Grid of points over a box that allows insertion between queries. Points outside the box go to the nearest
// boundary cell.
class GrowingGrid {
  public:
    GrowingGrid(const geometry::Box& box, double cell_size) : origin_(box.min), cell_size_(cell_size) {
        const auto cells = [&] { return Vec3((box.size() / cell_size_).array().floor() + 1); };
        while (cells().prod() > tuning::sampling::max_grid_cells) cell_size_ *= 1.5;
        count_ = cells().cast<int>();
        head_.assign(static_cast<std::size_t>(count_.prod()), -1);
    }

    void add(const Vec3& point) {
        std::int32_t& head = head_[index(cell_of(point))];
        next_.push_back(head);
        head = static_cast<std::int32_t>(points_.size());
        points_.push_back(point);
    }
    /// radius <= cell_size
    bool any_within(const Vec3& point, double radius) const {
        const Vec3i low = cell_of(point - Vec3::Constant(radius)),
                    high = cell_of(point + Vec3::Constant(radius));
        for (int z = low.z(); z <= high.z(); ++z)
            for (int y = low.y(); y <= high.y(); ++y)
                for (int x = low.x(); x <= high.x(); ++x)
                    for (std::int32_t k = head_[index({x, y, z})]; k >= 0;
                         k = next_[static_cast<std::size_t>(k)])
                        if ((points_[static_cast<std::size_t>(k)] - point).squaredNorm() < radius * radius)
                            return true;
        return false;
    }
    std::vector<Vec3> take() { return std::move(points_); }

  private:
    Vec3i cell_of(const Vec3& point) const {
        const Vec3 cell = ((point - origin_) / cell_size_).array().floor();
        return cell.cwiseMax(Vec3::Zero()).cwiseMin((count_ - Vec3i::Ones()).cast<double>()).cast<int>();
    }
    std::size_t index(const Vec3i& cell) const {
        return (static_cast<std::size_t>(cell.z()) * static_cast<std::size_t>(count_.y()) +
                static_cast<std::size_t>(cell.y())) *
                   static_cast<std::size_t>(count_.x()) +
               static_cast<std::size_t>(cell.x());
    }

    Vec3 origin_;
    double cell_size_;
    Vec3i count_;
    std::vector<Vec3> points_;
    std::vector<std::int32_t> next_;  // per point, next in its cell or -1
    std::vector<std::int32_t> head_;  // per cell, its latest point
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
                               const ProjectIntoMaterial& place_in_material, std::span<const Vec3> must_cover,
                               double cover_radius, const Parallel& parallel) {
    check_input(box, spacing, cover_radius);
    // A whole number of spacings gives that number of samples, despite rounding.
    const Vec3 counts = (box.size() / spacing - Vec3::Constant(1e-6)).array().ceil().max(1.0);
    if (counts.prod() > 0x1p27)
        throw InputError("phyxel spacing", "gives too many phyxels (" + std::to_string(spacing) + " m)",
                         "give a larger spacing");
    const Vec3i n = counts.cast<int>();
    const Vec3 low = box.center() - 0.5 * spacing * (counts - Vec3::Ones());
    GrowingGrid samples(box, std::max(0.5 * spacing, cover_radius));
    const auto lattice_size = static_cast<std::size_t>(n.prod());
    const auto nx = static_cast<std::size_t>(n.x()), ny = static_cast<std::size_t>(n.y());
    constexpr std::size_t grain = 256;
    std::vector<std::optional<Vec3>> placed(std::min(lattice_size, tuning::sampling::batch_size));
    for (std::size_t first = 0; first < lattice_size; first += tuning::sampling::batch_size) {
        const std::size_t count = std::min(lattice_size - first, tuning::sampling::batch_size);
        parallel.for_each(count, grain, [&](std::size_t k) {
            const std::size_t i = first + k;
            const Vec3 lattice_point(static_cast<double>(i % nx), static_cast<double>(i / nx % ny),
                                     static_cast<double>(i / nx / ny));
            placed[k] = place_in_material(low + spacing * lattice_point);
        });
        for (std::size_t k = 0; k < count; ++k)
            if (placed[k] && !samples.any_within(*placed[k], 0.5 * spacing)) samples.add(*placed[k]);
    }
    // Covered points stay covered: only the others are tested again, in order.
    std::vector<std::uint8_t> covered(must_cover.size());
    parallel.for_each(must_cover.size(), grain,
                      [&](std::size_t k) { covered[k] = samples.any_within(must_cover[k], cover_radius); });
    for (std::size_t k = 0; k < must_cover.size(); ++k)
        if (covered[k] == 0 && !samples.any_within(must_cover[k], cover_radius)) samples.add(must_cover[k]);
    return samples.take();
}

}  // namespace splitcubes::meshless
