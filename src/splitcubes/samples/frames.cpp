#include <splitcubes/geometry/affine_sums.h>
#include <splitcubes/samples/frames.h>
#include <splitcubes/samples/kernel.h>
#include <splitcubes/samples/loops.h>

#include <algorithm>
#include <array>
#include <cassert>

namespace splitcubes::meshless {

namespace {

// Rows of one chunk of points, before they are copied to the pool.
struct ChunkRows {
    std::vector<std::uint32_t> count, phyxel;
    std::vector<double> weight;
};

// Appends the row of one point.
void add_row(const Vec3& point, std::int32_t piece, std::size_t point_index, double reach,
             const Phyxels& phyxels, const PhyxelLocator& locator, const Visible& visible,
             std::vector<std::uint32_t>& near, ChunkRows& rows) {
    locator.near(point, reach, near);
    const std::size_t begin = rows.phyxel.size();
    double total = 0;
    for (const std::uint32_t i : near) {
        if (phyxels.piece[i] != piece) continue;
        double w = kernel((phyxels.rest_position[i] - point).squaredNorm(), phyxels.support_radius[i]);
        if (w > 0 && visible) w *= visible(point_index, i);
        if (!(w > 0)) continue;
        rows.phyxel.push_back(i);
        rows.weight.push_back(w);
        total += w;
    }
    for (std::size_t k = begin; k < rows.weight.size(); ++k) rows.weight[k] /= total;
    rows.count.push_back(static_cast<std::uint32_t>(rows.phyxel.size() - begin));
}

// Removes the unused pool entries; rows stay in order.
void compact(NodeKernels& kernels) {
    NodeKernels packed;
    packed.rows.reserve(kernels.rows.size());
    for (const NodeKernels::Row& row : kernels.rows) {
        packed.rows.push_back({static_cast<std::uint32_t>(packed.phyxel.size()), row.count, row.count});
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k) {
            packed.phyxel.push_back(kernels.phyxel[k]);
            packed.weight.push_back(kernels.weight[k]);
        }
    }
    kernels = std::move(packed);
}

// Evaluates the frames of the points index_of(k), k in [begin, end), from the displacements of their phyxels.
template <class IndexOf>
void evaluate_chunk(const NodeKernels& kernels, std::size_t begin, std::size_t end, const IndexOf& index_of,
                    std::span<const Vec3> rest_points, std::span<const geometry::AffineDisplacement> affine,
                    std::span<geometry::Frame> out) {
    std::array<geometry::AffineRow, phyxel_grain> rows;
    std::array<geometry::AffineDisplacement, phyxel_grain> sums;
    for (std::size_t k = begin; k < end; ++k) {
        const NodeKernels::Row& row = kernels.rows[index_of(k)];
        rows[k - begin] = {row.begin, row.count};
    }
    geometry::sum_affine(std::span(rows).first(end - begin), kernels.phyxel.data(), kernels.weight.data(),
                         affine.data(), sums.data());
    for (std::size_t k = begin; k < end; ++k) {
        const std::size_t p = index_of(k);
        if (kernels.rows[p].count == 0) continue;
        out[p].position = sums[k - begin].image(rest_points[p]);
        out[p].jacobian = sums[k - begin].jacobian();
    }
}

}  // namespace

NodeKernels build_kernels(std::span<const Vec3> points, std::span<const std::int32_t> piece,
                          const Phyxels& phyxels, const PhyxelLocator& locator, const Visible& visible,
                          const Parallel& parallel) {
    std::vector<std::uint32_t> all(points.size());
    for (std::size_t p = 0; p < all.size(); ++p) all[p] = static_cast<std::uint32_t>(p);
    NodeKernels kernels;
    rebuild_kernels(kernels, all, points, piece, phyxels, locator, visible, parallel);
    return kernels;
}

void rebuild_kernels(NodeKernels& kernels, std::span<const std::uint32_t> subset,
                     std::span<const Vec3> points, std::span<const std::int32_t> piece,
                     const Phyxels& phyxels, const PhyxelLocator& locator, const Visible& visible,
                     const Parallel& parallel) {
    assert(points.size() == piece.size() && points.size() >= kernels.size());
    assert(locator.size() == phyxels.size());
    if (kernels.rows.size() < points.size()) kernels.rows.resize(points.size());
    double reach = 0;
    for (const double h : phyxels.support_radius) reach = std::max(reach, h);
    std::vector<ChunkRows> chunks((subset.size() + phyxel_grain - 1) / phyxel_grain);
    for_phyxel_chunks(parallel, subset.size(), [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> near;
        for (std::size_t k = begin; k < end; ++k)
            add_row(points[subset[k]], piece[subset[k]], subset[k], reach, phyxels, locator, visible, near,
                    chunks[begin / phyxel_grain]);
    });
    std::size_t next = 0;
    for (const ChunkRows& chunk : chunks) {
        std::size_t from = 0;
        for (const std::uint32_t count : chunk.count) {
            NodeKernels::Row& row = kernels.rows[subset[next++]];
            if (count > row.capacity) {
                kernels.unused += row.capacity;
                row.begin = static_cast<std::uint32_t>(kernels.phyxel.size());
                row.capacity = count;
                kernels.phyxel.resize(kernels.phyxel.size() + count);
                kernels.weight.resize(kernels.weight.size() + count);
            }
            row.count = count;
            std::copy_n(chunk.phyxel.begin() + static_cast<std::ptrdiff_t>(from), count,
                        kernels.phyxel.begin() + row.begin);
            std::copy_n(chunk.weight.begin() + static_cast<std::ptrdiff_t>(from), count,
                        kernels.weight.begin() + row.begin);
            from += count;
        }
    }
    if (2 * kernels.unused > kernels.phyxel.size()) compact(kernels);
}

void FrameEvaluator::operator()(const NodeKernels& kernels, std::span<const Vec3> rest_points,
                                std::span<const Vec3> rest_position, std::span<const Vec3> position,
                                std::span<const Mat3> deformation, std::span<geometry::Frame> out,
                                const Parallel& parallel) {
    assert(rest_points.size() == kernels.size() && out.size() == kernels.size());
    affine_.resize(rest_position.size());
    for_phyxels(parallel, affine_.size(), [&](std::size_t i) {
        affine_[i] = geometry::AffineDisplacement(rest_position[i], position[i], deformation[i]);
    });
    for_phyxel_chunks(parallel, kernels.size(), [&](std::size_t begin, std::size_t end) {
        evaluate_chunk(
            kernels, begin, end, [](std::size_t p) { return p; }, rest_points, affine_, out);
    });
}

// Each phyxel occurs in many rows, so its displacement is computed once.
void FrameEvaluator::evaluate_some(std::span<const std::uint32_t> subset, const NodeKernels& kernels,
                                   std::span<const Vec3> rest_points, std::span<const Vec3> rest_position,
                                   std::span<const Vec3> position, std::span<const Mat3> deformation,
                                   std::span<geometry::Frame> out, const Parallel& parallel) {
    assert(rest_points.size() == kernels.size() && out.size() == kernels.size());
    affine_.resize(rest_position.size());
    is_needed_.resize(rest_position.size(), 0);
    needed_.clear();
    for (const std::uint32_t p : subset) {
        const NodeKernels::Row& row = kernels.rows[p];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k) {
            std::uint8_t& is_needed = is_needed_[kernels.phyxel[k]];
            if (is_needed == 0) needed_.push_back(kernels.phyxel[k]);
            is_needed = 1;
        }
    }
    for_phyxels(parallel, needed_.size(), [&](std::size_t k) {
        const std::uint32_t i = needed_[k];
        is_needed_[i] = 0;
        affine_[i] = geometry::AffineDisplacement(rest_position[i], position[i], deformation[i]);
    });
    for_phyxel_chunks(parallel, subset.size(), [&](std::size_t begin, std::size_t end) {
        evaluate_chunk(
            kernels, begin, end, [&](std::size_t k) { return subset[k]; }, rest_points, affine_, out);
    });
}

void evaluate_frames(const NodeKernels& kernels, std::span<const Vec3> rest_points, const Phyxels& phyxels,
                     std::span<geometry::Frame> out, const Parallel& parallel) {
    evaluate_frames(kernels, rest_points, phyxels, phyxels.position, phyxels.deformation, out, parallel);
}

void evaluate_frames(const NodeKernels& kernels, std::span<const Vec3> rest_points, const Phyxels& phyxels,
                     std::span<const Vec3> position, std::span<const Mat3> deformation,
                     std::span<geometry::Frame> out, const Parallel& parallel) {
    FrameEvaluator{}(kernels, rest_points, phyxels.rest_position, position, deformation, out, parallel);
}

}  // namespace splitcubes::meshless
