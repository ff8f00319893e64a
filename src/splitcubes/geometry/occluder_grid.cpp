#include <splitcubes/core/error.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/geometry/tuning.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

namespace splitcubes::geometry {

namespace {

std::size_t slot_hash(std::uint64_t key) {
    return (key * 0x9e3779b97f4a7c15ULL) >> 20;
}

}  // namespace

OccluderGrid::OccluderGrid(const Vec3& origin, double cell_size, const Vec3i& cell_count)
    : origin_(origin),
      cell_size_(cell_size),
      cells_per_metre_(1 / cell_size),
      cell_count_(cell_count),
      table_(64, 0) {
    if (!(cell_size > 0) || !std::isfinite(cell_size))
        throw InputError("occluder grid cell size",
                         "must be a positive number of metres, got " + std::to_string(cell_size));
    if ((cell_count.array() < 1).any() || (cell_count.array() > key_bias).any())
        throw InputError("occluder grid", "needs 1 to " + std::to_string(key_bias) + " cells along an axis");
    lay_out_words();
}

void OccluderGrid::lay_out_words() {
    const Vec3i count = brick_of(cell_count_ - Vec3i::Ones()) + Vec3i::Constant(3);
    if (count.cast<double>().prod() > tuning::occluders::max_direct_bricks) return;
    word_count_ = count;
    words_.assign(static_cast<std::size_t>(count.prod()), 0);
    brick_indices_.assign(words_.size(), 0);
}

// Points outside the range of keys map to its outermost cell; exact box tests follow.
Vec3i OccluderGrid::cell_at(const Vec3& point, double margin) const {
    Vec3i cell;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (point[axis] - origin_[axis]) * cells_per_metre_ + margin;
        cell[axis] = static_cast<int>(std::floor(std::clamp<double>(at, -key_bias, key_bias - 1)));
    }
    return cell;
}

std::uint64_t OccluderGrid::range_mask(const Vec3i& brick, const Vec3i& low, const Vec3i& high) {
    const auto axis_bits = [&](int axis) {
        const int first = std::max(low[axis] - 4 * brick[axis], 0);
        const int last = std::min(high[axis] - 4 * brick[axis], 3);
        return (std::uint64_t{2} << last) - (std::uint64_t{1} << first);  // first .. last of four
    };
    constexpr std::uint64_t row[] = {0, 0xf}, layer[] = {0, 0xffff};
    const std::uint64_t x = axis_bits(0), y = axis_bits(1), z = axis_bits(2);
    std::uint64_t rows = 0, layers = 0;
    for (int k = 0; k < 4; ++k) {
        rows |= row[y >> k & 1] << (4 * k);
        layers |= layer[z >> k & 1] << (16 * k);
    }
    return x * 0x1111111111111111ULL & rows * 0x0001000100010001ULL & layers;
}

// Returns the key's slot in the table, or the empty one for its insertion.
std::size_t OccluderGrid::slot_of(std::uint64_t key) const {
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = slot_hash(key) & mask;
    while (table_[slot] != 0 && bricks_[table_[slot] - 1].key != key) slot = (slot + 1) & mask;
    return slot;
}

const OccluderGrid::Brick* OccluderGrid::find_brick(const Vec3i& coordinates) const {
    const std::size_t word = word_of(coordinates);
    const std::uint32_t entry =
        word < brick_indices_.size() ? brick_indices_[word] : table_[slot_of(key_of(coordinates))];
    return entry == 0 ? nullptr : &bricks_[entry - 1];
}

std::size_t OccluderGrid::make_brick(const Vec3i& coordinates) {
    const std::uint64_t key = key_of(coordinates);
    if (const std::uint32_t entry = table_[slot_of(key)]; entry != 0) return entry - 1;
    if (2 * (bricks_.size() + 1) > table_.size()) {
        table_.assign(2 * table_.size(), 0);
        for (std::size_t b = 0; b < bricks_.size(); ++b)
            table_[slot_of(bricks_[b].key)] = static_cast<std::uint32_t>(b + 1);
    }
    const std::size_t slot = slot_of(key);
    bricks_.emplace_back();
    bricks_.back().key = key;
    bricks_.back().packed =
        PackedTriangles(origin_ + cell_size_ * (4 * coordinates.cast<double>() + Vec3::Constant(2)));
    table_[slot] = static_cast<std::uint32_t>(bricks_.size());
    if (const std::size_t word = word_of(coordinates); word < brick_indices_.size())
        brick_indices_[word] = table_[slot];
    return bricks_.size() - 1;
}

std::uint32_t OccluderGrid::store(const OccluderTriangle& triangle) {
    assert(triangle.corner[0].allFinite() && triangle.corner[1].allFinite() &&
           triangle.corner[2].allFinite());
    const Entry entry{triangle, triangle.bounds()};
    if (free_.empty()) {
        entries_.push_back(entry);
        return static_cast<std::uint32_t>(entries_.size() - 1);
    }
    const std::uint32_t id = free_.back();
    free_.pop_back();
    entries_[id] = entry;
    return id;
}

// Adds a triangle of the cell to the packs of its brick, or to loose_.
void OccluderGrid::pack(Brick& brick, const Vec3i& cell, std::uint32_t id) {
    const Entry& entry = entries_[id];
    const Vec3 centre = brick.packed.centre();
    const double reach =
        std::max((entry.box.max - centre).maxCoeff(), (centre - entry.box.min).maxCoeff()) - 2 * cell_size_;
    if (reach > tuning::occluders::max_overhang * cell_size_) {
        loose_.push_back({key_of(cell), id});
        return;
    }
    overhang_ = std::max(overhang_, reach);
    const std::uint32_t local = local_of(cell);
    const std::uint32_t block = (local >> 1 & 1) | (local >> 3 & 1) << 1 | (local >> 5 & 1) << 2;
    brick.packed.add(static_cast<std::uint8_t>(local), static_cast<std::uint8_t>(block),
                     entry.triangle.corner, entry.triangle.boundary, id);
}

// Calls use(cell, ref) for each cell that lists the triangle. Returns false, without a
// call, if the triangle is too long.
template <class Use>
bool OccluderGrid::for_listings(std::uint64_t owner, std::uint32_t index, std::uint32_t id,
                                const Use& use) const {
    const Vec3i low = cell_at(entries_[id].box.min, -listing_margin);
    const Vec3i high = cell_at(entries_[id].box.max, listing_margin);
    if ((high - low).maxCoeff() >= tuning::occluders::max_span) return false;
    const RoughBox rough = RoughBox::around(entries_[id].box);
    const RoughPlane plane(entries_[id].triangle.corner, origin_);
    for (int z = low[2]; z <= high[2]; ++z)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int x = low[0]; x <= high[0]; ++x) {
                const Vec3i cell(x, y, z);
                std::uint32_t spread = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    spread |= std::uint32_t{cell[axis] > low[axis]} << axis;
                    spread |= std::uint32_t{cell[axis] < high[axis]} << (3 + axis);
                }
                use(cell, Ref{owner, index, id, spread, changes_, rough, plane});
            }
    return true;
}

void OccluderGrid::set_cell(const Vec3i& cell, std::span<const OccluderTriangle> triangles) {
    const CellTriangles one{cell, triangles};
    set_cells({&one, 1}, Parallel(1));
}

// Processes cells in the order of their keys, so that new listings of a brick come in the order of its refs.
void OccluderGrid::set_cells(std::span<const CellTriangles> cells, const Parallel& parallel) {
    std::vector<std::pair<std::uint64_t, const CellTriangles*>> order;
    for (const CellTriangles& of : cells)
        if (!of.triangles.empty() || find_brick(brick_of(of.cell))) order.push_back({key_of(of.cell), &of});
    std::sort(order.begin(), order.end());
    if (!order.empty()) ++changes_;
    std::vector<std::uint64_t> owners;
    for (const auto& [owner, of] : order) owners.push_back(owner);
    assert(std::adjacent_find(owners.begin(), owners.end()) == owners.end());
    TouchedBricks touched;
    for (const auto& [owner, of] : order) {
        const std::size_t home = make_brick(brick_of(of->cell));
        take_out(home, of->cell, touched);
        put_in(home, *of, touched);
    }
    parallel.for_each(touched.bricks.size(), 4, [&](std::size_t k) {
        TouchedBrick& brick = touched.bricks[k];
        std::stable_sort(brick.added.begin(), brick.added.end(),
                         [](const Listing& a, const Listing& b) { return a.local < b.local; });
        rebuild(bricks_[brick.index], owners, brick.added);
    });
}

OccluderGrid::TouchedBrick& OccluderGrid::touch(const Vec3i& brick, TouchedBricks& touched) {
    if (!touched.bricks.empty() && touched.last_position == brick) return touched.bricks[touched.last];
    const std::size_t index = make_brick(brick);
    if (touched.of_brick.size() < bricks_.size()) touched.of_brick.resize(bricks_.size(), -1);
    if (touched.of_brick[index] < 0) {
        touched.of_brick[index] = static_cast<std::int32_t>(touched.bricks.size());
        touched.bricks.push_back({index, {}});
    }
    touched.last = static_cast<std::size_t>(touched.of_brick[index]);
    touched.last_position = brick;
    return touched.bricks[touched.last];
}

// Removes the cell's triangles except their refs; records the bricks that list them.
void OccluderGrid::take_out(std::size_t home, const Vec3i& cell, TouchedBricks& touched) {
    assert((cell.array() >= 0).all() && (cell.array() < cell_count_.array()).all());
    const std::uint64_t owner = key_of(cell);
    for (std::size_t k = 0; k < bricks_[home].owned.size(); ++k) {
        const Owned o = bricks_[home].owned[k];
        if (o.owner != owner) continue;
        for_listings(owner, 0, o.id, [&](const Vec3i& at, const Ref&) { touch(brick_of(at), touched); });
        free_.push_back(o.id);
        entries_[o.id].box = {};
        --triangle_count_;
    }
    const auto is_own = [&](const auto& kept) { return kept.owner == owner; };
    std::erase_if(bricks_[home].owned, is_own);
    std::erase_if(large_, is_own);
    std::erase_if(loose_, is_own);
    bricks_[home].packed.remove(static_cast<std::uint8_t>(local_of(cell)));
}

void OccluderGrid::put_in(std::size_t home, const CellTriangles& of, TouchedBricks& touched) {
    const std::uint64_t owner = key_of(of.cell);
    for (std::uint32_t index = 0; index < of.triangles.size(); ++index) {
        const std::uint32_t id = store(of.triangles[index]);
        bricks_[home].owned.push_back({owner, id});
        pack(bricks_[home], of.cell, id);
        ++triangle_count_;
        if (for_listings(owner, index, id, [&](const Vec3i& at, const Ref& ref) {
                touch(brick_of(at), touched).added.push_back({local_of(at), ref});
            }))
            continue;
        const Ref ref{owner, index, id, 0, changes_, RoughBox::around(entries_[id].box), RoughPlane{}};
        large_.insert(std::upper_bound(large_.begin(), large_.end(), ref,
                                       [](const Ref& a, const Ref& b) {
                                           return std::tie(a.owner, a.index) < std::tie(b.owner, b.index);
                                       }),
                      ref);
    }
}

// Replaces the owners' refs in the brick by `added`, which must be sorted by cell, then owner, then
// index; `owners` must be ascending.
void OccluderGrid::rebuild(Brick& brick, std::span<const std::uint64_t> owners,
                           std::span<const Listing> added) {
    std::vector<Ref> refs;
    refs.reserve(brick.refs.size() + added.size());
    std::array<std::uint32_t, brick_cells + 1> first{};
    brick.occupied = 0;
    std::uint64_t known = ~std::uint64_t{0};
    bool is_replaced = false;
    const auto replaced = [&](std::uint64_t owner) {
        if (owner != known) is_replaced = std::binary_search(owners.begin(), owners.end(), owner);
        known = owner;
        return is_replaced;
    };
    auto next = added.begin();
    for (std::uint32_t local = 0; local < brick_cells; ++local) {
        first[local] = static_cast<std::uint32_t>(refs.size());
        const auto take_until = [&](std::uint64_t owner) {
            for (; next != added.end() && next->local == local && next->ref.owner < owner; ++next)
                refs.push_back(next->ref);
        };
        for (std::uint32_t r = brick.first[local]; r < brick.first[local + 1]; ++r) {
            if (replaced(brick.refs[r].owner)) continue;
            take_until(brick.refs[r].owner);
            refs.push_back(brick.refs[r]);
        }
        take_until(~std::uint64_t{0});
        if (refs.size() > first[local]) brick.occupied |= std::uint64_t{1} << local;
    }
    first[brick_cells] = static_cast<std::uint32_t>(refs.size());
    brick.first = first;
    brick.refs = std::move(refs);
    lay_lanes(brick);
    if (const std::size_t word = word_of(coordinates_of(brick.key)); word < words_.size())
        words_[word] = brick.occupied;
}

void OccluderGrid::lay_lanes(Brick& brick) {
    constexpr std::uint32_t width = OccluderLanes::width;
    std::uint32_t count = 0;
    for (std::size_t local = 0; local < brick_cells; ++local) {
        brick.first_lanes[local] = count;
        count += (brick.first[local + 1] - brick.first[local] + width - 1) / width;
    }
    brick.lanes.resize(count);
    for (std::size_t local = 0; local < brick_cells; ++local) {
        const std::uint32_t listed = brick.first[local + 1] - brick.first[local];
        OccluderLanes* lanes = brick.lanes.data() + brick.first_lanes[local];
        brick.newest[local] = 0;
        for (std::uint32_t k = 0; k < listed; ++k) {
            const Ref& ref = brick.refs[brick.first[local] + k];
            brick.newest[local] = std::max(brick.newest[local], ref.change);
            lanes[k / width].set(k % width, ref.box, ref.plane, ref.id, ref.spread, ref.change);
        }
        for (std::uint32_t k = listed; k % width != 0; ++k) lanes[k / width].clear(k % width);
    }
}

std::vector<const OccluderGrid::Brick*> OccluderGrid::sorted_bricks(const Vec3i& first,
                                                                    const Vec3i& last) const {
    std::vector<const Brick*> out;
    for (const Brick& brick : bricks_) {
        const Vec3i coordinates = coordinates_of(brick.key);
        if ((coordinates.array() >= first.array()).all() && (coordinates.array() <= last.array()).all())
            out.push_back(&brick);
    }
    std::sort(out.begin(), out.end(), [](const Brick* a, const Brick* b) { return a->key < b->key; });
    return out;
}

void OccluderGrid::gather(const Box& box, std::vector<OccluderTriangle>& out) const {
    visit(box, [&](const OccluderTriangle& triangle) { out.push_back(triangle); });
}

bool OccluderGrid::is_clear(const Box& box) const {
    if (triangle_count_ == 0) return true;
    for (const Ref& ref : large_)
        if (entries_[ref.id].box.meets(box)) return false;
    return is_clear(cell_at(box.min, 0), cell_at(box.max, 0));
}

// Returns false also for ranges where the test would cost more than it saves.
bool OccluderGrid::is_clear(const Vec3i& low, const Vec3i& high) const {
    const Vec3i first = brick_of(low), last = brick_of(high);
    if ((last - first).maxCoeff() >= tuning::occluders::max_clear_bricks) return false;
    for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
            for (int x = first[0]; x <= last[0]; ++x) {
                const std::uint64_t cells = occupied({x, y, z});
                if (cells != 0 && (cells & range_mask({x, y, z}, low, high)) != 0) return false;
            }
    return true;
}

// seen: spread bits that mark refs which the previous cell of the walk listed as well.
std::uint32_t OccluderGrid::blocker_in(const Brick& brick, std::uint32_t local, std::uint32_t seen,
                                       Walk& walk) const {
    if (brick.newest[local] <= walk.since) return no_triangle;
    if (!walk.rough) walk.rough.emplace(walk.a, walk.b, walk.box, origin_);
    const std::uint32_t listed = brick.first[local + 1] - brick.first[local];
    const OccluderLanes* lanes = &brick.lanes[brick.first_lanes[local]];
    for (std::uint32_t first = 0; first < listed; first += OccluderLanes::width, ++lanes)
        for (std::uint32_t left = lanes_that_may_meet(*lanes, *walk.rough, seen, walk.since); left != 0;
             left &= left - 1) {
            const std::uint32_t id = lanes->id(static_cast<std::size_t>(std::countr_zero(left)));
            const Entry& entry = entries_[id];
            if (entry.box.meets(walk.box) && segment_meets_triangle(walk.a, walk.b, entry.triangle.corner))
                return id;
        }
    return no_triangle;
}

bool OccluderGrid::blocks(std::uint32_t id, const Vec3& a, const Vec3& b) const {
    return id < entries_.size() && entries_[id].box.meets(walk_box(a, b)) &&
           segment_meets_triangle(a, b, entries_[id].triangle.corner);
}

Box OccluderGrid::walk_box(const Vec3& a, const Vec3& b) const {
    const Box box{a.cwiseMin(b), a.cwiseMax(b)};
    return box.grown(1e-9 * (box.size().maxCoeff() + cell_size_));
}

// Traverses the grid cell by cell (Amanatides and Woo 1987).
std::uint32_t OccluderGrid::blocker(const Vec3& a, const Vec3& b, std::uint32_t since) const {
    if (triangle_count_ == 0) return no_triangle;
    const Box box = walk_box(a, b);
    for (const Ref& ref : large_)
        if (ref.change > since && entries_[ref.id].box.meets(box) &&
            segment_meets_triangle(a, b, entries_[ref.id].triangle.corner))
            return ref.id;
    Vec3i cell = cell_at(a, 0);
    const Vec3i last = cell_at(b, 0);
    if (is_clear(cell.cwiseMin(last), cell.cwiseMax(last))) return no_triangle;
    Walk walk{a, b, box, since, {}};
    Vec3 next, stride;  // parameter of the next wall, and between walls
    Vec3i step;
    for (int axis = 0; axis < 3; ++axis) {
        step[axis] = last[axis] >= cell[axis] ? 1 : -1;
        const double length = std::abs(b[axis] - a[axis]) * cells_per_metre_;
        const double at = (a[axis] - origin_[axis]) * cells_per_metre_ - cell[axis];
        stride[axis] = length > 0 ? 1 / length : 0;
        next[axis] = (step[axis] > 0 ? 1 - at : at) * stride[axis];
    }
    std::uint64_t cells = occupied(brick_of(cell));
    const Brick* brick = nullptr;  // looked up at its first occupied cell
    for (std::uint32_t seen = 0;;) {
        const std::uint32_t local = local_of(cell);
        if ((cells >> local & 1) != 0) {
            if (!brick) brick = find_brick(brick_of(cell));
            const std::uint32_t id = blocker_in(*brick, local, seen, walk);
            if (id != no_triangle) return id;
        }
        int axis = -1;
        for (int k = 0; k < 3; ++k)
            if (cell[k] != last[k] && (axis < 0 || next[k] < next[axis])) axis = k;
        if (axis < 0) return no_triangle;
        const Vec3i old_brick = brick_of(cell);
        cell[axis] += step[axis];
        next[axis] += stride[axis];
        seen = std::uint32_t{1} << (step[axis] > 0 ? axis : 3 + axis);
        if (brick_of(cell)[axis] == old_brick[axis]) continue;
        cells = occupied(brick_of(cell));
        brick = nullptr;
    }
}

namespace {

// Returns whether a coplanar triangle and segment overlap, projected along the dominant
// axis of the normal: no line along a side separates them by more than `slack`.
bool overlap_in_plane(const std::array<Vec3, 3>& p, const Vec3& d, const Vec3& normal, double slack) {
    int facing = 0;
    normal.cwiseAbs().maxCoeff(&facing);
    const int i = (facing + 1) % 3, j = (facing + 2) % 3;
    const auto apart_across = [&](const Vec3& side) {
        const double length = std::hypot(side[i], side[j]);
        if (!(length > 0)) return false;
        const auto offset = [&](const Vec3& q) { return (side[i] * q[j] - side[j] * q[i]) / length; };
        const double end = offset(d);
        const double t[] = {offset(p[0]), offset(p[1]), offset(p[2])};
        const auto [low, high] = std::minmax({t[0], t[1], t[2]});
        return std::min(0.0, end) > high + slack || std::max(0.0, end) < low - slack;
    };
    return !(apart_across(p[1] - p[0]) || apart_across(p[2] - p[1]) || apart_across(p[0] - p[2]) ||
             apart_across(d));
}

}  // namespace

// Tests the edges by triple products, whose sign is consistent for the two triangles at
// an edge, then the sides of the triangle's plane.
bool segment_meets_triangle(const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& corner) {
    const Vec3 d = b - a;
    const std::array<Vec3, 3> p{corner[0] - a, corner[1] - a, corner[2] - a};
    const double length = d.cwiseAbs().maxCoeff();
    const double size =
        std::max(p[0].cwiseAbs().cwiseMax(p[1].cwiseAbs()).cwiseMax(p[2].cwiseAbs()).maxCoeff(), length);
    const double edge_slack = tuning::occluders::segment_tolerance * size * size * length;
    const double e0 = d.dot(p[0].cross(p[1])), e1 = d.dot(p[1].cross(p[2])), e2 = d.dot(p[2].cross(p[0]));
    const auto [low, high] = std::minmax({e0, e1, e2});
    if (low < -edge_slack && high > edge_slack) return false;
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    const double normal_size = normal.cwiseAbs().maxCoeff();
    const double plane_slack = tuning::occluders::segment_tolerance * normal_size * size;
    const double side_a = -normal.dot(p[0]);
    const double side_b = side_a + normal.dot(d);
    if ((side_a > plane_slack && side_b > plane_slack) || (side_a < -plane_slack && side_b < -plane_slack))
        return false;
    const double longest =
        std::max({(p[1] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm(), (p[0] - p[2]).squaredNorm()});
    if (!(normal_size > 1e-14 * longest)) return false;
    if (low >= -edge_slack && high <= edge_slack)
        return overlap_in_plane(p, d, normal, tuning::occluders::segment_tolerance * size);
    return true;
}

}  // namespace splitcubes::geometry
