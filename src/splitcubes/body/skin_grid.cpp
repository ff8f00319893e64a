#include <splitcubes/body/facing_lanes.h>
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

// What is absurdly far is told apart in double precision only.
float to_float(double value) {
    constexpr double most = 1e30;
    return static_cast<float>(std::clamp(value, -most, most));
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
    extent_ = extent.maxCoeff();
    // A hair more than the reach: what is within it is then never two cells on, nor three times it four.
    size_ = 1.0001 * reach;
    // At most about eight cells a point, whatever the points' spread.
    const double limit = 8.0 * static_cast<double>(points.size()) + 64;
    while (((extent / size_).array().floor() + 1).prod() > limit) size_ *= 1.5;
    count_ = (extent / size_).array().floor().cast<int>() + 1;
}

// Adds to each cell's normals those of its 26 neighbours, axis by axis.
void SkinGrid::spread(std::span<const Around> from, std::vector<Around>& to, const Parallel& parallel) {
    constexpr std::size_t grain = 2048;
    to.assign(from.begin(), from.end());
    spare_.resize(from.size());
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<std::size_t>(count_[axis]);
        parallel.for_each(to.size(), grain, [&](std::size_t c) {
            const std::size_t at = c / stride % length;
            spare_[c] = to[c];
            if (at > 0) spare_[c].add(to[c - stride]);
            if (at + 1 < length) spare_[c].add(to[c + stride]);
        });
        to.swap(spare_);
        stride *= length;
    }
}

// By cells, and those of a cell in order of their numbers.
void SkinGrid::sort_points(std::span<const Vec3> points, std::span<const Vec3> normals,
                           const Parallel& parallel) {
    constexpr std::size_t grain = 256;
    const std::size_t count = points.size();
    cell_.resize(count);
    number_.resize(count);
    sorted_.resize(count);
    for (std::vector<float>& lane : lanes_) lane.resize(count + facing_padding);
    parallel.for_each(count, grain, [&](std::size_t i) {
        const Vec3i at = cell_at(points[i]);
        cell_[i] = static_cast<std::uint32_t>(cell_index(at.x(), at.y(), at.z()));
    });
    for (std::size_t i = 0; i < count; ++i) ++begin_[cell_[i] + 1];
    for (std::size_t c = 0; c + 1 < begin_.size(); ++c) begin_[c + 1] += begin_[c];
    next_.assign(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < count; ++i) number_[next_[cell_[i]]++] = static_cast<std::uint32_t>(i);
    parallel.for_each(count, grain, [&](std::size_t k) {
        const std::uint32_t i = number_[k];
        const Vec3 &point = points[i], &normal = normals[i];
        sorted_[k] = {point, normal, cell_[i], bin_of(normal)};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<Eigen::Index>(axis);
            lanes_[axis][k] = to_float(point[a] - origin_[a]);
            lanes_[3 + axis][k] = static_cast<float>(normal[a]);
        }
    });
}

void SkinGrid::build(std::span<const Vec3> points, std::span<const Vec3> normals, double reach,
                     double farthest, const Parallel& parallel) {
    constexpr std::size_t grain = 256;
    lay_out(points, reach);
    const std::size_t cells = cell_index(0, 0, count_.z());
    begin_.assign(cells + 1, 0);
    sort_points(points, normals, parallel);
    around_[0].resize(cells);
    parallel.for_each(cells, grain, [&](std::size_t c) {
        Around& own = around_[0][c] = {};
        for (std::uint32_t k = begin_[c]; k < begin_[c + 1]; ++k) {
            own.bins |= std::uint64_t{1} << sorted_[k].bin;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                own.low[axis] = std::min(own.low[axis], lanes_[3 + axis][k]);
                own.high[axis] = std::max(own.high[axis], lanes_[3 + axis][k]);
            }
        }
    });
    for (std::size_t ring = 1; ring <= most_rings; ++ring) {
        spread(around_[ring - 1], around_[ring], parallel);
        if (farthest <= static_cast<double>(ring) * size_) break;
    }
}

void SkinGrid::find_facing(std::size_t of, double radius, double height, std::vector<std::uint32_t>& scratch,
                           std::vector<Faced>& out) const {
    constexpr std::size_t most_ranges = (2 * most_rings + 2) * (2 * most_rings + 2);
    out.clear();
    const Vec3 point = sorted_[of].point, normal = sorted_[of].normal;
    const Vec3i low = cell_at(point - Vec3::Constant(radius)), high = cell_at(point + Vec3::Constant(radius));
    std::array<FacingRange, most_ranges> ranges;
    std::size_t count = 0, most = 0;
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y() && count < most_ranges; ++y) {
            const FacingRange range{begin_[cell_index(low.x(), y, z)],
                                    begin_[cell_index(high.x(), y, z) + 1]};
            if (range.begin == range.end) continue;
            ranges[count++] = range;
            most += range.end - range.begin;
        }
    if (count == 0) return;
    // More than what single precision loses of places, and of unit vectors' products.
    const double slack = 1e-6 * extent_ + 1e-5 * radius;
    const Vec3 at = point - origin_;
    const Vec3f facing = normal.cast<float>();
    const FacingQuery query{to_float(at.x()),
                            to_float(at.y()),
                            to_float(at.z()),
                            facing.x(),
                            facing.y(),
                            facing.z(),
                            to_float((radius + slack) * (radius + slack)),
                            static_cast<float>(facing_cosine + 1e-5),
                            to_float(height + slack)};
    const FacingLanes lanes{lanes_[0].data(), lanes_[1].data(), lanes_[2].data(),
                            lanes_[3].data(), lanes_[4].data(), lanes_[5].data()};
    // Grows only: what is in it is written anew.
    if (scratch.size() < most + facing_padding) scratch.resize(most + facing_padding);
    bool is_low = false;
    const std::size_t found = select_facing(lanes, {ranges.data(), count}, query, scratch.data(), is_low);
    if (!is_low) return;
    for (std::size_t n = 0; n < found; ++n) {
        const Point& other = sorted_[scratch[n]];
        const Vec3 way = point - other.point;
        const double square = way.squaredNorm(), cosine = normal.dot(other.normal);
        if (square < radius * radius && cosine < facing_cosine)
            out.push_back({scratch[n], square, cosine, other.normal.dot(way)});
    }
}

}  // namespace splitcubes::body
