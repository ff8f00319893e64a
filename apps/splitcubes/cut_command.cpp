#include "commands.h"
#include "report.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <cstdio>
#include <iostream>
#include <memory>

namespace splitcubes::app {

namespace {

struct Options {
    std::string mesh, out, report, pieces_folder;
    std::vector<std::string> sheets;
    int cells = 0;
    double cell_size = 0;
    int threads = 0;
};

std::filesystem::path piece_path(const std::filesystem::path& folder, std::size_t piece,
                                 const std::filesystem::path& out) {
    char name[32];
    std::snprintf(name, sizeof name, "piece-%04zu", piece);
    return folder / (name + out.extension().string());
}

int cut(const Options& options) {
    check_mesh_output(options.out);
    check_report_output(options.report);
    const Parallel parallel(options.threads);
    Json seconds;
    Stopwatch watch;
    const io::Model model = read_model_noted(options.mesh);
    const geometry::TriangleMesh& mesh = model.mesh;
    std::vector<geometry::TriangleMesh> sheets;
    for (const std::string& name : options.sheets) sheets.push_back(read_noted(name));
    seconds["read"] = watch.lap();
    const geometry::RestGrid rest = geometry::grid_around(
        mesh.bounds(), chosen_cell_size(mesh.bounds(), options.cells, options.cell_size));
    splitting::SolidifyReport solid;
    splitting::NodeGrid grid = splitting::solidify(mesh, rest, solid, parallel);
    print_notes(options.mesh, solid.notes);
    seconds["solidify"] = watch.lap();
    splitting::Surface surface(grid);
    seconds["tessellate"] = watch.lap();
    for (std::size_t k = 0; k < sheets.size(); ++k) {
        const auto slots = splitting::cut_with_sheet(grid, sheets[k], static_cast<std::int32_t>(k));
        if (slots.empty())
            print_notes(options.sheets[k], {"crosses no edge inside the body: nothing was cut"});
        surface.retessellate(grid, slots);
    }
    seconds["cut"] = watch.lap();
    const splitting::Pieces pieces(grid);
    geometry::SurfaceMesh out = splitting::extract(grid, surface, pieces);
    seconds["extract"] = watch.lap();
    if (!options.pieces_folder.empty()) {
        std::error_code error;
        std::filesystem::create_directories(options.pieces_folder, error);
        if (error) throw InputError(options.pieces_folder, "cannot be made: " + error.message());
    }
    carry_attributes(model, rest.cell_size, options.out, parallel, out);
    seconds["attributes"] = watch.lap();
    io::write_mesh(options.out, out);
    Json report = surface_report(grid, surface, pieces, solid, out);
    if (!options.pieces_folder.empty())
        for (std::size_t k = 0; k < pieces.count(); ++k) {
            const std::filesystem::path path = piece_path(options.pieces_folder, k, options.out);
            io::write_mesh(path, splitting::extract_piece(out, static_cast<std::int32_t>(k)));
            report["pieces"][k]["file"] = path.string();
        }
    seconds["write"] = watch.lap();
    report["seconds"] = seconds;
    write_json(options.report, report);
    std::cout << options.out << ": " << pieces.count() << (pieces.count() == 1 ? " piece, " : " pieces, ")
              << report["cut_edges"] << " cut edges, volume " << out.mesh.volume() << " m^3\n";
    return 0;
}

}  // namespace

void add_cut_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("cut", "Cuts a solid at rest with triangle sheets or closed meshes");
    command->add_option("mesh", options->mesh, "Mesh in: .obj .ply .stl .gltf .glb")->required();
    command->add_option("--with", options->sheets, "Sheets to cut with, in the mesh's coordinates")
        ->required();
    command->add_option("-o,--output", options->out, "Whole surface out: .ply .obj .stl .glb")->required();
    CLI::Option* cells = command->add_option("--cells", options->cells, "Cells along the longest side (48)")
                             ->check(CLI::Range(2, geometry::max_cells_per_axis));
    command->add_option("--cell-size", options->cell_size, "Cell size in metres")->excludes(cells);
    command->add_option("--pieces", options->pieces_folder, "Folder for one closed mesh a piece");
    command->add_option("--report", options->report, "Writes a JSON report");
    command->add_option("--threads", options->threads, "Threads (all)")->check(CLI::Range(1, 1024));
    command->callback([options, &run] { run = [options] { return cut(*options); }; });
}

}  // namespace splitcubes::app
