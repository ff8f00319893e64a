#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/repair.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/skin.h>
#include <splitcubes/splitting/solidify.h>

#include <sstream>

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
            // maxCoeff may pass over what is not a number.
            if (!mesh.positions[v].allFinite() ||
                mesh.positions[v].cwiseAbs().maxCoeff() >= geometry::largest_coordinate)
                throw InputError("mesh", "vertex " + std::to_string(v) + " is not finite or beyond 1e75 m",
                                 "give coordinates that volumes can be computed from");
        }
}

std::string joined(const std::vector<std::string>& parts) {
    std::string out;
    for (const std::string& part : parts) out += (out.empty() ? "" : ", ") + part;
    return out;
}

std::string metres(double value) {
    std::ostringstream out;
    out.precision(3);
    out << value << " m";
    return out.str();
}

// "edges" is what takes the s of the plural.
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

// What is thin in every direction is met by nodes, but they need not be neighbours.
void note_shattered(const NodeGrid& grid, const TriangleMesh& solid, SolidifyReport& report) {
    std::size_t parts = 0;
    geometry::triangle_parts(solid, parts);
    const std::size_t pieces = Pieces(grid).count();
    if (pieces > parts && report.exact)
        report.notes.push_back(
            "the mesh has " + std::to_string(parts) + (parts == 1 ? " part" : " parts") + ", its solid " +
            std::to_string(pieces) +
            " pieces: material about as thin as a cell falls apart; try half the cell size");
}

// "a cell size of X keeps", or that none does.
std::string keeping_size(const TriangleMesh& mesh, const SolidifyReport& report) {
    const double smallest = mesh.bounds().size().maxCoeff() / geometry::max_cells_per_axis;
    if (report.keeping_cell_size < smallest) return "no grid that can be made keeps";
    return "a cell size of " + metres(report.keeping_cell_size) + " keeps";
}

void note_findings(const TriangleMesh& welded, const RestGrid& rest, SolidifyReport& report) {
    if (!report.exact) note_open_mesh(welded, report);
    if (report.exact && welded.volume() < 0)
        report.notes.push_back("the mesh is inside out (volume " + std::to_string(welded.volume()) +
                               " m^3): it is taken as a solid all the same");
    if (report.overlap) report.notes.push_back("parts of the mesh overlap: their union is taken");
    if (report.opposed)
        report.notes.push_back(
            "parts of the mesh are inside out, others not: where such parts overlap they cancel");
    if (report.gap_edges > 0)
        report.notes.push_back(
            std::to_string(report.gap_edges) +
            " grid edges cross a gap thinner than a cell and were cut, so the gap separates");
    if (report.lost_thin_edges > 0)
        report.notes.push_back(std::to_string(report.lost_thin_edges) +
                               " grid edges cross material thinner than a cell of " + metres(rest.cell_size) +
                               " (half of it under " + metres(report.lost_thickness) + "), which is lost; " +
                               keeping_size(welded, report) + " nine tenths of it");
}

// Why nothing is inside, and what to do.
[[noreturn]] void refuse_empty(const TriangleMesh& mesh, const RestGrid& rest, const SolidifyReport& report) {
    if (report.lost_thin_edges > 0)
        throw InputError("mesh", "all of it is thinner than a cell of " + metres(rest.cell_size),
                         keeping_size(mesh, report) + " it");
    throw InputError("mesh", "encloses no volume that a grid node falls into",
                     "give a mesh that bounds a solid, or a smaller cell size");
}

// A sheet has a winding number of about 1/2 close to it, but no inside: more of
// its skin would be made up than of a body with holes. Of the grid edges that cross the
// skin, a half sphere without its base has a quarter in the hole; hilly sheets a third.
constexpr double most_made_up = 0.3;

void refuse_sheet(const NodeGrid& grid, const SolidifyReport& report) {
    const double share =
        static_cast<double>(report.bisected_edges) / static_cast<double>(grid.crossings().size());
    if (share <= most_made_up) return;
    throw InputError("mesh",
                     "encloses no volume: " + std::to_string(static_cast<int>(100 * share)) +
                         " % of its surface would have to be made up",
                     "close its holes, or give it a thickness");
}

// Vertices at one place joined, triangles without extent and copies dropped, and
// turned to one orientation where that makes the mesh bound a solid.
TriangleMesh mended(const TriangleMesh& mesh, SolidifyReport& report) {
    const TriangleMesh welded = geometry::weld_equal_vertices(mesh);
    std::size_t copies = 0, turned = 0;
    TriangleMesh out = geometry::without_duplicates(welded, copies);
    report.exact = geometry::is_closed(out);
    if (!report.exact) {
        TriangleMesh oriented = geometry::consistently_oriented(out, turned);
        if (turned > 0 && geometry::is_closed(oriented)) {
            out = std::move(oriented);
            report.exact = true;
            report.notes.push_back("triangles are turned both ways: " + std::to_string(turned) +
                                   " were turned round");
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

NodeGrid solidify(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                  const Parallel& parallel) {
    check_input(mesh);
    report = {};
    const TriangleMesh welded = mended(mesh, report);
    NodeGrid grid = report.exact ? solidify_exact(welded, rest, report, parallel)
                                 : solidify_by_winding(welded, rest, report, parallel);
    report.nodes_inside = grid.inside_count();
    if (report.nodes_inside == 0) refuse_empty(welded, rest, report);
    refuse_sheet(grid, report);
    note_findings(welded, rest, report);
    note_shattered(grid, welded, report);
    return grid;
}

}  // namespace splitcubes::splitting
