#include <splitcubes/splitting/small_piece.h>

#include <algorithm>

namespace splitcubes::splitting {

bool collect_small_piece(const NodeGrid& grid, const Vec3i& start, std::size_t limit,
                         const std::function<bool(const Vec3i&)>& is_large, std::vector<Vec3i>& nodes) {
    nodes.assign(1, start);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes.size() > limit || is_large(nodes[i])) return false;
        for (int axis = 0; axis < 3; ++axis)
            for (const bool upwards : {false, true}) {
                GridEdge edge{nodes[i], axis};
                if (!upwards) --edge.node[axis];
                if (!grid.has_edge(edge) || grid.is_cut(edge)) continue;
                const Vec3i next = upwards ? edge.upper() : edge.node;
                // A linear search: pieces are small.
                if (std::find(nodes.begin(), nodes.end(), next) == nodes.end()) nodes.push_back(next);
            }
    }
    // The order does not depend on the start.
    std::sort(nodes.begin(), nodes.end(), [](const Vec3i& a, const Vec3i& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    });
    return true;
}

}  // namespace splitcubes::splitting
