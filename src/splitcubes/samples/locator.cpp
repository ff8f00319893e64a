#include <splitcubes/geometry/box.h>
#include <splitcubes/samples/locator.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace splitcubes::meshless {

PhyxelLocator::PhyxelLocator(std::span<const Vec3> points, double cell_size)
    : points_(points.begin(), points.end()), cell_size_(cell_size) {
    assert(cell_size > 0 && std::isfinite(cell_size));
    if (points.empty()) {
        begin_.assign(1, 0);
        return;
    }
    geometry::Box box;
    for (const Vec3& point : points) box.add(point);
    origin_ = box.min;
    // At most about eight cells per point, whatever their spread.
    const double limit = 8.0 * static_cast<double>(points.size()) + 64;
    const auto cells = [&] { return Vec3((box.size() / cell_size_).array().floor() + 1); };
    while (cells().prod() > limit) cell_size_ *= 1.5;
    count_ = cells().cast<int>();
    const std::size_t cell_count = cell_index(0, 0, count_.z());
    begin_.assign(cell_count + 1, 0);
    const auto index_of = [&](const Vec3& point) {
        const Vec3i cell = cell_of(point);
        return cell_index(cell.x(), cell.y(), cell.z());
    };
    for (const Vec3& point : points_) ++begin_[index_of(point) + 1];
    for (std::size_t c = 0; c < cell_count; ++c) begin_[c + 1] += begin_[c];
    indices_.resize(points_.size());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < points_.size(); ++i)
        indices_[next[index_of(points_[i])]++] = static_cast<std::uint32_t>(i);
}

Vec3i PhyxelLocator::cell_of(const Vec3& point) const {
    const Vec3 cell = ((point - origin_) / cell_size_).array().floor();
    // Clamped before the cast: a far point would overflow an int.
    return cell.cwiseMax(Vec3::Zero()).cwiseMin((count_ - Vec3i::Ones()).cast<double>()).cast<int>();
}

void PhyxelLocator::near(const Vec3& point, double radius, std::vector<std::uint32_t>& out) const {
    out.clear();
    visit(point, radius, [&](std::uint32_t index) {
        out.push_back(index);
        return true;
    });
    std::sort(out.begin(), out.end());
}

void PhyxelLocator::nearest(const Vec3& point, std::size_t count, std::vector<std::uint32_t>& out) const {
    out.clear();
    if (points_.empty() || count == 0) return;
    const std::size_t wanted = std::min(count, points_.size());
    const auto gather = [&](double radius) {
        out.clear();
        visit(point, radius, [&](std::uint32_t index) {
            out.push_back(index);
            return true;
        });
    };
    double radius = cell_size_;
    // The search ends with a radius that reaches every point.
    const Vec3 extent = count_.cast<double>() * cell_size_;
    const double all = (point - origin_).norm() + extent.norm() + cell_size_;
    for (gather(radius); out.size() < wanted && radius <= all; gather(radius)) radius *= 2;
    const auto closer = [&](std::uint32_t a, std::uint32_t b) {
        const double to_a = (points_[a] - point).squaredNorm();
        const double to_b = (points_[b] - point).squaredNorm();
        return std::make_pair(to_a, a) < std::make_pair(to_b, b);
    };
    const std::size_t kept = std::min(wanted, out.size());
    std::partial_sort(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(kept), out.end(), closer);
    out.resize(kept);
}

}  // namespace splitcubes::meshless
