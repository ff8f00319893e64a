// Solid of a closed mesh, by integer winding numbers along the grid's lines: exact, without a tolerance.
#include <splitcubes/splitting/boundary_crossings.h>

#include <cstdlib>

namespace splitcubes::splitting {

using geometry::EdgeCrossing;
using geometry::GridCrossings;
using geometry::TriangleMesh;

namespace {

// Sets the inside nodes from the crossings along x: those with a winding number other than zero.
void set_inside(const GridCrossings& sweep, NodeGrid& grid) {
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
}

// Processes one edge; `winding` is the winding number of its lower node. Points with a winding number other
// than zero are material.
class ExactEdge {
  public:
    ExactEdge(const NodeGrid& grid, const TriangleMesh& mesh, BoundaryPart& part)
        : grid_(grid), mesh_(mesh), part_(part) {}

    /// Returns the winding number of the upper node.
    int process(std::span<const EdgeCrossing> crossings, int winding) {
        int after = winding;
        for (const EdgeCrossing& c : crossings) after -= c.direction;
        part_.overlap = part_.overlap || std::abs(winding) > 1;
        part_.positive = part_.positive || winding > 0;
        part_.negative = part_.negative || winding < 0;
        const bool lower = winding != 0, upper = after != 0;
        if (lower && upper) {
            cut_gap(crossings, winding);
            return after;
        }
        if (lower != upper) cut_boundary(crossings, winding, lower);
        note_detached(crossings, winding);
        return after;
    }

  private:
    void cut(const EdgeCrossing& at, double parameter) {
        part_.cuts.push_back({{at.node, at.axis}, parameter, geometry::triangle_normal(mesh_, at.triangle)});
    }

    // Cuts at the first change of state seen from the inside node.
    void cut_boundary(std::span<const EdgeCrossing> crossings, int winding, bool lower) {
        int w = winding;
        const EdgeCrossing* chosen = nullptr;
        for (const EdgeCrossing& c : crossings) {
            const int next = w - c.direction;
            if ((w != 0) != (next != 0) && (!lower || !chosen)) chosen = &c;
            w = next;
        }
        cut(*chosen, chosen->parameter);
    }

    // Cuts the widest void between two inside nodes at its middle.
    void cut_gap(std::span<const EdgeCrossing> crossings, int winding) {
        int w = winding;
        const EdgeCrossing* begin = nullptr;
        const EdgeCrossing* at = nullptr;
        double widest = -1, middle = 0;
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
        ++part_.gap_edges;
        cut(*at, middle);
    }

    // Records material that begins and ends on the edge, so that it reaches neither node.
    void note_detached(std::span<const EdgeCrossing> crossings, int winding) {
        int w = winding;
        const EdgeCrossing* enter = nullptr;
        for (const EdgeCrossing& c : crossings) {
            const int next = w - c.direction;
            if (w == 0) enter = &c;
            if (w != 0 && next == 0 && enter) return note_thin(grid_, mesh_, *enter, c, part_);
            w = next;
        }
    }

    const NodeGrid& grid_;
    const TriangleMesh& mesh_;
    BoundaryPart& part_;
};

}  // namespace

NodeGrid solidify_exact(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                        const Parallel& parallel) {
    const GridCrossings sweep = geometry::sweep_grid(rest, mesh, parallel);
    NodeGrid grid(rest);
    set_inside(sweep, grid);
    BoundaryPart found = for_each_edge(
        sweep, parallel, [&](BoundaryPart& part, std::span<const EdgeCrossing> crossings, int& winding) {
            winding = ExactEdge(grid, mesh, part).process(crossings, winding);
        });
    cut_boundary_edges(grid, found.cuts);
    report.gap_edges = found.gap_edges;
    report.overlap = found.overlap;
    report.opposed = found.positive && found.negative;
    report_thin(mesh, rest, found.lost, report);
    return grid;
}

}  // namespace splitcubes::splitting
