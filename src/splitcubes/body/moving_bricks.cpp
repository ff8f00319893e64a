#include <splitcubes/body/moving_bricks.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

using splitting::brick_side;

namespace {

// Adds where a phyxel carries a cube of rest space (centre, half a side), now and a step ago.
void add_places(const MovingBricks::State& state, std::size_t i, const Vec3& centre, double half,
                geometry::Box& box) {
    const Vec3 offset = centre - state.phyxels.rest_position[i];
    const auto add = [&](const Vec3& position, const Mat3& deformation) {
        const Vec3 at = position + deformation * offset;
        const Vec3 spread = half * deformation.cwiseAbs().rowwise().sum();
        box.add(geometry::Box{at - spread, at + spread});
    };
    add(state.phyxels.position[i], state.phyxels.deformation[i]);
    add(state.phyxels.previous_position[i], state.previous_deformation[i]);
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

// Of all places to which a brick's phyxels carry a node.
void MovingBricks::take_boxes(const State& state, const Parallel& parallel) {
    boxes_.resize(state.grid.bricks().total());
    parallel.for_each(boxes_.size(), 64, [&](std::size_t b) {
        boxes_[b] = {};
        for (std::uint32_t k = begin_[b]; k < begin_[b + 1]; ++k)
            add_places(state, phyxels_[k], state.phyxels.rest_position[phyxels_[k]], state.reach, boxes_[b]);
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

// Of where each phyxel within reach carries the brick, a cell more to either side.
geometry::Box MovingBricks::exact_box(const State& state, std::uint32_t brick) const {
    const splitting::BrickLayout& layout = state.grid.bricks();
    const double h = state.grid.rest().cell_size;
    const Vec3i corner = layout.base(brick);
    const Vec3 centre =
        state.grid.rest().origin + h * (corner.cast<double>() + Vec3::Constant(0.5 * brick_side));
    const double half = h * (0.5 * brick_side + 1);
    const double radius = state.reach + std::sqrt(3.0) * half;
    const int around = static_cast<int>(std::ceil((radius - 0.5 * brick_side * h) / (brick_side * h)));
    const Vec3i low = (corner.array() / brick_side - around).max(0);
    const Vec3i high = (corner.array() / brick_side + around).min(layout.brick_count.array() - 1);
    geometry::Box box;
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y) {
            const std::uint32_t first = begin_[layout.brick_of(brick_side * Vec3i(low.x(), y, z))];
            const std::uint32_t last = begin_[layout.brick_of(brick_side * Vec3i(high.x(), y, z)) + 1];
            for (std::uint32_t k = first; k < last; ++k)
                if ((state.phyxels.rest_position[phyxels_[k]] - centre).squaredNorm() < radius * radius)
                    add_places(state, phyxels_[k], centre, half, box);
        }
    return box;
}

std::vector<std::uint32_t> MovingBricks::meeting(const State& state, const geometry::Box& box,
                                                 const Parallel& parallel) {
    const splitting::BrickLayout& layout = state.grid.bricks();
    if (sorted_ != state.phyxels.size() || begin_.empty()) sort_phyxels(state);
    take_boxes(state, parallel);
    geometry::Box all;
    for (const geometry::Box& one : boxes_) all.add(one);
    if (!all.meets(box)) return {};
    // A phyxel within `reach` of a node in the brick is at most so many bricks away.
    const int around = static_cast<int>(std::ceil(state.reach / (brick_side * state.grid.rest().cell_size)));
    for (int axis = 0; axis < 3; ++axis) spread_boxes(layout, around, axis, parallel);
    meets_.assign(layout.total(), 0);
    parallel.for_each(layout.total(), 16, [&](std::size_t brick) {
        if (state.grid.inside_word(brick) == 0 || !boxes_[brick].meets(box)) return;
        meets_[brick] = exact_box(state, static_cast<std::uint32_t>(brick)).meets(box);
    });
    std::vector<std::uint32_t> out;
    for (std::uint32_t brick = 0; brick < layout.total(); ++brick)
        if (meets_[brick] != 0) out.push_back(brick);
    return out;
}

}  // namespace splitcubes::body
