// Which edges of a crack's front need not be asked for their stress: whatever it is, it does not cut them.
#include <splitcubes/body/tearing.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Of what find_proposals allows a crack's plane to be turned by: 13.9 degrees, atan(t sin a / (1 - t + t cos
// a)) for a share t = 1/4 of a direction a = 60 degrees off.
constexpr double most_turn_tangent = 0.2475;
// Cosines of 45 and of 60 degrees less that. Turned planes whose normals all lie within 45 degrees of
// another, or of its opposite, have a sum that does; so it is with 60 degrees where no two of the normals are
// more than 90 degrees apart, as those of planes that were within 31 degrees of one of them.
constexpr double sure_shadow_cosine = 0.857, sure_shadow_of_one = 0.695, alike_cosine = 0.857;
constexpr std::array<int, 4> along_line{-1, -2, 1, 2};

}  // namespace

// Whether a plane through the tip's middle, turned by as much as stress may turn it, meets the edge
// from a to b or, by `slack` of its length, its continuation.
bool Tearing::may_meet(const Tip& tip, const Vec3& a, const Vec3& b, double slack) {
    const Vec3 from = a - slack * (b - a) - tip.centre, to = b + slack * (b - a) - tip.centre;
    const double height_from = tip.normal.dot(from), height_to = tip.normal.dot(to);
    if (height_from * height_to <= 0) return true;
    // The distance from the normal is largest at an end.
    const double width =
        std::max((from - height_from * tip.normal).norm(), (to - height_to * tip.normal).norm());
    return std::min(std::abs(height_from), std::abs(height_to)) <= most_turn_tangent * width;
}

// Bit k: the crossing at along_line[k] edges from this one shadows it, whichever plane the tip proposes.
Tearing::Shadows Tearing::sure_shadows(const NodeGrid& grid, const Tip& tip, const GridEdge& edge) const {
    if (tip.seam || tip.gape_stress > slab_gape * settings_.strength * weakest_all_) return {};
    Shadows out;
    bool is_open = true;
    for (std::size_t k = 0; k < along_line.size(); ++k) {
        is_open = is_open || std::abs(along_line[k]) == 1;
        GridEdge other = edge;
        other.node[edge.axis] += along_line[k];
        is_open = is_open && grid.has_edge(other);
        const std::int32_t slot = is_open ? grid.slot(other) : -1;
        if (slot < 0) continue;
        const splitting::Crossing& c = grid.crossing(slot);
        is_open = c.origin != splitting::Origin::boundary;
        const double cosine = is_open ? std::abs(c.normal.dot(tip.normal)) : 0;
        out.of_one |= unsigned{cosine > sure_shadow_of_one} << k;
        out.of_all |= unsigned{cosine > sure_shadow_cosine} << k;
    }
    return out;
}

// Of the edges asked for by `requests_`, those that one crossing shadows for all who ask. They may be asked
// for again.
void Tearing::spare_shadowed(const NodeGrid& grid, const TearContext& context) {
    for (const Request& request : requests_) {
        LoadedEdge& edge = loaded_edges_[request.number];
        edge.shadows = {~0U, ~0U};
        edge.tip = request.tip;
        edge.are_tips_alike = true;
    }
    shadows_.resize(requests_.size());
    context.parallel.for_each(requests_.size(), 64, [&](std::size_t r) {
        shadows_[r] = sure_shadows(grid, tips_[requests_[r].tip], requests_[r].edge);
    });
    for (std::size_t r = 0; r < requests_.size(); ++r) {
        LoadedEdge& edge = loaded_edges_[requests_[r].number];
        edge.shadows.of_one &= shadows_[r].of_one;
        edge.shadows.of_all &= shadows_[r].of_all;
        const double cosine = tips_[edge.tip].normal.dot(tips_[requests_[r].tip].normal);
        edge.are_tips_alike = edge.are_tips_alike && std::abs(cosine) > alike_cosine;
    }
    std::erase_if(asked_, [&](std::uint32_t number) {
        LoadedEdge& edge = loaded_edges_[number];
        if (!is_spared(edge)) return false;
        edge.asked = 0;
        edge.stress = {};
        edge.strength = std::numeric_limits<double>::infinity();
        return true;
    });
}

}  // namespace splitcubes::body
