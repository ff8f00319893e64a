#include <splitcubes/body_samples/rigid_outline.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/samples/rigid_pieces.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/small_piece.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace splitcubes::body {

namespace {

using splitting::NodeGrid;
using splitting::Surface;

// Returns the node whose material a quad bounds: the end of its edge.
Vec3i node_of(const splitting::SurfaceVertex& edge_vertex) {
    Vec3i node = edge_vertex.lowest_node;
    node[edge_vertex.axis] += edge_vertex.instance;
    return node;
}

std::vector<Vec3> vertices_of(const NodeGrid& grid, const Surface& surface, std::span<const Vec3i> nodes) {
    std::vector<std::uint32_t> indices;
    for (const Vec3i& node : nodes)
        for (int corner = 0; corner < splitting::corner_count; ++corner) {
            const Vec3i lowest = 2 * node - splitting::corner_node(node, corner);
            const std::int32_t slot = grid.has_cell(lowest) ? surface.find_cell(lowest) : -1;
            if (slot < 0) continue;
            for (const splitting::SurfaceQuad& quad :
                 surface.quads(surface.cells()[static_cast<std::size_t>(slot)]))
                if (node_of(surface.vertices()[quad.vertices[0]]) == node)
                    indices.insert(indices.end(), quad.vertices.begin(), quad.vertices.end());
        }
    std::sort(indices.begin(), indices.end());
    indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
    std::vector<Vec3> out;
    for (const std::uint32_t index : indices) out.push_back(surface.vertices()[index].rest);
    // Indices depend on the order of cuts, positions do not.
    std::sort(out.begin(), out.end(), [](const Vec3& a, const Vec3& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    });
    return out;
}

// Directions spread evenly over the sphere, on a spiral of the golden angle.
std::vector<Vec3> spread_directions() {
    constexpr int count = tuning::outline::direction_count;
    std::vector<Vec3> out;
    for (int k = 0; k < count; ++k) {
        const double z = 1 - (2 * k + 1.0) / count, radius = std::sqrt(1 - z * z);
        const double angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
        out.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
    return out;
}

}  // namespace

std::vector<Vec3> rigid_outline(const NodeGrid& grid, const Surface& surface, std::span<const Vec3i> nodes) {
    static const std::vector<Vec3> spread = spread_directions();
    const std::vector<Vec3> vertices = vertices_of(grid, surface, nodes);
    Vec3 middle = Vec3::Zero();
    for (const Vec3& vertex : vertices) middle += vertex / static_cast<double>(vertices.size());
    std::vector<Vec3> directions = spread;
    // Long pieces have ends that few of the spread directions meet.
    for (const Vec3& vertex : vertices)
        if ((vertex - middle).norm() > 0) directions.push_back((vertex - middle).normalized());
    const double cell = grid.rest().cell_size;
    std::vector<double> support(directions.size(), -std::numeric_limits<double>::infinity());
    std::vector<std::size_t> outer;  // then the others on the hull
    for (std::size_t d = 0; d < directions.size(); ++d) {
        std::size_t best = 0;
        for (std::size_t k = 0; k < vertices.size(); ++k) {
            const double reach = directions[d].dot(vertices[k]);
            if (!(reach > support[d])) continue;
            support[d] = reach;
            best = k;
        }
        if (std::find(outer.begin(), outer.end(), best) == outer.end()) outer.push_back(best);
    }
    std::vector<Vec3> out;
    if (vertices.empty()) return out;
    const auto take = [&](std::size_t k, double apart) {
        for (const Vec3& taken : out)
            if ((taken - vertices[k]).squaredNorm() < apart * apart) return;
        out.push_back(vertices[k]);
    };
    for (const std::size_t k : outer) take(k, tuning::outline::min_spacing * cell);
    for (std::size_t k = 0; k < vertices.size(); ++k) {
        bool on_hull = false;
        for (std::size_t d = 0; d < directions.size() && !on_hull; ++d)
            on_hull = support[d] - directions[d].dot(vertices[k]) < tuning::outline::hull_depth * cell;
        if (on_hull) take(k, tuning::outline::spacing * cell);
    }
    return out;
}

std::vector<Vec3> contact_points(const NodeGrid& grid, const Surface& surface, std::span<const Vec3i> nodes,
                                 const meshless::RigidPiece& body) {
    std::vector<Vec3> points = rigid_outline(grid, surface, nodes);
    for (Vec3& point : points) point = body.shape * (point - body.rest_centre);
    return points;
}

void refresh_outlines(const NodeGrid& grid, const Surface& surface, const splitting::Pieces& pieces,
                      std::span<const std::uint32_t> cells, meshless::RigidPieces& rigid) {
    if (rigid.empty()) return;
    std::vector<std::uint8_t> done(rigid.bodies.size(), 0);
    for (const std::uint32_t index : cells) {
        const splitting::SurfaceCell& cell = surface.cells()[index];
        for (int corner = 0; corner < splitting::corner_count; ++corner) {
            if (!(cell.inside >> corner & 1U)) continue;
            const Vec3i node = splitting::corner_node(cell.lowest_node, corner);
            const std::int32_t k = rigid.index(pieces.piece_of(grid, node));
            if (k < 0 || done[static_cast<std::size_t>(k)]) continue;
            done[static_cast<std::size_t>(k)] = 1;
            const meshless::RigidPiece body = rigid.bodies[static_cast<std::size_t>(k)];
            std::vector<Vec3i> nodes;
            splitting::collect_small_piece(
                grid, node, std::numeric_limits<std::size_t>::max(), [](const Vec3i&) { return false; },
                nodes);
            rigid.put(body, contact_points(grid, surface, nodes, body));
        }
    }
}

}  // namespace splitcubes::body
