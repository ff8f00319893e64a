#include "report.h"

#include "option_values.h"
#include "progress.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/mesh_format.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/splitting/extract.h>

#include <cmath>
#include <iostream>

namespace splitcubes::app {

Json surface_report(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                    const splitting::Pieces& pieces, const splitting::SolidifyReport& solid,
                    const geometry::SurfaceMesh& mesh) {
    const geometry::MeshCheck check = geometry::check_mesh(mesh.mesh);
    std::size_t cut_edges = 0;
    for (const splitting::Crossing& c : grid.crossings()) cut_edges += c.origin == geometry::Origin::cut;
    Json out;
    out["cell_size"] = grid.rest().cell_size;
    out["nodes_inside"] = solid.nodes_inside;
    out["boundary_edges"] = grid.crossings().size() - cut_edges;
    out["cut_edges"] = cut_edges;
    out["surface_cells"] = surface.cells().size();
    out["vertices"] = mesh.mesh.positions.size();
    out["triangles"] = mesh.mesh.triangles.size();
    out["pieces"] = Json::array();
    const auto measures = splitting::measure_pieces(mesh, pieces.count());
    for (std::size_t k = 0; k < pieces.count(); ++k)
        out["pieces"].push_back({{"nodes", pieces.node_counts()[k]},
                                 {"volume", measures[k].volume},
                                 {"triangles", measures[k].triangles},
                                 {"boundary_area", measures[k].boundary_area},
                                 {"cut_area", measures[k].cut_area}});
    out["volume"] = check.volume;
    out["area"] = check.area;
    out["closed"] = check.closed() && check.boundary_edges == 0;
    out["oriented"] = check.oriented();
    out["manifold"] = check.manifold();
    out["exact"] = solid.exact;
    out["lost_thin_edges"] = solid.lost_thin_edges;
    out["lost_thickness"] = solid.lost_thickness;
    out["keeping_cell_size"] = solid.sufficient_cell_size;
    out["gap_edges"] = solid.gap_edges;
    out["bisected_edges"] = solid.bisected_edges;
    out["notes"] = solid.notes;
    return out;
}

std::string json_text(const Json& json, int indent) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

void write_json(const std::filesystem::path& path, const Json& json) {
    if (path.empty()) return;
    io::write_file(path, json_text(json, 2) + '\n');
}

std::string name_for_report(const std::filesystem::path& file, const std::filesystem::path& report) {
    std::error_code error;
    const auto whole = [&](const std::filesystem::path& path) {
        return std::filesystem::absolute(path, error).lexically_normal();
    };
    const std::filesystem::path relative = whole(file).lexically_relative(whole(report).parent_path());
    const bool is_below = !relative.empty() && *relative.begin() != "..";
    return (is_below ? relative : file.filename()).generic_string();
}

void print_notes(const std::string& name, const std::vector<std::string>& notes) {
    if (!notes.empty()) clear_bar();
    for (const std::string& note : notes) std::cerr << name << ": " << note << '\n';
}

geometry::TriangleMesh read_noted(const std::string& name) {
    return std::move(read_model_noted(name).mesh);
}

namespace {
// An OBJ's material library is written beside it under its name.
void check_library(const std::filesystem::path& out, const std::string& name,
                   const io::ReadMeshReport& read) {
    if (io::format_of_extension(out) != io::MeshFormat::obj) return;
    std::error_code error;
    std::filesystem::path library = out;
    library.replace_extension(".mtl");
    for (const std::filesystem::path& file : read.files)
        if (std::filesystem::equivalent(file, library, error))
            throw InputError(out.string(),
                             "its materials would replace " + library.string() + ", which " + name + " uses",
                             "give another name");
}
}  // namespace

io::Model read_model_noted(const std::string& name, const std::filesystem::path& out) {
    io::ReadMeshReport read;
    io::Model model = io::read_model(name, &read);
    check_library(out, name, read);
    print_notes(name, read.notes);
    return model;
}

void transfer_attributes(const io::Model& from, double cell_size, const std::filesystem::path& out,
                         const Parallel& parallel, geometry::SurfaceMesh& surface) {
    if (from.attributes.empty()) {
        if (io::format_of_extension(out) != io::MeshFormat::ply) surface.rest.clear();
        return;
    }
    // Half a cell: the grid does not resolve thinner walls.
    const geometry::AttributeTransfer transfer(from.mesh, from.attributes, cell_size / 2);
    surface.attributes = transfer.onto(surface, parallel);
    const auto format = io::format_of_extension(out);
    if (format == io::MeshFormat::obj || format == io::MeshFormat::ply)
        io::write_images(out.parent_path(), out.stem().string(), surface.attributes.materials);
}

double chosen_cell_size(const geometry::Box& box, int cells, double cell_size,
                        const geometry::LengthUnit& unit) {
    if (cell_size == 0) return geometry::cell_size_for(box, cells == 0 ? 48 : cells);
    const double metres = unit.to_metres(cell_size), along = box.size().maxCoeff() / metres;
    if (along > geometry::max_cells_per_axis)
        throw InputError("--cell-size",
                         plain_number(cell_size) + ' ' + std::string(unit.name) + " makes " +
                             plain_number(std::ceil(along)) + " cells along an axis, more than " +
                             plain_number(geometry::max_cells_per_axis),
                         "give a larger one, or --cells");
    return metres;
}

splitting::NodeGrid solid_of(const std::string& name, const geometry::TriangleMesh& mesh,
                             const geometry::RestGrid& rest, splitting::SolidifyReport& report,
                             const Parallel& parallel) {
    try {
        splitting::NodeGrid grid = splitting::solidify(mesh, rest, report, parallel);
        print_notes(name, report.notes);
        return grid;
    } catch (const InputError& error) {
        // The library knows the mesh, not its file name.
        const std::string text = error.what(), where = "mesh: ";
        if (text.rfind(where, 0) != 0) throw;
        throw InputError(name, text.substr(where.size()));
    }
}

}  // namespace splitcubes::app
