#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
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
            if (!mesh.positions[v].allFinite())
                throw InputError("mesh", "vertex " + std::to_string(v) + " is not finite");
        }
}

// "1 hole", "3 holes"; nothing for none.
void add_count(std::vector<std::string>& out, std::size_t count, const char* what) {
    if (count > 0) out.push_back(std::to_string(count) + " " + what + (count == 1 ? "" : "s"));
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

void note_open_mesh(const TriangleMesh& mesh, const TriangleMesh& welded, SolidifyReport& report) {
    const geometry::MeshCheck check = geometry::check_mesh(welded);
    std::vector<std::string> found;
    add_count(found, check.boundary_edges, "boundary edge");
    add_count(found, check.misoriented_edges, "edge between triangles of opposite orientation");
    add_count(found, check.non_manifold_edges, "edge with more than two triangles");
    add_count(found, mesh.triangles.size() - welded.triangles.size(), "triangle without extent");
    report.notes.push_back("the mesh is not closed (" + joined(found) +
                           "): inside is taken where its winding number exceeds 1/2" +
                           (report.bisected_edges > 0
                                ? ", " + std::to_string(report.bisected_edges) + " grid edges cross its holes"
                                : ""));
}

void note_findings(const TriangleMesh& mesh, const TriangleMesh& welded, const RestGrid& rest,
                   SolidifyReport& report) {
    if (!report.exact) note_open_mesh(mesh, welded, report);
    if (report.exact && welded.volume() < 0)
        report.notes.push_back("the mesh is inside out (volume " + std::to_string(welded.volume()) +
                               " m^3): it is taken as a solid all the same");
    if (report.overlap) report.notes.push_back("parts of the mesh overlap: their union is taken");
    if (report.gap_edges > 0)
        report.notes.push_back(
            std::to_string(report.gap_edges) +
            " grid edges cross a gap thinner than a cell and were cut, so the gap separates");
    if (report.lost_thin_edges > 0)
        report.notes.push_back(std::to_string(report.lost_thin_edges) +
                               " grid edges cross material thinner than a cell of " + metres(rest.cell_size) +
                               " (half of it under " + metres(report.lost_thickness) +
                               "), which is lost; a cell size of " + metres(report.keeping_cell_size) +
                               " keeps nine tenths of it");
}

// Why nothing is inside, and what to do.
[[noreturn]] void refuse_empty(const RestGrid& rest, const SolidifyReport& report) {
    if (report.lost_thin_edges > 0)
        throw InputError("mesh", "all of it is thinner than a cell of " + metres(rest.cell_size),
                         "use a cell size of " + metres(report.keeping_cell_size));
    throw InputError("mesh", "encloses no volume that a grid node falls into",
                     "give a closed mesh, or more cells");
}

// A sheet has a winding number of about 1/2 close to it, but no inside: more of
// its skin would be made up than given. A half sphere without its base is at 1/3.
constexpr double most_made_up = 0.4;

void refuse_sheet(const NodeGrid& grid, const SolidifyReport& report) {
    const double share =
        static_cast<double>(report.bisected_edges) / static_cast<double>(grid.crossings().size());
    if (share <= most_made_up) return;
    throw InputError("mesh",
                     "encloses no volume: " + std::to_string(static_cast<int>(100 * share)) +
                         " % of its surface would have to be made up",
                     "close its holes, or give it a thickness");
}

}  // namespace

NodeGrid solidify(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                  const Parallel& parallel) {
    check_input(mesh);
    report = {};
    const TriangleMesh welded = geometry::weld_equal_vertices(mesh);
    report.exact = geometry::is_closed(welded);
    NodeGrid grid = report.exact ? solidify_exact(welded, rest, report, parallel)
                                 : solidify_by_winding(welded, rest, report, parallel);
    report.nodes_inside = grid.inside_count();
    if (report.nodes_inside == 0) refuse_empty(rest, report);
    refuse_sheet(grid, report);
    note_findings(mesh, welded, rest, report);
    return grid;
}

}  // namespace splitcubes::splitting
