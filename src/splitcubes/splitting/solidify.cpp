#include <splitcubes/core/error.h>
#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/winding_number.h>
#include <splitcubes/splitting/solidify.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

namespace splitcubes::splitting {

using geometry::EdgeCrossing;
using geometry::GridCrossings;
using geometry::TriangleMesh;

namespace {

void check_input(const TriangleMesh& mesh) {
    if (mesh.triangles.empty())
        throw InputError("mesh", "has no triangles", "give a mesh that encloses volume");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (v >= mesh.positions.size())
                throw InputError("mesh", "triangle " + std::to_string(t) + " refers to vertex " +
                                             std::to_string(v) + " of " +
                                             std::to_string(mesh.positions.size()));
            if (!mesh.positions[v].allFinite())
                throw InputError("mesh", "vertex " + std::to_string(v) + " is not finite");
        }
}

bool same_edge(const EdgeCrossing& a, const EdgeCrossing& b) {
    return a.axis == b.axis && a.node == b.node;
}

// Calls visit(crossings of one edge) for each grid edge that the mesh meets.
void for_each_edge(const GridCrossings& sweep,
                   const std::function<void(std::span<const EdgeCrossing>)>& visit) {
    const auto& all = sweep.crossings;
    for (std::size_t i = 0; i < all.size();) {
        std::size_t end = i + 1;
        while (end < all.size() && same_edge(all[i], all[end])) ++end;
        visit({all.data() + i, end - i});
        i = end;
    }
}

// One edge of the exact path: winding numbers are integers, `winding` that of the
// lower node. Material is where it is not zero.
class ExactEdges {
  public:
    ExactEdges(NodeGrid& grid, const TriangleMesh& mesh, SolidifyReport& report)
        : grid_(grid), mesh_(mesh), report_(report) {}

    int process(std::span<const EdgeCrossing> crossings, int winding) {
        int after = winding;
        for (const EdgeCrossing& c : crossings) after -= c.direction;
        const GridEdge edge{crossings[0].node, crossings[0].axis};
        const bool lower = winding != 0, upper = after != 0;
        if (lower != upper) {
            cut_boundary(edge, crossings, winding, lower);
        } else if (lower) {
            cut_gap(edge, crossings, winding);
        } else {
            bool material = false;
            int w = winding;
            for (const EdgeCrossing& c : crossings) material = material || (w -= c.direction) != 0;
            report_.lost_thin_edges += material;
        }
        return after;
    }

  private:
    // The material of the inside node ends at the first change of state seen from it.
    void cut_boundary(const GridEdge& edge, std::span<const EdgeCrossing> crossings, int winding,
                      bool lower) {
        int w = winding;
        const EdgeCrossing* chosen = nullptr;
        std::size_t changes = 0;
        for (const EdgeCrossing& c : crossings) {
            const int next = w - c.direction;
            if ((w != 0) != (next != 0)) {
                ++changes;
                if (!lower || !chosen) chosen = &c;
            }
            w = next;
        }
        report_.lost_thin_edges += changes > 1;
        grid_.cut(edge, chosen->parameter, geometry::triangle_normal(mesh_, chosen->triangle),
                  Origin::boundary, -1);
    }

    // The widest stretch of void between two inside nodes is cut at its middle.
    void cut_gap(const GridEdge& edge, std::span<const EdgeCrossing> crossings, int winding) {
        int w = winding;
        const EdgeCrossing* begin = nullptr;
        double widest = -1, middle = 0;
        const EdgeCrossing* at = nullptr;
        for (const EdgeCrossing& c : crossings) {
            const int next = w - c.direction;
            if (w != 0 && next == 0) begin = &c;
            if (w == 0 && next != 0 && begin && c.parameter - begin->parameter > widest) {
                widest = c.parameter - begin->parameter;
                middle = 0.5 * (c.parameter + begin->parameter);
                at = begin;
            }
            w = next;
        }
        if (!at) return;
        ++report_.gap_edges;
        grid_.cut(edge, middle, geometry::triangle_normal(mesh_, at->triangle), Origin::boundary, -1);
    }

    NodeGrid& grid_;
    const TriangleMesh& mesh_;
    SolidifyReport& report_;
};

// Inside rows from the crossings along x, then the edges of all three families.
NodeGrid solidify_exact(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report) {
    const GridCrossings sweep = geometry::sweep_grid(rest, mesh);
    NodeGrid grid(rest);
    for (std::size_t i = 0; i < sweep.axis_begin[1];) {
        const EdgeCrossing& first = sweep.crossings[i];
        int winding = 0;
        int from = 0;
        for (; i < sweep.axis_begin[1] && sweep.crossings[i].node[1] == first.node[1] &&
               sweep.crossings[i].node[2] == first.node[2];
             ++i) {
            const EdgeCrossing& c = sweep.crossings[i];
            if (winding != 0) grid.set_inside_row(first.node[1], first.node[2], from, c.node[0] + 1);
            winding -= c.direction;
            from = c.node[0] + 1;
        }
    }
    ExactEdges edges(grid, mesh, report);
    int winding = 0;
    const EdgeCrossing* line = nullptr;
    for_each_edge(sweep, [&](std::span<const EdgeCrossing> crossings) {
        const EdgeCrossing& c = crossings[0];
        const int u = (c.axis + 1) % 3, v = (c.axis + 2) % 3;
        if (!line || line->axis != c.axis || line->node[u] != c.node[u] || line->node[v] != c.node[v])
            winding = 0;
        line = &c;
        winding = edges.process(crossings, winding);
    });
    return grid;
}

class WindingEdges {
  public:
    WindingEdges(NodeGrid& grid, const TriangleMesh& mesh, const geometry::WindingNumber& winding,
                 SolidifyReport& report)
        : grid_(grid), mesh_(mesh), winding_(winding), report_(report) {}

    // An edge that triangles meet.
    void process(std::span<const EdgeCrossing> crossings) {
        const GridEdge edge{crossings[0].node, crossings[0].axis};
        const bool lower = grid_.inside(edge.node), upper = grid_.inside(edge.upper());
        // State of each stretch between crossings.
        std::vector<std::uint8_t> state;
        state.push_back(lower);
        for (std::size_t k = 0; k + 1 < crossings.size(); ++k)
            state.push_back(inside_at(edge, 0.5 * (crossings[k].parameter + crossings[k + 1].parameter)));
        state.push_back(upper);
        if (lower != upper) {
            std::size_t chosen = crossings.size();
            for (std::size_t k = 0; k < crossings.size(); ++k)
                if (state[k] != state[k + 1] && (!lower || chosen == crossings.size())) chosen = k;
            cut_at(edge, crossings[chosen]);
            return;
        }
        for (std::size_t k = 1; k + 1 < state.size(); ++k) {
            if (state[k] == lower) continue;
            if (!lower) {
                ++report_.lost_thin_edges;
                return;
            }
            ++report_.gap_edges;
            grid_.cut(edge, 0.5 * (crossings[k - 1].parameter + crossings[k].parameter),
                      geometry::triangle_normal(mesh_, crossings[k - 1].triangle), Origin::boundary, -1);
            return;
        }
    }

    // An edge between inside and outside that no triangle meets: the level set of
    // the winding number passes through a hole of the mesh.
    void bisect(const GridEdge& edge) {
        const bool lower = grid_.inside(edge.node);
        double a = 0, b = 1;
        for (int k = 0; k < 20; ++k) {
            const double middle = 0.5 * (a + b);
            (inside_at(edge, middle) == lower ? a : b) = middle;
        }
        const double parameter = 0.5 * (a + b);
        const Vec3 at = point(edge, parameter);
        const double step = 0.05 * grid_.rest().cell_size;
        Vec3 gradient;
        for (int axis = 0; axis < 3; ++axis)
            gradient[axis] = std::abs(winding_.at(at + step * Vec3::Unit(axis))) -
                             std::abs(winding_.at(at - step * Vec3::Unit(axis)));
        ++report_.bisected_edges;
        grid_.cut(edge, parameter, -gradient, Origin::boundary, -1);
    }

  private:
    Vec3 point(const GridEdge& edge, double parameter) const {
        return grid_.rest().node_position(edge.node) +
               parameter * grid_.rest().cell_size * Vec3::Unit(edge.axis);
    }
    bool inside_at(const GridEdge& edge, double parameter) const {
        return std::abs(winding_.at(point(edge, parameter))) > 0.5;
    }
    void cut_at(const GridEdge& edge, const EdgeCrossing& c) {
        grid_.cut(edge, c.parameter, geometry::triangle_normal(mesh_, c.triangle), Origin::boundary, -1);
    }

    NodeGrid& grid_;
    const TriangleMesh& mesh_;
    const geometry::WindingNumber& winding_;
    SolidifyReport& report_;
};

NodeGrid solidify_by_winding(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                             const Parallel& parallel) {
    const geometry::WindingNumber winding(mesh);
    NodeGrid grid(rest);
    const Vec3i n = rest.node_count;
    const auto row_count = static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
    std::vector<std::uint8_t> inside(row_count * static_cast<std::size_t>(n[0]));
    parallel.for_each(row_count, 4, [&](std::size_t row) {
        for (int x = 0; x < n[0]; ++x) {
            const Vec3i node(x, static_cast<int>(row) % n[1], static_cast<int>(row) / n[1]);
            const bool margin = (node.array() == 0).any() || (node.array() == n.array() - 1).any();
            inside[row * static_cast<std::size_t>(n[0]) + static_cast<std::size_t>(x)] =
                !margin && std::abs(winding.at(rest.node_position(node))) > 0.5;
        }
    });
    for (std::size_t row = 0; row < row_count; ++row)
        for (int x = 0; x < n[0]; ++x)
            if (inside[row * static_cast<std::size_t>(n[0]) + static_cast<std::size_t>(x)])
                grid.set_inside_row(static_cast<int>(row) % n[1], static_cast<int>(row) / n[1], x, x + 1);

    WindingEdges edges(grid, mesh, winding, report);
    const GridCrossings sweep = geometry::sweep_grid(rest, mesh);
    for_each_edge(sweep, [&](std::span<const EdgeCrossing> crossings) { edges.process(crossings); });
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (!grid.has_edge(edge) || grid.is_cut(edge)) continue;
                    if (grid.inside(edge.node) != grid.inside(edge.upper())) edges.bisect(edge);
                }
    return grid;
}

}  // namespace

NodeGrid solidify(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                  const Parallel& parallel) {
    check_input(mesh);
    report = {};
    const TriangleMesh welded = geometry::weld_equal_vertices(mesh);
    const geometry::MeshCheck check = geometry::check_mesh(welded);
    report.exact = check.closed();
    NodeGrid grid = report.exact ? solidify_exact(welded, rest, report)
                                 : solidify_by_winding(welded, rest, report, parallel);
    report.nodes_inside = grid.inside_count();
    if (!report.exact)
        report.notes.push_back("the mesh is not closed (" + std::to_string(check.boundary_edges) +
                               " boundary edges, " + std::to_string(check.misoriented_edges) +
                               " edges between triangles of opposite orientation): inside is where the "
                               "generalised winding number exceeds 1/2");
    if (report.gap_edges > 0)
        report.notes.push_back(std::to_string(report.gap_edges) +
                               " edges cross a gap thinner than a cell and were cut, so the gap separates");
    if (report.lost_thin_edges > 0)
        report.notes.push_back(
            std::to_string(report.lost_thin_edges) +
            " edges cross material thinner than a cell, which is lost; a smaller cell keeps it");
    if (report.nodes_inside == 0)
        throw InputError("mesh",
                         report.lost_thin_edges > 0
                             ? "all of it is thinner than a cell of " + std::to_string(rest.cell_size) + " m"
                             : std::string("encloses no volume that a grid node falls into"),
                         "give a closed mesh, or more cells");
    return grid;
}

}  // namespace splitcubes::splitting
