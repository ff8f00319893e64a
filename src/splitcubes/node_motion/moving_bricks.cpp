#include <splitcubes/node_motion/moving_bricks.h>
#include <splitcubes/node_motion/tuning.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes::body {

using splitting::brick_side;
using splitting::GridEdge;

namespace {

static_assert(NodeHulls::side == brick_side);

// Returns the box of a brick's nodes and the upper ends of its edges; m, rest space.
geometry::Box cube_of(const splitting::NodeGrid& grid, std::size_t brick) {
    const Vec3 low = grid.rest().node_position(grid.bricks().base(brick));
    return {low, low + Vec3::Constant(brick_side * grid.rest().cell_size)};
}

// Returns the bounds of the images of a box under p -> jacobian p + shift + o, for all o in `off`.
geometry::Box image_of(const geometry::Box& box, const Mat3& jacobian, const Vec3& shift,
                       const geometry::Box& off) {
    const Vec3 centre = jacobian * box.center() + shift;
    const Vec3 half = jacobian.cwiseAbs() * (0.5 * box.size());
    return {centre - half + off.min, centre + half + off.max};
}

// Returns first and last grid position of the bricks at most `around` from one along each axis.
std::pair<Vec3i, Vec3i> neighbours_of(const splitting::BrickLayout& layout, std::size_t brick, int around) {
    const Vec3i at = layout.base(brick) / brick_side;
    return {(at.array() - around).max(0), (at.array() + around).min(layout.brick_count.array() - 1)};
}

// Returns the distance, m, from its rest position up to which a phyxel influences nodes.
double reach_of(const MovingBricks::State& state, std::size_t i) {
    return state.phyxels.support_radius[i] + state.margin;
}

}  // namespace

// Sorts phyxels by brick; those outside the grid go to the nearest one.
void MovingBricks::sort_phyxels(const State& state) {
    const splitting::BrickLayout& layout = state.grid.bricks();
    const std::vector<Vec3>& rest = state.phyxels.rest_position;
    const auto brick_of = [&](std::size_t i) {
        const Vec3 last = (brick_side * layout.brick_count - Vec3i::Ones()).cast<double>();
        const Vec3 node = state.grid.rest().to_grid(rest[i]).array().floor().max(0).min(last.array());
        return layout.brick_of(node.cast<int>());
    };
    begin_.assign(layout.total() + 1, 0);
    for (std::size_t i = 0; i < rest.size(); ++i) ++begin_[brick_of(i) + 1];
    for (std::size_t b = 0; b < layout.total(); ++b) begin_[b + 1] += begin_[b];
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    phyxels_.resize(rest.size());
    for (std::size_t i = 0; i < rest.size(); ++i)
        phyxels_[next[brick_of(i)]++] = static_cast<std::uint32_t>(i);
    sorted_ = rest.size();
}

// Returns the largest distance, in bricks, of a phyxel that can influence a brick's nodes.
int MovingBricks::bricks_around(const State& state) const {
    return static_cast<int>(std::ceil(reach_ / (brick_side * state.grid.rest().cell_size)));
}

// Sums the maps of phyxels without those that are not finite: the mean only needs to be close, any map would
// do.
MovingBricks::MapSum MovingBricks::sum_of(const State& state, std::span<const std::uint32_t> phyxels) {
    MapSum sum;
    for (const std::size_t i : phyxels) {
        const Mat3& f = state.phyxels.deformation[i];
        const Vec3& x = state.phyxels.position[i];
        if (std::isfinite(f.sum() + x.sum())) sum += MapSum{f, x, state.phyxels.rest_position[i], 1};
    }
    return sum;
}

MovingBricks::MapSum& MovingBricks::MapSum::operator+=(const MapSum& other) {
    jacobian += other.jacobian;
    position += other.position;
    rest += other.rest;
    count += other.count;
    return *this;
}

MovingBricks::Map MovingBricks::MapSum::mean() const {
    if (count == 0) return {};
    const Mat3 matrix = jacobian / count;
    return {matrix, (position - matrix * rest) / count};
}

// Computes per phyxel and brick the offsets from the mean map of nodes in reach, now and a step ago.
void MovingBricks::find_boxes(const State& state, const Parallel& parallel) {
    const meshless::Phyxels& phyxels = state.phyxels;
    // First per phyxel in memory order, because this loop is bound by memory bandwidth.
    phyxel_box_.resize(phyxels.size());
    parallel.for_each(phyxels.size(), 512, [&](std::size_t i) {
        const Vec3 mapped = mean_.jacobian * phyxels.rest_position[i] + mean_.shift;
        const double reach = reach_of(state, i);
        geometry::Box box;
        const auto add = [&](const Vec3& position, const Mat3& deformation) {
            const Vec3 spread = reach * (deformation - mean_.jacobian).rowwise().norm();
            const Vec3 off = position - mapped;
            // A state that is not finite cannot be cut.
            if (std::isfinite(spread.sum() + off.sum())) box.add(geometry::Box{off - spread, off + spread});
        };
        add(phyxels.position[i], phyxels.deformation[i]);
        add(phyxels.previous_position[i], state.previous_deformation[i]);
        phyxel_box_[i] = box;
    });
    boxes_.resize(state.grid.bricks().total());
    parallel.for_each(boxes_.size(), 64, [&](std::size_t b) {
        boxes_[b] = {};
        for (std::uint32_t k = begin_[b]; k < begin_[b + 1]; ++k) boxes_[b].add(phyxel_box_[phyxels_[k]]);
    });
}

// Extends each box by those of up to `around` bricks on either side along the axis.
void MovingBricks::spread_boxes(const splitting::BrickLayout& layout, int around, int axis,
                                const Parallel& parallel) {
    const auto count = static_cast<std::uint32_t>(layout.brick_count[axis]);
    std::uint32_t stride = 1;
    for (int k = 0; k < axis; ++k) stride *= static_cast<std::uint32_t>(layout.brick_count[k]);
    const auto range = static_cast<std::uint32_t>(around);
    wider_.resize(boxes_.size());
    parallel.for_each(boxes_.size(), 256, [&](std::size_t b) {
        const std::uint32_t at = static_cast<std::uint32_t>(b) / stride % count;
        const std::uint32_t first = at - std::min(at, range), last = std::min(at + range, count - 1);
        geometry::Box box;
        for (std::uint32_t k = first; k <= last; ++k) box.add(boxes_[b + k * stride - at * stride]);
        wider_[b] = box;
    });
    boxes_.swap(wider_);
}

void MovingBricks::choose_bricks(const State& state, const SweptBoxes& swept, const Parallel& parallel) {
    const splitting::BrickLayout& layout = state.grid.bricks();
    MapSum sum;
    for (std::size_t k = 0; k < phyxels_.size(); k += tuning::cutting::motion_sample_stride)
        sum += sum_of(state, std::span(phyxels_).subspan(k, 1));
    mean_ = sum.mean();
    find_boxes(state, parallel);
    for (int axis = 0; axis < 3; ++axis) spread_boxes(layout, bricks_around(state), axis, parallel);
    meets_.assign(layout.total(), 0);
    parallel.for_each(layout.total(), 256, [&](std::size_t b) {
        if (state.grid.inside_word(b) == 0 || boxes_[b].empty()) return;
        meets_[b] =
            image_of(cube_of(state.grid, b), mean_.jacobian, mean_.shift, boxes_[b]).meets(swept.bounds());
    });
    chosen_.clear();
    for (std::uint32_t b = 0; b < layout.total(); ++b)
        if (meets_[b] != 0) chosen_.push_back(b);
}

double MovingBricks::position_error(const State& state) const {
    const geometry::RestGrid& rest = state.grid.rest();
    return 1e-7 * rest.cell_size * static_cast<double>(rest.node_count.maxCoeff() + brick_side);
}

// Fills the table with the phyxels that can reach the chosen bricks.
void MovingBricks::list_influences(const State& state, const Parallel& parallel) {
    const splitting::BrickLayout& layout = state.grid.bricks();
    listed_.assign(layout.total(), 0);
    std::vector<std::uint32_t> bricks;
    for (const std::uint32_t brick : chosen_) {
        const auto [low, high] = neighbours_of(layout, brick, bricks_around(state));
        for (int z = low.z(); z <= high.z(); ++z)
            for (int y = low.y(); y <= high.y(); ++y)
                for (int x = low.x(); x <= high.x(); ++x) {
                    const std::size_t near = layout.brick_of(brick_side * Vec3i(x, y, z));
                    if (listed_[near] == 0) bricks.push_back(static_cast<std::uint32_t>(near));
                    listed_[near] = 1;
                }
    }
    influences_.resize(phyxels_.size());
    const double error = position_error(state);
    parallel.for_each(bricks.size(), 16, [&](std::size_t b) {
        for (std::uint32_t k = begin_[bricks[b]]; k < begin_[bricks[b] + 1]; ++k) {
            const std::uint32_t i = phyxels_[k];
            const Vec3& rest = state.phyxels.rest_position[i];
            const Vec3 mapped = mean_.jacobian * rest + mean_.shift;
            const auto relative_state = [&](const Vec3& position, const Mat3& deformation) {
                return InfluenceTable::State{position - mapped, deformation - mean_.jacobian};
            };
            const InfluenceTable::State now =
                relative_state(state.phyxels.position[i], state.phyxels.deformation[i]);
            const InfluenceTable::State before =
                relative_state(state.phyxels.previous_position[i], state.previous_deformation[i]);
            const double sum = now.off.sum() + now.matrix.sum() + before.off.sum() + before.matrix.sum();
            // Enlarged so that rounding excludes none.
            const double reach = (1 + 1e-5) * reach_of(state, i) + 2 * error;
            influences_.set(k, rest - state.grid.rest().origin, std::isfinite(sum) ? reach * reach : -1, now,
                            before);
        }
    });
}

void MovingBricks::start_hulls(const State& state, std::uint32_t brick, NodeHulls& hulls) const {
    const splitting::BrickLayout& layout = state.grid.bricks();
    const Vec3f centre = (cube_of(state.grid, brick).center() - state.grid.rest().origin).cast<float>();
    const auto [low, high] = neighbours_of(layout, brick, bricks_around(state));
    hulls.start(state.grid.rest().cell_size, position_error(state));
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y)
            hulls.add_from(influences_, begin_[layout.brick_of(brick_side * Vec3i(low.x(), y, z))],
                           begin_[layout.brick_of(brick_side * Vec3i(high.x(), y, z)) + 1], centre);
}

void MovingBricks::add_edges(const State& state, std::uint32_t brick, const SweptBoxes& swept,
                             Scratch& scratch, std::vector<GridEdge>& out) const {
    NodeHulls& hulls = scratch.hulls;
    start_hulls(state, brick, hulls);
    if (hulls.empty()) return;
    const bool closely = hulls.finish();
    const geometry::Box cube = cube_of(state.grid, brick);
    Bound bound{{mean_.jacobian + hulls.mean(), mean_.shift - hulls.mean() * cube.center()},
                hulls.box_of_cube()};
    swept.meeting(image_of(cube, bound.map.jacobian, bound.map.shift, bound.off), scratch.boxes);
    if (scratch.boxes.empty()) return;
    for (int block = 0; block < NodeHulls::block_count; ++block)
        add_block_edges(state, brick, block, bound, closely, swept, scratch, out);
}

// Appends the uncut edges of one block of a brick's nodes that may meet the boxes. closely: bounds of blocks
// and nodes are used, not only the brick's.
void MovingBricks::add_block_edges(const State& state, std::uint32_t brick, int block, const Bound& bound,
                                   bool closely, const SweptBoxes& swept, Scratch& scratch,
                                   std::vector<GridEdge>& out) const {
    const splitting::NodeGrid& grid = state.grid;
    const Vec3i base = grid.bricks().base(brick);
    const Vec3i low = NodeHulls::block_side * Vec3i(block & 1, block >> 1 & 1, block >> 2);
    const Vec3 corner = bound.map.jacobian * grid.rest().node_position(base + low) + bound.map.shift;
    const Mat3 step = grid.rest().cell_size * bound.map.jacobian;
    geometry::Box off = bound.off;
    if (closely) {
        scratch.hulls.choose_block(block);
        // Nodes that no phyxel reaches keep the brick's bound.
        if (const geometry::Box box = scratch.hulls.box_of_block(); !box.empty()) off = box;
        const Vec3 half = Vec3::Constant(0.5 * NodeHulls::block_side);
        if (!swept.any_meets(image_of({-half, half}, step, corner + step * half, off), scratch.boxes)) return;
    }
    const auto moved = [&](const Vec3i& local, const geometry::Box& offset) {
        const Vec3 at = corner + step * (local - low).cast<double>();
        return geometry::Box{at + offset.min, at + offset.max};
    };
    const auto node_bounds = [&](const Vec3i& local) {
        const geometry::Box& own = scratch.hulls.box_of(local);
        return moved(local, own.empty() ? bound.off : own);
    };
    for (int k = 0; k < NodeHulls::block_count; ++k) {
        const Vec3i local = low + Vec3i(k & 1, k >> 1 & 1, k >> 2);
        const Vec3i node = base + local;
        if (!grid.rest().contains(node) || !grid.inside(node)) continue;
        for (int axis = 0; axis < 3; ++axis) {
            const GridEdge edge{node, axis};
            if (!grid.has_edge(edge) || grid.is_cut(edge)) continue;
            const Vec3i upper = local + Vec3i::Unit(axis);
            geometry::Box moving = moved(local, off);
            moving.add(moved(upper, off));
            if (!swept.any_meets(moving, scratch.boxes)) continue;
            if (closely) {
                moving = node_bounds(local);
                moving.add(node_bounds(upper));
                if (!swept.any_meets(moving, scratch.boxes)) continue;
            }
            out.push_back(edge);
        }
    }
}

std::vector<GridEdge> MovingBricks::edges_near(const State& state, const SweptBoxes& swept,
                                               const Parallel& parallel) {
    if (sorted_ != state.phyxels.size() || begin_.empty()) sort_phyxels(state);
    reach_ = 0;
    for (const double radius : state.phyxels.support_radius) reach_ = std::max(reach_, radius + state.margin);
    choose_bricks(state, swept, parallel);
    list_influences(state, parallel);
    constexpr std::size_t grain = tuning::grains::moving_bricks;
    edges_.resize((chosen_.size() + grain - 1) / grain);
    scratch_.resize(std::max(scratch_.size(), edges_.size()));
    parallel.for_chunks(chosen_.size(), grain, [&](std::size_t begin, std::size_t end) {
        Scratch& scratch = scratch_[begin / grain];
        edges_[begin / grain].clear();
        for (std::size_t k = begin; k < end; ++k)
            add_edges(state, chosen_[k], swept, scratch, edges_[begin / grain]);
    });
    std::vector<GridEdge> out;
    for (const std::vector<GridEdge>& edges : edges_) out.insert(out.end(), edges.begin(), edges.end());
    return out;
}

}  // namespace splitcubes::body
