#include "commands.h"
#include "interrupts.h"
#include "lost_material.h"
#include "progress.h"
#include "report.h"

#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/splitting/extract.h>

#include <iostream>
#include <memory>

namespace splitcubes::app {

namespace {

struct Options {
    std::string mesh, out, report;
    LostMaterialOptions lost;
    int cells = 0;
    double cell_size = 0;
    int threads = 0;
};

int surface(const Options& options, Progress& progress) {
    check_mesh_output(options.out);
    check_report_output(options.report);
    check_lost_material_options(options.lost);
    check_distinct({options.mesh, options.out, options.report, options.lost.mesh.string(),
                    options.lost.picture.string()});
    Parallel parallel(options.threads);
    parallel.watch(&progress);
    Json seconds;
    Stopwatch watch;
    parallel.begin("reading");
    const io::Model model = read_model_noted(options.mesh);
    const geometry::TriangleMesh& mesh = model.mesh;
    seconds["read"] = watch.lap();
    const geometry::RestGrid rest = geometry::grid_around(
        mesh.bounds(), chosen_cell_size(mesh.bounds(), options.cells, options.cell_size));
    parallel.begin("solid");
    splitting::SolidifyReport solid;
    const splitting::NodeGrid grid = solid_of(options.mesh, mesh, rest, solid, parallel);
    seconds["solidify"] = watch.lap();
    parallel.begin("surface");
    const splitting::Surface surface(grid);
    seconds["tessellate"] = watch.lap();
    const splitting::Pieces pieces(grid);
    geometry::SurfaceMesh out = splitting::extract(grid, surface, pieces, {}, {}, parallel);
    seconds["extract"] = watch.lap();
    parallel.begin("attributes");
    carry_attributes(model, rest.cell_size, options.out, parallel, out);
    seconds["attributes"] = watch.lap();
    progress.begin("files");
    write_lost_material(options.lost, solid, out, mesh.bounds(), rest.cell_size);
    io::write_mesh(options.out, out);
    seconds["write"] = watch.lap();
    Json report = surface_report(grid, surface, pieces, solid, out);
    report["seconds"] = seconds;
    write_json(options.report, report);
    progress.finish();
    std::cout << options.out << ": " << out.mesh.triangles.size() << " triangles, " << pieces.count()
              << (pieces.count() == 1 ? " piece" : " pieces") << ", volume " << out.mesh.volume() << " m^3\n";
    return 0;
}

int surface(const Options& options) {
    Progress progress("surface");
    try {
        return surface(options, progress);
    } catch (const Cancelled&) {
        progress.finish();
        return end_interrupted("splitcubes: interrupted; nothing was written\n");
    }
}

}  // namespace

void add_surface_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("surface", "The splitting-cubes surface of a mesh");
    command->add_option("mesh", options->mesh, "Mesh in: .obj .ply .stl .gltf .glb")->required();
    command->add_option("-o,--output", options->out, "Surface out: .ply .obj .stl .glb")->required();
    CLI::Option* cells = command->add_option("--cells", options->cells, "Cells along the longest side (48)")
                             ->check(CLI::Range(2, geometry::max_cells_per_axis));
    command->add_option("--cell-size", options->cell_size, "Cell size in metres")
        ->check(CLI::Range(1e-12, 1e12))
        ->excludes(cells);
    command->add_option("--report", options->report, "Writes a JSON report");
    add_lost_material_options(*command, options->lost);
    command->add_option("--threads", options->threads, "Threads (all)")->check(CLI::Range(1, 1024));
    command->callback([options, &run] { run = [options] { return surface(*options); }; });
}

}  // namespace splitcubes::app
