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
    // A hair more than the reach: what is within it is then never two cells on, nor three times it four.
    size_ = 1.0001 * reach;
    // At most about eight cells a point, whatever the points' spread.
    const double limit = 8.0 * static_cast<double>(points.size()) + 64;
    while (((extent / size_).array().floor() + 1).prod() > limit) size_ *= 1.5;
    count_ = (extent / size_).array().floor().cast<int>() + 1;
}

// Ors each cell's directions with those of its 26 neighbours, axis by axis.
void SkinGrid::spread_bins(std::span<const std::uint64_t> from, std::vector<std::uint64_t>& to) {
    to.assign(from.begin(), from.end());
    spare_.resize(from.size());
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<std::size_t>(count_[axis]);
        for (std::size_t base = 0; base < to.size(); base += stride * length)
            for (std::size_t at = 0; at < length; ++at) {
                const std::size_t low = at > 0 ? stride : 0, high = at + 1 < length ? stride : 0;
                const std::size_t first = base + at * stride;
                for (std::size_t c = first; c < first + stride; ++c)
                    spare_[c] = to[c - low] | to[c] | to[c + high];
            }
        to.swap(spare_);
        stride *= length;
    }
}

void SkinGrid::build(std::span<const Vec3> points, std::span<const Vec3> normals, double reach,
                     double farthest) {
    points_ = points;
    normals_ = normals;
    lay_out(points, reach);
    const std::size_t cells = cell_index(0, 0, count_.z());
    begin_.assign(cells + 1, 0);
    around_[0].assign(cells, 0);
    cell_.resize(points.size());
    bin_.resize(points.size());
    entries_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3i at = cell_at(points[i]);
        const std::size_t cell = cell_index(at.x(), at.y(), at.z());
        cell_[i] = static_cast<std::uint32_t>(cell);
        bin_[i] = bin_of(normals[i]);
        around_[0][cell] |= std::uint64_t{1} << bin_[i];
        ++begin_[cell + 1];
    }
    for (std::size_t c = 0; c < cells; ++c) begin_[c + 1] += begin_[c];
    next_.assign(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i)
        entries_[next_[cell_[i]]++] = {points[i], normals[i], static_cast<std::uint32_t>(i)};
    for (std::size_t ring = 1; ring <= most_rings; ++ring) {
        spread_bins(around_[ring - 1], around_[ring]);
        if (farthest <= static_cast<double>(ring) * size_) break;
    }
}

}  // namespace splitcubes::body
