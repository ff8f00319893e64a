#include <splitcubes/node_motion/node_ties.h>
#include <splitcubes/node_motion/tuning.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace splitcubes::body {

namespace {

using cutting::EdgeCut;
using splitting::GridEdge;

using TieKey = std::array<int, 3>;

TieKey key(const Vec3i& node) {
    return {node[2], node[1], node[0]};
}

// Returns the side of a cut to which its nodes are assigned, 1 or -1; the same for all nodes of a flat cut.
double side_of(const Vec3& normal) {
    static const Vec3 towards = Vec3(0.61, 0.53, 0.59);  // not along any axis, diagonal or plane of the grid
    const double along = normal.dot(towards);
    return std::abs(along) > tuning::cutting::in_plane_cosine ? std::copysign(1.0, along) : 0.0;
}

struct Tie {
    Vec3 normal = Vec3::Zero();  // unit, rest space, towards the node's side
    // Per axis: whether the edge below and the edge above are hit at the node.
    std::array<std::array<bool, 2>, 3> hit{};
};

using Ties = std::map<TieKey, Tie>;

bool is_open(const splitting::NodeGrid& grid, const GridEdge& edge) {
    return (edge.node.array() >= 0).all() && grid.has_edge(edge) && grid.inside(edge.node) &&
           grid.inside(edge.upper()) && !grid.is_cut(edge);
}

bool is_certain(const splitting::NodeGrid& grid, const Vec3i& node, const Tie& tie) {
    if (tie.normal.isZero(0)) return false;
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(tie.normal[axis]) <= tuning::cutting::in_plane_cosine) continue;
        const auto& hit = tie.hit[static_cast<std::size_t>(axis)];
        const GridEdge below{node - Vec3i::Unit(axis), axis}, above{node, axis};
        if ((!hit[0] && is_open(grid, below)) || (!hit[1] && is_open(grid, above))) return false;
    }
    return true;
}

bool meets_lower(const EdgeCut& cut) {
    return cut.parameter <= tuning::cutting::node_hit_share;
}

bool meets_upper(const EdgeCut& cut) {
    return cut.parameter >= 1 - tuning::cutting::node_hit_share;
}

Ties ties_of(const splitting::NodeGrid& grid, const std::vector<EdgeCut>& cuts) {
    Ties ties;
    for (const EdgeCut& cut : cuts) {
        if (!meets_lower(cut) && !meets_upper(cut)) continue;
        const GridEdge edge = splitting::edge_from_id(cut.id);
        const auto axis = static_cast<std::size_t>(edge.axis);
        if (!(std::abs(cut.rest_normal[edge.axis]) > tuning::cutting::in_plane_cosine)) continue;
        Tie& tie = ties[key(meets_lower(cut) ? edge.node : edge.upper())];
        tie.hit[axis][meets_lower(cut) ? 1 : 0] = true;
        if (tie.normal.isZero(0)) tie.normal = side_of(cut.rest_normal) * cut.rest_normal;
    }
    for (auto at = ties.begin(); at != ties.end();) {
        const Vec3i node(at->first[2], at->first[1], at->first[0]);
        at = is_certain(grid, node, at->second) ? std::next(at) : ties.erase(at);
    }
    return ties;
}

bool is_redundant(const EdgeCut& cut, const Ties& ties) {
    const GridEdge edge = splitting::edge_from_id(cut.id);
    const auto lower = ties.find(key(edge.node)), upper = ties.find(key(edge.upper()));
    if (lower != ties.end() && meets_lower(cut) &&
        lower->second.normal[edge.axis] > tuning::cutting::in_plane_cosine)
        return true;
    if (upper != ties.end() && meets_upper(cut) &&
        upper->second.normal[edge.axis] < -tuning::cutting::in_plane_cosine)
        return true;
    if (lower == ties.end() || upper == ties.end()) return false;
    const Vec3 &a = lower->second.normal, &b = upper->second.normal;
    return std::abs(a[edge.axis]) <= tuning::cutting::in_plane_cosine &&
           std::abs(b[edge.axis]) <= tuning::cutting::in_plane_cosine && a.dot(b) > 0;
}

}  // namespace

void resolve_node_ties(const splitting::NodeGrid& grid, std::vector<EdgeCut>& cuts) {
    const Ties ties = ties_of(grid, cuts);
    if (ties.empty()) return;
    cuts.erase(
        std::remove_if(cuts.begin(), cuts.end(), [&](const EdgeCut& cut) { return is_redundant(cut, ties); }),
        cuts.end());
}

}  // namespace splitcubes::body
