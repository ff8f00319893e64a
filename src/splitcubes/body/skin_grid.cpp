#include <splitcubes/body/skin_grid.h>
#include <splitcubes/geometry/box.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

// Corner (u, v in [-1, 1]) of a cube's side as a direction.
Vec3 on_side(std::size_t side, double u, double v) {
    const auto axis = static_cast<int>(side / 2);
    Vec3 out;
    out[axis] = side % 2 == 0 ? 1 : -1;
    out[(axis + 1) % 3] = u;
    out[(axis + 2) % 3] = v;
    return out.normalized();
}

int third(double share) {
    return share < -1.0 / 3 ? 0 : share > 1.0 / 3 ? 2 : 1;
}

}  // namespace

std::uint8_t SkinGrid::bin_of(const Vec3& normal) {
    int axis = 0;
    const double main = normal.cwiseAbs().maxCoeff(&axis);
    const int side = 2 * axis + (normal[axis] < 0);
    const int u = third(normal[(axis + 1) % 3] / main), v = third(normal[(axis + 2) % 3] / main);
    return static_cast<std::uint8_t>(9 * side + 3 * v + u);
}

// Per solid angle those that hold a direction which faces one of its own: the angle between the
// middles and both half widths reach beyond the limit.
const std::array<std::uint64_t, SkinGrid::bin_count>& SkinGrid::facing_bins() {
    static const auto table = [] {
        std::array<Vec3, bin_count> middle;
        std::array<double, bin_count> width{};
        for (std::size_t b = 0; b < bin_count; ++b) {
            const double u = static_cast<double>(b % 3) * 2 / 3 - 2.0 / 3;
            const double v = static_cast<double>(b / 3 % 3) * 2 / 3 - 2.0 / 3;
            middle[b] = on_side(b / 9, u, v);
            for (const double du : {-1.0 / 3, 1.0 / 3})
                for (const double dv : {-1.0 / 3, 1.0 / 3})
                    width[b] = std::max(
                        width[b],
                        std::acos(std::clamp(middle[b].dot(on_side(b / 9, u + du, v + dv)), -1.0, 1.0)));
        }
        std::array<std::uint64_t, bin_count> out{};
        for (std::size_t a = 0; a < bin_count; ++a)
            for (std::size_t b = 0; b < bin_count; ++b) {
                const double angle = std::acos(std::clamp(middle[a].dot(middle[b]), -1.0, 1.0));
                if (angle + width[a] + width[b] > std::acos(facing_cosine) - 1e-6)
                    out[a] |= std::uint64_t{1} << b;
            }
        return out;
    }();
    return table;
}

// Clamped as numbers, so that neither a far point nor one that is none overflows.
Vec3i SkinGrid::cell_at(const Vec3& point) const {
    Vec3i cell;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (point[axis] - origin_[axis]) / size_;
        cell[axis] = at > 0 ? static_cast<int>(std::min<double>(at, count_[axis] - 1)) : 0;
    }
    return cell;
}

void SkinGrid::lay_out(std::span<const Vec3> points, double reach) {
    geometry::Box box;
    for (const Vec3& point : points)
        if (point.allFinite()) box.add(point);
    origin_ = box.empty() ? Vec3(Vec3::Zero()) : box.min;
    const Vec3 extent = box.empty() ? Vec3(Vec3::Zero()) : Vec3(box.size());
    // A hair more than the reach: what is within it is then never two cells on.
    size_ = 1.0001 * reach;
    // At most about eight cells a point, whatever the points' spread.
    const double limit = 8.0 * static_cast<double>(points.size()) + 64;
    while (((extent / size_).array().floor() + 1).prod() > limit) size_ *= 1.5;
    count_ = (extent / size_).array().floor().cast<int>() + 1;
}

// Ors each cell's directions with those of its 26 neighbours, axis by axis.
void SkinGrid::spread_bins() {
    spare_.resize(around_.size());
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<std::size_t>(count_[axis]);
        for (std::size_t c = 0; c < around_.size(); ++c) {
            const std::size_t at = c / stride % length;
            spare_[c] =
                around_[c] | (at > 0 ? around_[c - stride] : 0) | (at + 1 < length ? around_[c + stride] : 0);
        }
        around_.swap(spare_);
        stride *= length;
    }
}

void SkinGrid::build(std::span<const Vec3> points, std::span<const Vec3> normals, double reach) {
    points_ = points;
    normals_ = normals;
    lay_out(points, reach);
    const std::size_t cells = cell_index(0, 0, count_.z());
    begin_.assign(cells + 1, 0);
    around_.assign(cells, 0);
    cell_.resize(points.size());
    bin_.resize(points.size());
    entries_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3i at = cell_at(points[i]);
        const std::size_t cell = cell_index(at.x(), at.y(), at.z());
        cell_[i] = static_cast<std::uint32_t>(cell);
        bin_[i] = bin_of(normals[i]);
        around_[cell] |= std::uint64_t{1} << bin_[i];
        ++begin_[cell + 1];
    }
    for (std::size_t c = 0; c < cells; ++c) begin_[c + 1] += begin_[c];
    next_.assign(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i)
        entries_[next_[cell_[i]]++] = {points[i], normals[i], static_cast<std::uint32_t>(i)};
    spread_bins();
}

}  // namespace splitcubes::body
