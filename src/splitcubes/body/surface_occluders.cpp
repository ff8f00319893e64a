#include <splitcubes/body/surface_occluders.h>
#include <splitcubes/body/tuning.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

namespace splitcubes::body {

namespace {

// Adds two triangles for each cut edge of the cell, whichever side has a quad: both sides coincide at rest.
void add_occluders(const splitting::NodeGrid& grid, const splitting::Surface& surface, std::uint32_t cell,
                   std::vector<geometry::OccluderTriangle>& out) {
    const std::span<const splitting::SurfaceQuad> quads = surface.quads(surface.cells()[cell]);
    for (auto q = quads.begin(); q != quads.end(); ++q) {
        const auto same = [&](const splitting::SurfaceQuad& other) { return other.crossing == q->crossing; };
        if (std::any_of(quads.begin(), q, same)) continue;
        const splitting::Crossing& crossing = grid.crossing(q->crossing);
        // A crossing between two inside nodes is a cut, which has no outside.
        const bool is_boundary = grid.inside(crossing.edge.node) != grid.inside(crossing.edge.upper());
        const auto at = [&](std::size_t k) { return surface.vertices()[q->vertices[k]].rest; };
        out.push_back({{at(0), at(1), at(2)}, is_boundary});
        out.push_back({{at(0), at(2), at(3)}, is_boundary});
    }
}

// Joins the boxes of cells by brick.
std::vector<geometry::Box> join_by_brick(const splitting::Surface& surface,
                                         std::span<const std::uint32_t> cells,
                                         std::span<const geometry::Box> boxes) {
    std::map<std::array<int, 3>, geometry::Box> by_brick;
    for (std::size_t k = 0; k < cells.size(); ++k) {
        const Vec3i cell = surface.cells()[cells[k]].lowest_node;
        by_brick[{cell[2] >> 2, cell[1] >> 2, cell[0] >> 2}].add(boxes[k]);
    }
    std::vector<geometry::Box> out;
    for (const auto& [brick, box] : by_brick) out.push_back(box);
    return out;
}

}  // namespace

SurfaceOccluders::SurfaceOccluders(const geometry::RestGrid& rest)
    : grid_(rest.origin, rest.cell_size, rest.node_count), changes_(rest) {}

void SurfaceOccluders::build(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                             const Parallel& parallel) {
    std::vector<std::uint32_t> cells(surface.cells().size());
    std::iota(cells.begin(), cells.end(), 0U);
    set_cells(grid, surface, cells, parallel);
}

void SurfaceOccluders::rebuild(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                               const Parallel& parallel) {
    grid_ = geometry::OccluderGrid(grid.rest().origin, grid.rest().cell_size, grid.rest().node_count);
    cell_box_.clear();
    build(grid, surface, parallel);
    changes_.mark_all();
}

std::vector<geometry::Box> SurfaceOccluders::update(const splitting::NodeGrid& grid,
                                                    const splitting::Surface& surface,
                                                    std::span<const std::uint32_t> cells,
                                                    const Parallel& parallel) {
    std::vector<geometry::Box> boxes;
    if (!cells.empty()) changes_.begin();
    for (const std::uint32_t c : cells)
        boxes.push_back(c < cell_box_.size() ? cell_box_[c] : geometry::Box{});
    set_cells(grid, surface, cells, parallel);
    for (std::size_t k = 0; k < cells.size(); ++k) {
        boxes[k].add(cell_box_[cells[k]]);
        changes_.mark(boxes[k]);
    }
    return join_by_brick(surface, cells, boxes);
}

void SurfaceOccluders::set_cells(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                 std::span<const std::uint32_t> cells, const Parallel& parallel) {
    std::vector<geometry::OccluderTriangle> triangles;
    std::vector<std::size_t> end;
    for (const std::uint32_t c : cells) {
        if (end.size() % tuning::set_up::cells_between_checks == 0) parallel.check();
        add_occluders(grid, surface, c, triangles);
        end.push_back(triangles.size());
    }
    cell_box_.resize(surface.cells().size());
    std::vector<geometry::OccluderGrid::CellTriangles> changed;
    for (std::size_t k = 0; k < cells.size(); ++k) {
        if (k % tuning::set_up::cells_between_checks == 0) parallel.check();
        const std::size_t begin = k == 0 ? 0 : end[k - 1];
        const auto own =
            std::span<const geometry::OccluderTriangle>(triangles).subspan(begin, end[k] - begin);
        geometry::Box box;
        for (const geometry::OccluderTriangle& t : own)
            for (const Vec3& corner : t.corner) box.add(corner);
        cell_box_[cells[k]] = box;
        changed.push_back({surface.cells()[cells[k]].lowest_node, own});
    }
    grid_.set_cells(changed, parallel);
}

}  // namespace splitcubes::body
