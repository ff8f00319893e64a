#include <splitcubes/body/moving_bricks.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

using splitting::brick_side;
using splitting::GridEdge;

namespace {

static_assert(NodeHulls::side == brick_side);

// Bricks whose edges one task lists.
constexpr std::size_t brick_grain = 4;

// Of the nodes of a brick and the upper ends of its edges, rest space.
geometry::Box cube_of(const splitting::NodeGrid& grid, std::size_t brick) {
    const Vec3 low = grid.rest().node_position(grid.bricks().base(brick));
    return {low, low + Vec3::Constant(brick_side * grid.rest().cell_size)};
}

// Of the images of a box under p -> jacobian p + shift, each moved by what lies in `off`.
geometry::Box image_of(const geometry::Box& box, const Mat3& jacobian, const Vec3& shift,
                       const geometry::Box& off) {
    const Vec3 centre = jacobian * box.center() + shift;
    const Vec3 half = jacobian.cwiseAbs() * (0.5 * box.size());
    return {centre - half + off.min, centre + half + off.max};
}

double distance_squared(const Vec3& point, const geometry::Box& box) {
    return (box.min - point).cwiseMax(point - box.max).cwiseMax(0).squaredNorm();
}

// How far from its rest position a phyxel carries nodes.
double reach_of(const MovingBricks::State& state, std::size_t i) {
    return state.phyxels.support_radius[i] + state.margin;
}

}  // namespace

// By the brick that holds them; those outside the grid by the nearest one.
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

// How many bricks away a phyxel can lie that carries a node of a brick.
int MovingBricks::bricks_around(const State& state) const {
    return static_cast<int>(std::ceil(reach_ / (brick_side * state.grid.rest().cell_size)));
}

// Of what the phyxels make of a point. What is not finite does not count: any map would do,
// this one is only near.
MovingBricks::MapSum MovingBricks::sum_of(const State& state, std::span<const std::uint32_t> numbers) {
    MapSum sum;
    for (const std::size_t i : numbers) {
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

// Adds how far off the map a phyxel carries a node within reach, now and a step ago.
void MovingBricks::add_difference(const State& state, std::size_t i, const Map& map, geometry::Box& off) {
    const Vec3 mapped = map.jacobian * state.phyxels.rest_position[i] + map.shift;
    const auto add = [&](const Vec3& position, const Mat3& deformation) {
        const Vec3 at = position - mapped;
        const Vec3 spread = reach_of(state, i) * (deformation - map.jacobian).rowwise().norm();
        off.add(geometry::Box{at - spread, at + spread});
    };
    add(state.phyxels.position[i], state.phyxels.deformation[i]);
    add(state.phyxels.previous_position[i], state.previous_deformation[i]);
}

void MovingBricks::take_boxes(const State& state, const Parallel& parallel) {
    boxes_.resize(state.grid.bricks().total());
    parallel.for_each(boxes_.size(), 64, [&](std::size_t b) {
        boxes_[b] = {};
        for (std::uint32_t k = begin_[b]; k < begin_[b + 1]; ++k)
            add_difference(state, phyxels_[k], mean_, boxes_[b]);
    });
}

// Joins to each box those of up to `around` bricks before and behind it.
void MovingBricks::spread_boxes(const splitting::BrickLayout& layout, int around, int axis,
                                const Parallel& parallel) {
    narrower_ = boxes_;
    parallel.for_each(boxes_.size(), 256, [&](std::size_t b) {
        Vec3i at = layout.base(b) / brick_side;
        const int centre = at[axis];
        const int last = std::min(centre + around, layout.brick_count[axis] - 1);
        for (at[axis] = std::max(centre - around, 0); at[axis] <= last; ++at[axis])
            boxes_[b].add(narrower_[layout.brick_of(brick_side * at)]);
    });
}

void MovingBricks::choose_bricks(const State& state, const SweptBoxes& swept, const Parallel& parallel) {
    const splitting::BrickLayout& layout = state.grid.bricks();
    mean_ = parallel
                .sum(phyxels_.size(), 2048, MapSum{},
                     [&](std::size_t begin, std::size_t end) {
                         return sum_of(state, std::span(phyxels_).subspan(begin, end - begin));
                     })
                .mean();
    take_boxes(state, parallel);
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

MovingBricks::Bound MovingBricks::bound_of(const State& state, std::uint32_t brick,
                                           std::vector<std::uint32_t>& near) const {
    const splitting::BrickLayout& layout = state.grid.bricks();
    const std::vector<Vec3>& rest = state.phyxels.rest_position;
    const geometry::Box cube = cube_of(state.grid, brick);
    const int around = bricks_around(state);
    const Vec3i at = layout.base(brick) / brick_side;
    const Vec3i low = (at.array() - around).max(0);
    const Vec3i high = (at.array() + around).min(layout.brick_count.array() - 1);
    near.clear();
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y) {
            const std::uint32_t first = begin_[layout.brick_of(brick_side * Vec3i(low.x(), y, z))];
            const std::uint32_t last = begin_[layout.brick_of(brick_side * Vec3i(high.x(), y, z)) + 1];
            for (std::uint32_t k = first; k < last; ++k)
                if (const double reach = reach_of(state, phyxels_[k]);
                    distance_squared(rest[phyxels_[k]], cube) < reach * reach)
                    near.push_back(phyxels_[k]);
        }
    Bound bound{sum_of(state, near).mean(), {}};
    const Vec3 mapped = bound.map.jacobian * cube.center() + bound.map.shift;
    for (const std::uint32_t i : near) {
        const Vec3 arm = cube.center() - rest[i];
        const auto add = [&](const Vec3& position, const Mat3& deformation) {
            const Vec3 off = position + deformation * arm - mapped;
            const Vec3 spread =
                (deformation - bound.map.jacobian).cwiseAbs().rowwise().sum().cwiseProduct(0.5 * cube.size());
            bound.off.add(geometry::Box{off - spread, off + spread});
        };
        add(state.phyxels.position[i], state.phyxels.deformation[i]);
        add(state.phyxels.previous_position[i], state.previous_deformation[i]);
    }
    return bound;
}

bool MovingBricks::start_hulls(const State& state, std::uint32_t brick, const Bound& bound,
                               Scratch& scratch) const {
    const double largest = std::max(bound.off.max.cwiseAbs().maxCoeff(), bound.off.min.cwiseAbs().maxCoeff());
    if (!scratch.hulls.start(state.grid.rest().cell_size, largest)) return false;
    const Vec3 centre = cube_of(state.grid, brick).center();
    const Vec3 mapped = bound.map.jacobian * centre + bound.map.shift;
    for (const std::uint32_t i : scratch.phyxels) {
        const Vec3 arm = centre - state.phyxels.rest_position[i];
        const auto made = [&](const Vec3& position, const Mat3& deformation) {
            return NodeHulls::State{position + deformation * arm - mapped, deformation - bound.map.jacobian};
        };
        scratch.hulls.add(-arm, reach_of(state, i),
                          made(state.phyxels.position[i], state.phyxels.deformation[i]),
                          made(state.phyxels.previous_position[i], state.previous_deformation[i]));
    }
    return true;
}

void MovingBricks::add_edges(const State& state, std::uint32_t brick, const SweptBoxes& swept,
                             Scratch& scratch, std::vector<GridEdge>& out) const {
    const Bound bound = bound_of(state, brick, scratch.phyxels);
    if (bound.off.empty()) return;
    swept.meeting(image_of(cube_of(state.grid, brick), bound.map.jacobian, bound.map.shift, bound.off),
                  scratch.boxes);
    if (scratch.boxes.empty()) return;
    const bool closely = start_hulls(state, brick, bound, scratch);
    for (int block = 0; block < NodeHulls::block_count; ++block)
        add_block_edges(state, brick, block, bound, closely, swept, scratch, out);
}

// The uncut edges of the brick's nodes of one block. Not closely: by the brick's bound alone.
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
        // What no phyxel reaches goes with the others.
        if (const geometry::Box box = scratch.hulls.box_of_block(); !box.empty()) off = box;
        const Vec3 half = Vec3::Constant(0.5 * NodeHulls::block_side);
        if (!swept.any_meets(image_of({-half, half}, step, corner + step * half, off), scratch.boxes)) return;
    }
    const auto moved = [&](const Vec3i& local, const geometry::Box& by) {
        const Vec3 at = corner + step * (local - low).cast<double>();
        return geometry::Box{at + by.min, at + by.max};
    };
    const auto place_of = [&](const Vec3i& local) {
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
                moving = place_of(local);
                moving.add(place_of(upper));
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
    for (std::size_t i = 0; i < state.phyxels.size(); ++i) reach_ = std::max(reach_, reach_of(state, i));
    choose_bricks(state, swept, parallel);
    edges_.resize((chosen_.size() + brick_grain - 1) / brick_grain);
    parallel.for_chunks(chosen_.size(), brick_grain, [&](std::size_t begin, std::size_t end) {
        Scratch scratch;
        edges_[begin / brick_grain].clear();
        for (std::size_t k = begin; k < end; ++k)
            add_edges(state, chosen_[k], swept, scratch, edges_[begin / brick_grain]);
    });
    std::vector<GridEdge> out;
    for (const std::vector<GridEdge>& edges : edges_) out.insert(out.end(), edges.begin(), edges.end());
    return out;
}

}  // namespace splitcubes::body
