#include <splitcubes/contact/detection/facing_lanes.h>
#include <splitcubes/contact/detection/sample_grid.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/geometry/box.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace splitcubes::body {

namespace {

// Returns the direction to the point (u, v in [-1, 1]) of a side of the cube [-1, 1]^3.
Vec3 on_side(std::size_t side, double u, double v) {
    const auto axis = static_cast<int>(side / 2);
    Vec3 out;
    out[axis] = side % 2 == 0 ? 1 : -1;
    out[(axis + 1) % 3] = u;
    out[(axis + 2) % 3] = v;
    return out.normalized();
}

// Clamps to a finite float; absurd distances are compared in double precision only.
float to_float(double value) {
    constexpr double max_value = 1e30;
    return static_cast<float>(std::clamp(value, -max_value, max_value));
}

constexpr std::array<double, 4> part_ends{-1, -tuning::samples::direction_bin_edge,
                                          tuning::samples::direction_bin_edge, 1};

// Returns which part of the side a normal's coordinate falls into; main: the largest absolute coordinate.
int part_of(double coordinate, double main) {
    return (coordinate >= -tuning::samples::direction_bin_edge * main) +
           (coordinate > tuning::samples::direction_bin_edge * main);
}

}  // namespace

std::uint8_t SampleGrid::bin_of(const Vec3& normal) {
    int axis = 0;
    const double main = normal.cwiseAbs().maxCoeff(&axis);
    const int side = 2 * axis + (normal[axis] < 0);
    const int u = part_of(normal[(axis + 1) % 3], main), v = part_of(normal[(axis + 2) % 3], main);
    return static_cast<std::uint8_t>(9 * side + 3 * v + u);
}

// Per bin, the bins that hold a direction which faces one of its own: the angle between the bin centres plus
// both half widths exceeds the limit.
SampleGrid::FacingBins SampleGrid::find_facing_bins(double cosine) {
    std::array<Vec3, bin_count> middle;
    std::array<double, bin_count> width{};
    for (std::size_t b = 0; b < bin_count; ++b) {
        const std::size_t u = b % 3, v = b / 3 % 3;
        middle[b] =
            on_side(b / 9, 0.5 * (part_ends[u] + part_ends[u + 1]), 0.5 * (part_ends[v] + part_ends[v + 1]));
        for (const double at_u : {part_ends[u], part_ends[u + 1]})
            for (const double at_v : {part_ends[v], part_ends[v + 1]})
                width[b] = std::max(
                    width[b], std::acos(std::clamp(middle[b].dot(on_side(b / 9, at_u, at_v)), -1.0, 1.0)));
    }
    std::array<std::uint64_t, bin_count> out{};
    for (std::size_t a = 0; a < bin_count; ++a)
        for (std::size_t b = 0; b < bin_count; ++b) {
            const double angle = std::acos(std::clamp(middle[a].dot(middle[b]), -1.0, 1.0));
            if (angle + width[a] + width[b] > std::acos(cosine) - 1e-6) out[a] |= std::uint64_t{1} << b;
        }
    return out;
}

const SampleGrid::FacingBins& SampleGrid::facing_bins() {
    if (facing_.cosine != reach_.cosine) facing_ = {reach_.cosine, find_facing_bins(reach_.cosine)};
    return facing_.bins;
}

// Clamps before the conversion, so that neither far points nor NaNs overflow.
Vec3i SampleGrid::cell_at(const Vec3& point) const {
    Vec3i cell;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (point[axis] - origin_[axis]) * cells_per_metre_;
        cell[axis] = at > 0 ? static_cast<int>(std::min<double>(at, count_[axis] - 1)) : 0;
    }
    return cell;
}

void SampleGrid::lay_out(std::span<const Vec3> points, const Reach& reach) {
    geometry::Box box;
    for (const Vec3& point : points)
        if (point.allFinite()) box.add(point);
    origin_ = box.empty() ? Vec3(Vec3::Zero()) : box.min;
    const Vec3 extent = box.empty() ? Vec3(Vec3::Zero()) : Vec3(box.size());
    extent_ = extent.maxCoeff();
    // Points within reach of slow points are in adjacent cells.
    reach_ = reach;
    size_ = (1.0001 + 2 * tuning::samples::slow_reach_share) * reach.min;
    // At most about eight cells per point, however far the points are scattered.
    const double limit = 8.0 * static_cast<double>(points.size()) + 64;
    while (((extent / size_).array().floor() + 1).prod() > limit) size_ *= 1.5;
    count_ = (extent / size_).array().floor().cast<int>() + 1;
    cells_per_metre_ = 1 / size_;
}

// Works axis by axis (separable).
template <class Value, class Join>
void SampleGrid::spread(int rings, std::vector<Value>& values, std::vector<Value>& spare,
                        const Parallel& parallel, const Join& join) const {
    constexpr std::size_t grain = 4096;
    spare.resize(values.size());
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<std::size_t>(count_[axis]),
                   max_steps = static_cast<std::size_t>(rings);
        parallel.for_each(values.size(), grain, [&](std::size_t c) {
            const std::size_t at = c / stride % length;
            Value value = values[c];
            for (std::size_t n = 1; n <= std::min(max_steps, at); ++n)
                value = join(value, values[c - n * stride]);
            for (std::size_t n = 1; n <= std::min(max_steps, length - 1 - at); ++n)
                value = join(value, values[c + n * stride]);
            spare[c] = value;
        });
        values.swap(spare);
        stride *= length;
    }
}

// Computes the extra reach of wide cells. The faster one of two points reaches the other one's cell with at
// most twice its own extra reach.
void SampleGrid::find_extra_reach(std::span<const Motion> motions, const Parallel& parallel) {
    double max_extra = 0;
    for (const Motion& motion : motions) max_extra = std::max(max_extra, motion.extra_reach);
    const auto is_fast = [this](double extra_reach) { return reach_.min + 2 * extra_reach > size_; };
    any_wide_ = is_fast(max_extra);
    if (!any_wide_) return;
    rings_ = static_cast<int>(std::ceil(std::min(reach_.min + 2 * max_extra, reach_.max) / size_));
    extra_reach_.assign(cell_index(0, 0, count_.z()), 0);
    for (std::size_t i = 0; i < motions.size(); ++i)
        if (is_fast(motions[i].extra_reach))
            extra_reach_[cell_[i]] = std::max(extra_reach_[cell_[i]], to_float(motions[i].extra_reach));
    spread(rings_, extra_reach_, spare_extra_reach_, parallel,
           [](float x, float y) { return std::max(x, y); });
}

// Computes each point's cell and bin.
void SampleGrid::find_bins(std::span<const Vec3> points, std::span<const Vec3> normals,
                           const Parallel& parallel) {
    constexpr std::size_t grain = 1024;
    cell_.resize(points.size());
    bin_.resize(points.size());
    parallel.for_each(points.size(), grain, [&](std::size_t i) {
        const Vec3i at = cell_at(points[i]);
        cell_[i] = static_cast<std::uint32_t>(cell_index(at.x(), at.y(), at.z()));
        bin_[i] = bin_of(normals[i]);
    });
}

// Computes the bins within reach of each cell.
void SampleGrid::find_bins_around(const Parallel& parallel) {
    bins_around_.assign(cell_index(0, 0, count_.z()), 0);
    for (std::size_t i = 0; i < cell_.size(); ++i) bins_around_[cell_[i]] |= std::uint64_t{1} << bin_[i];
    spread(1, bins_around_, spare_bins_, parallel, std::bit_or<>{});
    if (!any_wide_) return;
    wide_bins_ = bins_around_;
    spread(rings_ - 1, wide_bins_, spare_bins_, parallel, std::bit_or<>{});
    for (std::size_t c = 0; c < extra_reach_.size(); ++c)
        if (extra_reach_[c] > 0) bins_around_[c] = wide_bins_[c];
}

// Keeps the points that another one may face. Facing bins are symmetric, so whatever faces a kept point is
// kept.
void SampleGrid::choose_kept(std::span<const Vec3> points, const Parallel& parallel,
                             const RefineCallback& refine) {
    constexpr std::size_t grain = 1024;
    const FacingBins& facing = facing_bins();
    kept_.clear();
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if ((bins_around_[cell_[i]] & facing[bin_[i]]) != 0) kept_.push_back(i);
    if (!refine) return;
    refine(kept_);
    parallel.for_each(kept_.size(), grain, [&](std::size_t k) {
        const Vec3i at = cell_at(points[kept_[k]]);
        cell_[kept_[k]] = static_cast<std::uint32_t>(cell_index(at.x(), at.y(), at.z()));
    });
}

// Sorts the kept points by cell, then by index.
void SampleGrid::sort_points(std::span<const Vec3> points, std::span<const Vec3> normals,
                             std::span<const Motion> motions, std::span<const std::uint16_t> owners,
                             const Parallel& parallel) {
    constexpr std::size_t grain = 1024;
    begin_.assign(bins_around_.size() + 1, 0);
    for (const std::uint32_t i : kept_) ++begin_[cell_[i] + 1];
    for (std::size_t c = 0; c + 1 < begin_.size(); ++c) begin_[c + 1] += begin_[c];
    const std::size_t count = begin_.back();
    next_.assign(begin_.begin(), begin_.end() - 1);
    index_.resize(count);
    max_motion_ = 0;
    for (const std::uint32_t i : kept_) {
        index_[next_[cell_[i]]++] = i;
        max_motion_ = std::max({max_motion_, motions[i].displacement.cwiseAbs().maxCoeff(),
                                motions[i].drift.cwiseAbs().maxCoeff()});
    }
    sorted_.resize(count);
    for (std::vector<float>& lane : lanes_) lane.resize(count + facing_padding);
    parallel.for_each(count, grain, [&](std::size_t k) {
        const std::uint32_t i = index_[k];
        const Vec3 &point = points[i], &normal = normals[i];
        const Motion& motion = motions[i];
        sorted_[k] = {point, normal, motion, cell_[i], owners[i]};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<Eigen::Index>(axis);
            lanes_[axis][k] = to_float(point[a] - origin_[a]);
            lanes_[3 + axis][k] = static_cast<float>(normal[a]);
            lanes_[6 + axis][k] = to_float(motion.displacement[a]);
            lanes_[9 + axis][k] = to_float(motion.drift[a]);
        }
        lanes_[12][k] = to_float(motion.extra_reach);
    });
}

// Returns the bounds of all kept points within reach of the cell.
SampleGrid::Extent SampleGrid::extent_around(std::size_t cell) const {
    const Vec3i at(static_cast<int>(cell) % count_.x(), static_cast<int>(cell) / count_.x() % count_.y(),
                   static_cast<int>(cell) / count_.x() / count_.y());
    const int rings = is_wide(cell) ? rings_ : 1;
    const Vec3i low = (at.array() - rings).max(0), high = (at.array() + rings).min(count_.array() - 1);
    Extent out;
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y)
            for (std::size_t c = cell_index(low.x(), y, z); c <= cell_index(high.x(), y, z); ++c)
                if (begin_[c] < begin_[c + 1]) out.add(own_[c]);
    return out;
}

void SampleGrid::find_extents(const Parallel& parallel) {
    constexpr std::size_t grain = 2048;
    const std::size_t cells = bins_around_.size();
    own_.resize(cells);
    around_.resize(cells);
    parallel.for_each(cells, grain, [&](std::size_t c) {
        if (begin_[c] == begin_[c + 1]) return;
        Extent& own = own_[c] = {};
        for (std::uint32_t k = begin_[c]; k < begin_[c + 1]; ++k) {
            Extent one;
            for (std::size_t axis = 0; axis < 3; ++axis) one.low[axis] = one.high[axis] = lanes_[3 + axis][k];
            one.first_owner = one.last_owner = sorted_[k].owner;
            own.add(one);
        }
    });
    parallel.for_each(cells, grain, [&](std::size_t c) {
        if (begin_[c] < begin_[c + 1]) around_[c] = extent_around(c);
    });
}

void SampleGrid::build(std::span<const Vec3> points, std::span<const Vec3> normals,
                       std::span<const Motion> motions, std::span<const std::uint16_t> owners,
                       const Reach& reach, const Parallel& parallel, const RefineCallback& refine) {
    lay_out(points, reach);
    find_bins(points, normals, parallel);
    find_extra_reach(motions, parallel);
    find_bins_around(parallel);
    choose_kept(points, parallel, refine);
    sort_points(points, normals, motions, owners, parallel);
    find_extents(parallel);
}

void SampleGrid::find_facing(std::size_t of, double radius, double height,
                             std::vector<std::uint32_t>& scratch, std::vector<FacingPoint>& out) const {
    constexpr std::size_t max_ranges = 64;  // seven by seven rows, for three times the reach
    out.clear();
    const Vec3 point = sorted_[of].point, normal = sorted_[of].normal;
    const Motion own = sorted_[of].motion;
    // Exceeds the single-precision error of positions and of products of unit vectors.
    const double slack = 1e-6 * (extent_ + max_motion_) + 1e-5 * reach_.min;
    const double reach = reach_.min + own.extra_reach;
    radius = std::min({radius, reach_.max, reach + max_extra_reach(sorted_[of].cell)});
    const Vec3i low = cell_at(point - Vec3::Constant(radius)), high = cell_at(point + Vec3::Constant(radius));
    std::array<FacingRange, max_ranges> ranges;
    std::size_t count = 0, candidates = 0;
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y() && count < max_ranges; ++y) {
            const FacingRange range{begin_[cell_index(low.x(), y, z)],
                                    begin_[cell_index(high.x(), y, z) + 1]};
            if (range.begin == range.end) continue;
            ranges[count++] = range;
            candidates += range.end - range.begin;
        }
    if (count == 0) return;
    const Vec3 at = point - origin_;
    const Vec3f facing = normal.cast<float>();
    const FacingQuery query{to_float(at.x()),
                            to_float(at.y()),
                            to_float(at.z()),
                            facing.x(),
                            facing.y(),
                            facing.z(),
                            to_float(own.displacement.x()),
                            to_float(own.displacement.y()),
                            to_float(own.displacement.z()),
                            to_float(own.drift.x()),
                            to_float(own.drift.y()),
                            to_float(own.drift.z()),
                            to_float(radius + slack),
                            to_float(reach + slack),
                            static_cast<float>(reach_.cosine + 1e-5),
                            to_float(height + slack)};
    const FacingLanes lanes{lanes_[0].data(), lanes_[1].data(), lanes_[2].data(),  lanes_[3].data(),
                            lanes_[4].data(), lanes_[5].data(), lanes_[6].data(),  lanes_[7].data(),
                            lanes_[8].data(), lanes_[9].data(), lanes_[10].data(), lanes_[11].data(),
                            lanes_[12].data()};
    // Only grows; its content is overwritten.
    if (scratch.size() < candidates + facing_padding) scratch.resize(candidates + facing_padding);
    bool is_low = false;
    const std::size_t found = select_facing(lanes, {ranges.data(), count}, query, scratch.data(), is_low);
    if (!is_low) return;
    for (std::size_t n = 0; n < found; ++n) {
        const Point& other = sorted_[scratch[n]];
        const Vec3 offset = point - other.point;
        const double squared_distance = offset.squaredNorm(), cosine = normal.dot(other.normal);
        const double limit = std::min(radius, reach + other.motion.extra_reach);
        if (!(squared_distance < limit * limit && cosine < reach_.cosine)) continue;
        const double point_height = other.normal.dot(offset);
        const double change = other.normal.dot(own.displacement - other.motion.displacement) +
                              std::min(0.0, other.normal.dot(own.drift - other.motion.drift));
        out.push_back({scratch[n], squared_distance, cosine, point_height, point_height + change});
    }
}

}  // namespace splitcubes::body
