// The surface triangles of a body in rest space, binned by the cells of a
// regular grid, for range queries and segment intersection tests.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/occluder_lanes.h>
#include <splitcubes/geometry/occluder_pack.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace splitcubes::geometry {

/// A triangle that can block the line of sight between two phyxels.
struct OccluderTriangle {
    std::array<Vec3, 3> corner;  // m, rest space
    bool boundary = false;       // input boundary; else a cut (each cut quad once, not once per side)

    Box bounds() const {
        return {corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]),
                corner[0].cwiseMax(corner[1]).cwiseMax(corner[2])};
    }
};

/// Returns whether the closed segment from a to b meets the closed triangle. Errs to
/// `true` by more than rounding (about 1e-13 of their joint extent, more for grazing
/// segments), so that no segment slips between two triangles that share an edge or a
/// vertex. Coplanar overlap counts. Degenerate triangles (thinner than 1e-14 of their
/// length) are never met.
bool segment_meets_triangle(const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& corner);

/// The triangles of a surface, set and replaced cell by cell. A triangle may overhang
/// its cell by any amount: it is listed in every cell that its box meets (large ones in
/// a list that every query reads). Memory grows with the occupied cells, plus one bit per
/// cell if the grid has at most 512 cells per side. Queries may run concurrently on many
/// threads, but not during set_cell. Their results depend on the contents of the cells, not
/// on the order in which they were set (except blocker).
class OccluderGrid {
  public:
    /// origin, cell_size: m, rest space; cell (i, j, k) spans origin + cell_size *
    /// [i, i+1] x [j, j+1] x [k, k+1]. Throws InputError for a cell size that is
    /// not positive or a cell count outside 1 .. 2^20 on an axis.
    OccluderGrid(const Vec3& origin, double cell_size, const Vec3i& cell_count);

    /// Replaces the triangles of the cell; an empty span removes them. The cost grows with
    /// the triangles of the cell and its surroundings, not with the grid.
    /// cell: 0 <= cell < cell_count; corners finite.
    void set_cell(const Vec3i& cell, std::span<const OccluderTriangle> triangles);
    /// The same for many cells, each at most once; faster than one by one.
    struct CellTriangles {
        Vec3i cell;
        std::span<const OccluderTriangle> triangles;
    };
    void set_cells(std::span<const CellTriangles> cells, const Parallel& parallel);

    std::size_t triangle_count() const { return triangle_count_; }

    /// Appends every triangle whose box meets `box`, each once.
    void gather(const Box& box, std::vector<OccluderTriangle>& out) const;

    /// Calls use(const OccluderTriangle&) for each triangle that gather would append, in
    /// the same order. The references are valid until the next set_cell.
    template <class Use>
    void visit(const Box& box, const Use& use) const;

    /// Visits a superset of the triangles that gather would append, each once and in
    /// unspecified order: calls use(const OccluderPack&, const PackedTriangles&) for packs,
    /// loose(id) for triangles in no pack.
    template <class Use, class Loose>
    void visit_packs(const Box& box, const Use& use, const Loose& loose) const;
    /// Returns a triangle by the id of a pack's lane. Valid until the next set_cell.
    const OccluderTriangle& triangle(std::uint32_t id) const { return entries_[id].triangle; }

    /// Returns true if none of the box's cells lists a triangle, so that no segment within the box can be
    /// blocked. Conservative: it may return false for a clear box.
    bool is_clear(const Box& box) const;

    /// Returns whether segment_meets_triangle holds for any triangle. since: considers only triangles that
    /// were set after changes() had this value.
    bool segment_blocked(const Vec3& a, const Vec3& b, std::uint32_t since = 0) const {
        return blocker(a, b, since) != no_triangle;
    }
    static constexpr std::uint32_t no_triangle = 0xffffffff;
    /// Returns the id of a triangle that blocks the segment; no_triangle if none does. With several, the
    /// result depends on the order in which the cells were set.
    std::uint32_t blocker(const Vec3& a, const Vec3& b, std::uint32_t since = 0) const;
    /// Returns whether a triangle with this id exists and meets the segment. Any id is allowed: testing a
    /// cached result of blocker first is faster than a new search.
    bool blocks(std::uint32_t id, const Vec3& a, const Vec3& b) const;
    /// Number of calls so far that replaced cells.
    std::uint32_t changes() const { return changes_; }

  private:
    static constexpr int brick_bits = 2;  // cells of a brick along an axis: 4
    static constexpr std::uint32_t brick_cells = 64;

    // One listing of a triangle in a cell.
    struct Ref {
        std::uint64_t owner;   // key of the cell that it was set for
        std::uint32_t index;   // among the triangles of its owner
        std::uint32_t id;      // into entries_
        std::uint32_t spread;  // bit a: also listed in the cell below along axis a; bit 3 + a: above
        std::uint32_t change;  // value of changes_ when it was set
        RoughBox box;
        RoughPlane plane;
    };
    struct alignas(64) Entry {
        OccluderTriangle triangle;
        Box box;  // m, of the triangle
    };
    struct Owned {
        std::uint64_t owner;
        std::uint32_t id;
    };
    // 4 x 4 x 4 cells; refs sorted by cell, then owner, then index.
    struct Brick {
        std::uint64_t key = 0;
        std::uint64_t occupied = 0;                          // bit per cell, x fastest
        std::array<std::uint32_t, brick_cells + 1> first{};  // per cell: its first ref
        std::vector<Ref> refs;
        std::array<std::uint32_t, brick_cells> first_lanes{};  // per cell: its first entry in lanes
        std::array<std::uint32_t, brick_cells> newest{};       // per cell: the last change of its refs
        std::vector<OccluderLanes> lanes;                      // the refs of each cell in SIMD layout
        std::vector<Owned> owned;                              // triangles of the cells of this brick
        PackedTriangles packed{Vec3::Zero()};
    };
    // A ref to insert, and its cell within the brick.
    struct Listing {
        std::uint32_t local;
        Ref ref;
    };
    // Bricks whose refs change, in order of first touch.
    struct TouchedBrick {
        std::size_t index;
        std::vector<Listing> added;
    };
    struct TouchedBricks {
        std::vector<TouchedBrick> bricks;
        std::vector<std::int32_t> of_brick;  // per brick of the grid: its index in bricks, or -1
        Vec3i last_position;                 // the brick touched last
        std::size_t last = 0;
    };

    // Enlargement of listings, in cells: rounding in a walk along a cell's face then
    // misses no triangle.
    static constexpr double listing_margin = 1e-6;

    // Keys order positions by z, then y, then x: 21 bits each.
    static constexpr int key_bias = 1 << 20;
    static std::uint64_t key_of(const Vec3i& coordinates) {
        const auto part = [&](int axis) { return static_cast<std::uint64_t>(coordinates[axis] + key_bias); };
        return part(2) << 42 | part(1) << 21 | part(0);
    }
    static Vec3i coordinates_of(std::uint64_t key) {
        const auto part = [&](int shift) { return static_cast<int>(key >> shift & 0x1fffff) - key_bias; };
        return {part(0), part(21), part(42)};
    }
    static Vec3i brick_of(const Vec3i& cell) {
        return {cell[0] >> brick_bits, cell[1] >> brick_bits, cell[2] >> brick_bits};
    }
    static std::uint32_t local_of(const Vec3i& cell) {
        return static_cast<std::uint32_t>((cell[0] & 3) | (cell[1] & 3) << 2 | (cell[2] & 3) << 4);
    }
    // Bits of the brick's cells that lie in low .. high.
    static std::uint64_t range_mask(const Vec3i& brick, const Vec3i& low, const Vec3i& high);

    Vec3i cell_at(const Vec3& point, double margin) const;
    void lay_out_words();
    // Returns the brick's index in words_, or words_.size() outside.
    std::size_t word_of(const Vec3i& brick) const {
        const Vec3i at = brick + Vec3i::Ones();
        const bool within = (at.array() >= 0).all() && (at.array() < word_count_.array()).all();
        return within ? static_cast<std::size_t>((at[2] * word_count_[1] + at[1]) * word_count_[0] + at[0])
                      : words_.size();
    }
    // Bits of the brick's cells that list triangles.
    std::uint64_t occupied(const Vec3i& brick) const {
        if (const std::size_t word = word_of(brick); word < words_.size()) return words_[word];
        const Brick* found = find_brick(brick);
        return found ? found->occupied : 0;
    }
    bool is_clear(const Vec3i& low, const Vec3i& high) const;
    std::size_t slot_of(std::uint64_t key) const;
    const Brick* find_brick(const Vec3i& coordinates) const;
    std::size_t make_brick(const Vec3i& coordinates);
    std::uint32_t store(const OccluderTriangle& triangle);
    void pack(Brick& brick, const Vec3i& cell, std::uint32_t id);
    template <class Use>
    void visit_packs_of(const Brick& brick, const Box& box, const Use& use) const;
    template <class Use>
    bool for_listings(std::uint64_t owner, std::uint32_t index, std::uint32_t id, const Use& use) const;
    TouchedBrick& touch(const Vec3i& brick, TouchedBricks& touched);
    void take_out(std::size_t home, const Vec3i& cell, TouchedBricks& touched);
    void put_in(std::size_t home, const CellTriangles& of, TouchedBricks& touched);
    void rebuild(Brick& brick, std::span<const std::uint64_t> owners, std::span<const Listing> added);
    static void lay_lanes(Brick& brick);
    std::vector<const Brick*> sorted_bricks(const Vec3i& first, const Vec3i& last) const;
    /// A segment traversal through the grid.
    struct Walk {
        Vec3 a, b;  // m, rest space
        Box box;
        std::uint32_t since;
        std::optional<RoughSegment> rough;  // set at the first cell with refs newer than `since`
    };
    std::uint32_t blocker_in(const Brick& brick, std::uint32_t local, std::uint32_t seen, Walk& walk) const;
    Box walk_box(const Vec3& a, const Vec3& b) const;
    template <class Use>
    void visit_brick(const Brick& brick, const Vec3i& coordinates, const Vec3i& low, const Vec3i& high,
                     const RoughBox& rough, const Box& box, const Use& use) const;

    Vec3 origin_;       // m, rest space
    double cell_size_;  // m
    double cells_per_metre_;
    Vec3i cell_count_;
    std::size_t triangle_count_ = 0;
    std::uint32_t changes_ = 0;
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> free_;  // unused entries
    std::vector<Ref> large_;           // sorted by owner, then index
    std::vector<Owned> loose_;         // triangles in no pack
    double overhang_ = 0;              // m, largest overhang of packed triangles beyond their bricks so far
    std::vector<Brick> bricks_;
    std::vector<std::uint32_t> table_;  // open addressing: brick index + 1, or 0
    // `occupied` of all bricks of the grid and of one layer around it; empty for a large grid.
    Vec3i word_count_ = Vec3i::Zero();
    std::vector<std::uint64_t> words_;
    std::vector<std::uint32_t> brick_indices_;  // parallel to words_: brick index + 1, or 0
};

template <class Use>
void OccluderGrid::visit_brick(const Brick& brick, const Vec3i& coordinates, const Vec3i& low,
                               const Vec3i& high, const RoughBox& rough, const Box& box,
                               const Use& use) const {
    for (std::uint64_t cells = brick.occupied & range_mask(coordinates, low, high); cells;
         cells &= cells - 1) {
        const int local = std::countr_zero(cells);
        const Vec3i cell = coordinates * 4 + Vec3i(local & 3, local >> 2 & 3, local >> 4);
        // The first of a triangle's cells in the range reports it.
        std::uint32_t seen = 0;
        for (int axis = 0; axis < 3; ++axis) seen |= std::uint32_t{cell[axis] > low[axis]} << axis;
        const auto l = static_cast<std::size_t>(local);
        for (std::uint32_t r = brick.first[l]; r < brick.first[l + 1]; ++r) {
            const Ref& ref = brick.refs[r];
            if ((ref.spread & seen) != 0 || !ref.box.meets(rough)) continue;
            const Entry& entry = entries_[ref.id];
            if (entry.box.meets(box)) use(entry.triangle);
        }
    }
}

template <class Use>
void OccluderGrid::visit(const Box& box, const Use& use) const {
    if (box.empty() || triangle_count_ == 0) return;
    for (const Ref& ref : large_)
        if (entries_[ref.id].box.meets(box)) use(entries_[ref.id].triangle);
    const RoughBox rough = RoughBox::around(box);
    const Vec3i low = cell_at(box.min, 0), high = cell_at(box.max, 0);
    const Vec3i first = brick_of(low), last = brick_of(high);
    if ((last - first + Vec3i::Ones()).cast<double>().prod() > static_cast<double>(bricks_.size())) {
        for (const Brick* brick : sorted_bricks(first, last))
            visit_brick(*brick, coordinates_of(brick->key), low, high, rough, box, use);
        return;
    }
    for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
            for (int x = first[0]; x <= last[0]; ++x)
                if (const Brick* brick = find_brick({x, y, z}))
                    visit_brick(*brick, {x, y, z}, low, high, rough, box, use);
}

template <class Use>
void OccluderGrid::visit_packs_of(const Brick& brick, const Box& box, const Use& use) const {
    std::array<float, 3> low, high;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        low[k] = static_cast<float>(box.min[axis] - brick.packed.centre()[axis]);
        high[k] = static_cast<float>(box.max[axis] - brick.packed.centre()[axis]);
        // Exceeds the rounding error of both.
        const float slack = 1e-6F * (brick.packed.extent() + std::abs(low[k]) + std::abs(high[k]));
        low[k] -= slack;
        high[k] += slack;
    }
    brick.packed.visit(low, high, [&](const OccluderPack& pack) { use(pack, brick.packed); });
}

template <class Use, class Loose>
void OccluderGrid::visit_packs(const Box& box, const Use& use, const Loose& loose) const {
    if (box.empty() || triangle_count_ == 0) return;
    for (const Owned& o : loose_)
        if (entries_[o.id].box.meets(box)) loose(o.id);
    const Box wide = box.grown(overhang_);
    const Vec3i first = brick_of(cell_at(wide.min, -listing_margin));
    const Vec3i last = brick_of(cell_at(wide.max, listing_margin));
    if ((last - first + Vec3i::Ones()).cast<double>().prod() > static_cast<double>(bricks_.size())) {
        for (const Brick& brick : bricks_) visit_packs_of(brick, box, use);
        return;
    }
    for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
            for (int x = first[0]; x <= last[0]; ++x)
                if (const Brick* brick = find_brick({x, y, z})) visit_packs_of(*brick, box, use);
}

}  // namespace splitcubes::geometry
