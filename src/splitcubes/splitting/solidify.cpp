#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/repair.h>
#include <splitcubes/splitting/boundary_crossings.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/solid_memory.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <functional>
#include <numeric>

namespace splitcubes::splitting {

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
            // maxCoeff may ignore NaN.
            if (!mesh.positions[v].allFinite() ||
                mesh.positions[v].cwiseAbs().maxCoeff() > geometry::max_coordinate)
                throw InputError("mesh",
                                 "vertex " + std::to_string(v) + " is not finite or beyond " +
                                     plain_number(geometry::max_coordinate) + " m",
                                 "give coordinates that volumes can be computed from");
        }
}

std::string joined(const std::vector<std::string>& parts) {
    std::string out;
    for (const std::string& part : parts) out += (out.empty() ? "" : ", ") + part;
    return out;
}

std::string text_in(const geometry::LengthUnit& unit, double length) {
    return plain_number(unit.from_metres(length), 3) + ' ' + std::string(unit.name);
}

// Appends a count of edges. what: text after "edge" or "edges".
void add_edges(std::vector<std::string>& out, std::size_t count, const char* what) {
    if (count > 0) out.push_back(std::to_string(count) + (count == 1 ? " edge" : " edges") + what);
}

void note_open_mesh(const TriangleMesh& welded, SolidifyReport& report) {
    const geometry::MeshCheck check = geometry::check_mesh(welded);
    std::vector<std::string> found;
    add_edges(found, check.boundary_edges, " with one triangle");
    add_edges(found, check.misoriented_edges, " between triangles of opposite orientation");
    add_edges(found, check.non_manifold_edges, " with more than two triangles");
    report.notes.push_back("the mesh is not closed or not oriented (" + joined(found) +
                           "): inside is taken where its winding number exceeds 1/2" +
                           (report.bisected_edges > 0
                                ? ", " + std::to_string(report.bisected_edges) + " grid edges cross its holes"
                                : ""));
}

// Returns a share as a percentage; small shares get one digit.
std::string percent(double share) {
    return plain_number(100 * share, share < 0.1 ? 1 : 2) + " %";
}

double smallest_cell(const TriangleMesh& mesh) {
    return mesh.bounds().size().maxCoeff() / geometry::max_cells_per_axis;
}

// Returns "a cell size of X keeps", or that no grid does.
std::string keeping_size(const TriangleMesh& mesh, const SolidifyReport& report) {
    if (report.sufficient_cell_size < smallest_cell(mesh)) return "no grid that can be made keeps";
    return "a cell size of " + text_in(report.unit, report.sufficient_cell_size) + " keeps";
}

// Notes gaps between walls less than a cell apart if they make up a share of the surface: every crease has a
// few such edges.
void note_gaps(const NodeGrid& grid, SolidifyReport& report) {
    const double share = static_cast<double>(report.gap_edges) / static_cast<double>(grid.crossings().size());
    if (share > tuning::solidify::min_gap_share)
        report.notes.push_back("gaps narrower than a cell of " + text_in(report.unit, grid.rest().cell_size) +
                               " run along " + percent(share) +
                               " of its surface: the walls there stay apart, and meet in the gap's "
                               "middle");
}

// Notes material that falls between the nodes if it is more than the tips and rims that every mesh has.
bool note_lost(const TriangleMesh& mesh, const NodeGrid& grid, SolidifyReport& report) {
    const auto lost = static_cast<double>(report.lost_thin_edges);
    if (report.lost_thin_edges < tuning::solidify::min_lost_edges &&
        lost <= tuning::solidify::min_lost_share * static_cast<double>(grid.crossings().size()))
        return false;
    const double cell = grid.rest().cell_size;
    // A surface crosses 1.5 grid edges per cell face of its area, averaged over all directions.
    const double share =
        lost / 1.5 * (report.lost_thickness / cell) / static_cast<double>(report.nodes_inside);
    report.notes.push_back("material thinner than a cell of " + text_in(report.unit, cell) +
                           " is lost, about " + percent(share) +
                           " of the volume (half of it is thinner than " +
                           text_in(report.unit, report.lost_thickness) + "); " + keeping_size(mesh, report) +
                           " nine tenths of it");
    return true;
}

// Notes extra pieces: material as thin as a cell contains nodes that need not be neighbours.
void note_fragments(const TriangleMesh& mesh, const NodeGrid& grid, bool lost_is_noted,
                    SolidifyReport& report) {
    std::size_t parts = 0;
    geometry::triangle_parts(mesh, parts);
    std::vector<std::size_t> nodes = Pieces(grid).node_counts();
    if (!report.exact || nodes.size() <= parts) return;
    std::sort(nodes.begin(), nodes.end(), std::greater<>());
    const std::size_t count = nodes.size() - parts;
    const std::size_t in_fragments =
        std::accumulate(nodes.begin() + static_cast<std::ptrdiff_t>(parts), nodes.end(), std::size_t{0});
    std::string note = std::to_string(count) + (count == 1 ? " piece" : " pieces") +
                       " more than the mesh has parts: material about as thin as a cell fell apart, " +
                       percent(static_cast<double>(in_fragments) / static_cast<double>(report.nodes_inside)) +
                       " of the volume";
    const double half = 0.5 * grid.rest().cell_size;
    // The note on lost material already gives the cell size that keeps it, which is smaller.
    if (!lost_is_noted && half >= smallest_cell(mesh))
        note += "; a cell size of " + text_in(report.unit, half) + " keeps more of it";
    report.notes.push_back(note);
}

void note_findings(const TriangleMesh& welded, const NodeGrid& grid, SolidifyReport& report) {
    if (!report.exact) note_open_mesh(welded, report);
    if (report.exact && welded.volume() < 0)
        report.notes.push_back("the mesh is inside out (volume " + std::to_string(welded.volume()) +
                               " m^3): it is taken as a solid all the same");
    if (report.overlap) report.notes.push_back("parts of the mesh overlap: their union is taken");
    if (report.opposed)
        report.notes.push_back(
            "parts of the mesh are inside out, others not: where such parts overlap they cancel");
    note_gaps(grid, report);
    const bool lost_is_noted = note_lost(welded, grid, report);
    note_fragments(welded, grid, lost_is_noted, report);
}

// Throws the error that nothing is inside, with the remedy.
[[noreturn]] void refuse_empty(const TriangleMesh& mesh, const RestGrid& rest, const SolidifyReport& report) {
    if (report.lost_thin_edges > 0)
        throw InputError("mesh",
                         "all of it is thinner than a cell of " + text_in(report.unit, rest.cell_size),
                         keeping_size(mesh, report) + " it");
    throw InputError("mesh", "encloses no volume that a grid node falls into",
                     "give a mesh that bounds a solid, or a smaller cell size");
}

void refuse_sheet(const NodeGrid& grid, const SolidifyReport& report) {
    const double share =
        static_cast<double>(report.bisected_edges) / static_cast<double>(grid.crossings().size());
    if (share <= tuning::solidify::max_invented_share) return;
    throw InputError("mesh",
                     "encloses no volume: " + std::to_string(static_cast<int>(100 * share)) +
                         " % of the closed surface would have to be invented",
                     "close its holes, or give it a thickness");
}

// Welds equal vertices, drops degenerate triangles and copies, and orients the triangles consistently if that
// makes the mesh bound a solid.
TriangleMesh repaired_mesh(const TriangleMesh& mesh, SolidifyReport& report) {
    const TriangleMesh welded = geometry::weld_equal_vertices(mesh);
    std::size_t copies = 0, reversed_count = 0;
    TriangleMesh out = geometry::without_duplicates(welded, copies);
    report.exact = geometry::is_closed(out);
    if (!report.exact) {
        TriangleMesh oriented = geometry::consistently_oriented(out, reversed_count);
        if (reversed_count > 0 && geometry::is_closed(oriented)) {
            out = std::move(oriented);
            report.exact = true;
            report.notes.push_back("triangles are oriented inconsistently: " +
                                   std::to_string(reversed_count) + " were reversed");
        }
    }
    std::vector<std::string> dropped;
    if (mesh.triangles.size() > welded.triangles.size())
        dropped.push_back(std::to_string(mesh.triangles.size() - welded.triangles.size()) +
                          " without extent");
    if (copies > 0) dropped.push_back(std::to_string(copies) + " copies of others");
    if (!dropped.empty()) report.notes.push_back("triangles left out: " + joined(dropped));
    return out;
}

}  // namespace

double solid_memory(const TriangleMesh& mesh, const RestGrid& rest) {
    double area = 0;  // cells
    for (const geometry::Triangle& t : mesh.triangles) {
        const Vec3& a = mesh.positions[t[0]];
        area += 0.5 * (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).norm();
    }
    const double nodes = rest.node_count.cast<double>().prod();
    // The mean of |nx| + |ny| + |nz| over all directions is 3/2. An edge is cut once, however often it is
    // crossed.
    const double crossings = 1.5 * area / (rest.cell_size * rest.cell_size);
    return tuning::solidify::bytes_per_node * nodes +
           tuning::solidify::bytes_per_cut_edge * std::min(crossings, 3 * nodes) +
           tuning::solidify::bytes_per_crossing * crossings;
}

NodeGrid solidify(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                  const Parallel& parallel) {
    check_input(mesh);
    require_memory("mesh", solid_memory(mesh, rest), "use fewer cells or a larger cell size");
    const geometry::LengthUnit unit = report.unit;
    report = {};
    report.unit = unit;
    const TriangleMesh welded = repaired_mesh(mesh, report);
    NodeGrid grid = report.exact ? solidify_exact(welded, rest, report, parallel)
                                 : solidify_by_winding(welded, rest, report, parallel);
    report.nodes_inside = grid.inside_count();
    if (report.nodes_inside == 0) refuse_empty(welded, rest, report);
    refuse_sheet(grid, report);
    note_findings(welded, grid, report);
    return grid;
}

}  // namespace splitcubes::splitting
