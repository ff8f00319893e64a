#include <splitcubes/splitting/boundary_crossings.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::splitting {

using geometry::EdgeCrossing;

namespace {

bool same_edge(const EdgeCrossing& a, const EdgeCrossing& b) {
    return a.axis == b.axis && a.node == b.node;
}

bool same_line(const EdgeCrossing& a, const EdgeCrossing& b) {
    const int u = (a.axis + 1) % 3, v = (a.axis + 2) % 3;
    return a.axis == b.axis && a.node[u] == b.node[u] && a.node[v] == b.node[v];
}

}  // namespace

void BoundaryPart::append(BoundaryPart&& other) {
    if (cuts.empty())
        cuts = std::move(other.cuts);
    else
        cuts.insert(cuts.end(), other.cuts.begin(), other.cuts.end());
    lost.insert(lost.end(), other.lost.begin(), other.lost.end());
    gap_edges += other.gap_edges;
    overlap = overlap || other.overlap;
    positive = positive || other.positive;
    negative = negative || other.negative;
}

BoundaryPart for_each_edge(
    const geometry::GridCrossings& sweep, const Parallel& parallel,
    const std::function<void(BoundaryPart&, std::span<const EdgeCrossing>, int&)>& visit) {
    const std::vector<EdgeCrossing>& all = sweep.crossings;
    constexpr std::size_t grain = 4096;
    // A chunk handles the grid lines that start in it.
    const auto line_begin = [&](std::size_t i) {
        while (i > 0 && i < all.size() && same_line(all[i - 1], all[i])) ++i;
        return std::min(i, all.size());
    };
    std::vector<BoundaryPart> parts((all.size() + grain - 1) / grain);
    parallel.for_chunks(all.size(), grain, [&](std::size_t begin, std::size_t end) {
        BoundaryPart& part = parts[begin / grain];
        const std::size_t last = line_begin(end);
        int state = 0;
        for (std::size_t i = line_begin(begin); i < last;) {
            std::size_t next = i + 1;
            while (next < last && same_edge(all[i], all[next])) ++next;
            if (i == 0 || !same_line(all[i - 1], all[i])) state = 0;
            visit(part, {all.data() + i, next - i}, state);
            i = next;
        }
    });
    BoundaryPart merged;
    for (BoundaryPart& part : parts) merged.append(std::move(part));
    return merged;
}

void cut_boundary_edges(NodeGrid& grid, const std::vector<BoundaryCut>& cuts) {
    const BrickLayout& layout = grid.bricks();
    std::vector<std::uint32_t> begin(layout.total() + 1, 0);
    for (const BoundaryCut& cut : cuts) ++begin[layout.brick_of(cut.edge.node) + 1];
    for (std::size_t brick = 0; brick < layout.total(); ++brick) begin[brick + 1] += begin[brick];
    std::vector<std::uint32_t> order(cuts.size());
    for (std::uint32_t i = 0; i < cuts.size(); ++i) order[begin[layout.brick_of(cuts[i].edge.node)]++] = i;
    grid.reserve(2 * cuts.size());
    for (const std::uint32_t i : order)
        grid.cut(cuts[i].edge, cuts[i].parameter, cuts[i].normal, Origin::boundary, -1);
}

namespace {

bool inside_node_around(const NodeGrid& grid, const GridEdge& edge) {
    const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
    for (int k = 0; k < 9; ++k) {
        Vec3i node = edge.node;
        node[u] += k % 3 - 1;
        node[v] += k / 3 - 1;
        for (int end = 0; end < 2; ++end, ++node[edge.axis])
            if (grid.rest().contains(node) && grid.inside(node)) return true;
    }
    return false;
}

}  // namespace

void note_thin(const NodeGrid& grid, const geometry::TriangleMesh& mesh, const EdgeCrossing& enter,
               const EdgeCrossing& leave, BoundaryPart& part) {
    const Vec3 in = geometry::triangle_normal(mesh, enter.triangle);
    const Vec3 out = geometry::triangle_normal(mesh, leave.triangle);
    if (in.dot(out) > tuning::solidify::slab_cosine && inside_node_around(grid, {enter.node, enter.axis}))
        return;
    const double along = (leave.parameter - enter.parameter) * grid.rest().cell_size;
    // The sheet is at most as thick as its steeper side implies.
    const double cosine = std::max(std::abs(in[enter.axis]), std::abs(out[enter.axis]));
    part.lost.push_back({along * cosine, {enter.triangle, leave.triangle}});
}

void report_thin(const geometry::TriangleMesh& mesh, const RestGrid& rest, std::vector<ThinMaterial>& lost,
                 SolidifyReport& report) {
    report.lost_thin_edges = lost.size();
    if (lost.empty()) return;
    std::vector<std::uint32_t> triangles;
    for (const ThinMaterial& thin : lost)
        triangles.insert(triangles.end(), thin.triangles, thin.triangles + 2);
    std::sort(triangles.begin(), triangles.end());
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    report.lost = geometry::part_of(mesh, triangles);
    std::sort(lost.begin(), lost.end(),
              [](const ThinMaterial& a, const ThinMaterial& b) { return a.thickness < b.thickness; });
    // If the cell is not larger than the thickness, a slab contains a node on every grid line across it; it
    // stays connected if the cell is somewhat smaller.
    report.lost_thickness = lost[lost.size() / 2].thickness;
    report.sufficient_cell_size = 0.7 * std::min(rest.cell_size, lost[lost.size() / 10].thickness);
}

}  // namespace splitcubes::splitting
