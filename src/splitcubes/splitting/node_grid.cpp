#include <splitcubes/splitting/node_grid.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace splitcubes::splitting {

std::uint64_t edge_id(const GridEdge& edge) {
    return static_cast<std::uint64_t>(edge.node[0]) | static_cast<std::uint64_t>(edge.node[1]) << 16 |
           static_cast<std::uint64_t>(edge.node[2]) << 32 | static_cast<std::uint64_t>(edge.axis) << 48;
}

GridEdge edge_from_id(std::uint64_t id) {
    return {{static_cast<int>(id & 0xffff), static_cast<int>(id >> 16 & 0xffff),
             static_cast<int>(id >> 32 & 0xffff)},
            static_cast<int>(id >> 48)};
}

GridFace face_beside(const GridEdge& edge, int side) {
    const int across = (edge.axis + 1 + side / 2) % 3;
    GridFace face{edge.node, 3 - edge.axis - across};
    if (side % 2 == 0) --face.node[across];
    return face;
}

GridEdge opposite_edge(const GridEdge& edge, int side) {
    GridEdge out = edge;
    out.node[(edge.axis + 1 + side / 2) % 3] += side % 2 == 0 ? -1 : 1;
    return out;
}

NodeGrid::NodeGrid(const RestGrid& rest)
    : rest_(rest), layout_(rest.node_count), words_(layout_.total()), edge_slots_(layout_) {}

void NodeGrid::set_inside_row(int y, int z, int first, int last) {
    assert(crossings_.empty() || first >= last);
    for (int x = first; x < last;) {
        const Vec3i node(x, y, z);
        const int end = std::min(last, (x / brick_side + 1) * brick_side);
        const std::uint64_t run = (std::uint64_t{1} << (end - x)) - 1;
        words_[layout_.brick_of(node)].inside |= run << BrickLayout::local(node);
        x = end;
    }
}

std::size_t NodeGrid::inside_count() const {
    std::size_t count = 0;
    for (const BrickWords& words : words_) count += static_cast<std::size_t>(std::popcount(words.inside));
    return count;
}

std::int32_t NodeGrid::cut(const GridEdge& edge, double parameter, const Vec3& normal, Origin origin,
                           std::int32_t cut_number) {
    assert(has_edge(edge));
    if (is_cut(edge)) return -1;
    Crossing crossing;
    crossing.edge = edge;
    crossing.hit = std::isfinite(parameter) ? std::clamp(parameter, 0.0, 1.0) : 0.5;
    const double length = normal.norm();
    if (std::isfinite(length) && length > 0) {
        crossing.normal = normal / length;
        if (crossing.normal[edge.axis] < 0) crossing.normal = -crossing.normal;
    } else {
        crossing.normal = Vec3::Unit(edge.axis);
    }
    crossing.origin = origin;
    crossing.cut = cut_number;
    return put(crossing);
}

std::int32_t NodeGrid::put(Crossing crossing) {
    const GridEdge& edge = crossing.edge;
    assert(has_edge(edge) && !is_cut(edge));
    words_[layout_.brick_of(edge.node)].cut[static_cast<std::size_t>(edge.axis)] |=
        std::uint64_t{1} << BrickLayout::local(edge.node);
    crossing.parameter = std::clamp(crossing.hit, min_parameter, 1 - min_parameter);
    const auto slot = static_cast<std::int32_t>(crossings_.size());
    crossings_.push_back(crossing);
    edge_slots_.set(edge.node, edge.axis, slot);
    return slot;
}

bool NodeGrid::ends_in(const CutFront& front) const {
    const Crossing& crossing = this->crossing(front.slot);
    if (crossing.origin != Origin::cut) return false;
    const GridEdge opposite = opposite_edge(crossing.edge, front.side);
    if (!has_edge(opposite) || is_cut(opposite)) return false;
    const GridFace face = face_beside(crossing.edge, front.side);
    GridEdge between{face.node, 3 - face.axis - crossing.edge.axis};
    if (is_cut(between)) return false;
    ++between.node[crossing.edge.axis];
    return !is_cut(between);
}

void NodeGrid::move_front(const CutFront& front, int step) {
    assert(step > 0 && step < front_steps);
    crossings_[static_cast<std::size_t>(front.slot)].front[front.side] = static_cast<std::uint8_t>(step);
}

Vec3 NodeGrid::crossing_position(const Crossing& crossing) const {
    Vec3 at = crossing.edge.node.cast<double>();
    at[crossing.edge.axis] += crossing.parameter;
    return rest_.origin + rest_.cell_size * at;
}

CellEdges NodeGrid::cell_edges(const Vec3i& cell) const {
    // Finds the bricks of the corners and their positions within, from the lowest corner with carries.
    const std::size_t first_brick = layout_.brick_of(cell);
    const unsigned first_local = BrickLayout::local(cell);
    const std::size_t brick_strides[3] = {
        1, static_cast<std::size_t>(layout_.brick_count[0]),
        static_cast<std::size_t>(layout_.brick_count[0]) * static_cast<std::size_t>(layout_.brick_count[1])};
    std::size_t brick_step[3];
    unsigned local_step[3];  // modulo 64
    for (int axis = 0; axis < 3; ++axis) {
        const unsigned stride = 1U << (2 * axis);
        const bool carries = (cell[axis] & 3) == 3;
        brick_step[axis] = carries ? brick_strides[axis] : 0;
        local_step[axis] = carries ? nodes_per_brick - 3 * stride : stride;
    }
    CellEdges out;
    std::array<std::size_t, corner_count> brick;
    std::array<unsigned, corner_count> local;
    for (unsigned c = 0; c < corner_count; ++c) {
        brick[c] = first_brick;
        local[c] = first_local;
        for (unsigned axis = 0; axis < 3; ++axis)
            if (c >> axis & 1U) {
                brick[c] += brick_step[axis];
                local[c] += local_step[axis];
            }
        local[c] %= nodes_per_brick;
        out.inside = static_cast<std::uint8_t>(out.inside | (words_[brick[c]].inside >> local[c] & 1U) << c);
    }
    for (std::size_t e = 0; e < edge_count; ++e) {
        const auto c = static_cast<std::size_t>(edge_corners[e][0]);
        const int axis = edge_axis(static_cast<int>(e));
        const bool cut = cut_word(brick[c], axis) >> local[c] & 1U;
        out.mask = static_cast<CellMask>(out.mask | cut << e);
        out.slots[e] = cut ? edge_slots_.get_at(brick[c], local[c], axis) : -1;
    }
    return out;
}

std::size_t NodeGrid::bytes() const {
    return words_.size() * sizeof(BrickWords) + edge_slots_.bytes() +
           crossings_.capacity() * sizeof(Crossing);
}

}  // namespace splitcubes::splitting
