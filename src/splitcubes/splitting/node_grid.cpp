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

NodeGrid::NodeGrid(const RestGrid& rest)
    : rest_(rest), layout_(rest.node_count), inside_(layout_.total(), 0), edge_slots_(layout_) {
    for (auto& words : cut_) words.assign(layout_.total(), 0);
}

void NodeGrid::set_inside_row(int y, int z, int first, int last) {
    assert(crossings_.empty() || first >= last);
    for (int x = first; x < last; ++x) {
        const Vec3i node(x, y, z);
        inside_[layout_.brick_of(node)] |= std::uint64_t{1} << BrickLayout::local(node);
    }
}

std::size_t NodeGrid::inside_count() const {
    std::size_t count = 0;
    for (const std::uint64_t word : inside_) count += static_cast<std::size_t>(std::popcount(word));
    return count;
}

std::int32_t NodeGrid::cut(const GridEdge& edge, double parameter, const Vec3& normal, Origin origin,
                           std::int32_t cut_number) {
    assert(has_edge(edge));
    std::uint64_t& word = cut_[static_cast<std::size_t>(edge.axis)][layout_.brick_of(edge.node)];
    const std::uint64_t bit = std::uint64_t{1} << BrickLayout::local(edge.node);
    if (word & bit) return -1;
    word |= bit;
    Crossing crossing;
    crossing.edge = edge;
    crossing.hit = std::isfinite(parameter) ? std::clamp(parameter, 0.0, 1.0) : 0.5;
    crossing.parameter = std::clamp(crossing.hit, min_parameter, 1 - min_parameter);
    const double length = normal.norm();
    if (std::isfinite(length) && length > 0) {
        crossing.normal = normal / length;
        if (crossing.normal[edge.axis] < 0) crossing.normal = -crossing.normal;
    } else {
        crossing.normal = Vec3::Unit(edge.axis);
    }
    crossing.origin = origin;
    crossing.cut = cut_number;
    const auto slot = static_cast<std::int32_t>(crossings_.size());
    crossings_.push_back(crossing);
    edge_slots_.set(edge.node, edge.axis, slot);
    return slot;
}

Vec3 NodeGrid::crossing_position(const Crossing& crossing) const {
    Vec3 at = crossing.edge.node.cast<double>();
    at[crossing.edge.axis] += crossing.parameter;
    return rest_.origin + rest_.cell_size * at;
}

CellMask NodeGrid::cell_mask(const Vec3i& cell) const {
    CellMask mask = 0;
    for (int e = 0; e < edge_count; ++e)
        if (is_cut(cell_edge(cell, e))) mask = static_cast<CellMask>(mask | 1 << e);
    return mask;
}

unsigned NodeGrid::cell_inside(const Vec3i& cell) const {
    unsigned bits = 0;
    for (int c = 0; c < corner_count; ++c) bits |= static_cast<unsigned>(inside(corner_node(cell, c))) << c;
    return bits;
}

std::size_t NodeGrid::bytes() const {
    return inside_.size() * sizeof(std::uint64_t) * 4 + edge_slots_.bytes() +
           crossings_.capacity() * sizeof(Crossing);
}

}  // namespace splitcubes::splitting
