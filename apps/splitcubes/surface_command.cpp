#include "command_line.h"
#include "commands.h"
#include "interrupts.h"
#include "lost_material.h"
#include "mesh_scale.h"
#include "output_targets.h"
#include "progress.h"
#include "report.h"

#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/splitting/extract.h>

#include <iostream>
#include <memory>

namespace splitcubes::app {

namespace {

struct SurfaceOptions {
    std::string mesh, out, report;
    LostMaterialOptions lost;
    MeshScale scale;
    int cells = 0;
    double cell_size = 0;  // in units of the files
    int threads = 0;
};

int surface(const SurfaceOptions& options, Progress& progress) {
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
    io::Model model = read_model_noted(options.mesh, options.out);
    options.scale.apply(model.mesh, options.mesh);
    const geometry::TriangleMesh& mesh = model.mesh;
    seconds["read"] = watch.lap();
    const geometry::RestGrid rest = geometry::grid_around(
        mesh.bounds(),
        chosen_cell_size(mesh.bounds(), options.cells, options.cell_size, options.scale.unit()));
    parallel.begin("solid");
    splitting::SolidifyReport solid;
    solid.unit = options.scale.unit();
    const splitting::NodeGrid grid = solid_of(options.mesh, mesh, rest, solid, parallel);
    seconds["solidify"] = watch.lap();
    parallel.begin("surface");
    const splitting::Surface surface(grid, parallel);
    seconds["tessellate"] = watch.lap();
    const splitting::Pieces pieces(grid);
    geometry::SurfaceMesh out = splitting::extract(grid, surface, pieces, {}, {}, parallel);
    seconds["extract"] = watch.lap();
    parallel.begin("attributes");
    transfer_attributes(model, rest.cell_size, options.out, parallel, out);
    seconds["attributes"] = watch.lap();
    progress.begin("files");
    write_lost_material(options.lost, options.scale, solid, out, mesh.bounds(), rest.cell_size);
    Json report = surface_report(grid, surface, pieces, solid, out);
    const std::string summary = std::to_string(out.mesh.triangles.size()) + " triangles, " +
                                std::to_string(pieces.count()) +
                                (pieces.count() == 1 ? " piece" : " pieces") + ", volume " +
                                options.scale.volume_text(out.mesh.volume());
    write_scaled(options.out, out, options.scale);
    seconds["write"] = watch.lap();
    report["seconds"] = seconds;
    write_json(options.report, report);
    progress.finish();
    std::cout << options.out << ": " << summary << '\n';
    return 0;
}

int surface(const SurfaceOptions& options) {
    Progress progress("surface");
    try {
        return surface(options, progress);
    } catch (const Cancelled&) {
        progress.finish();
        return end_interrupted("splitcubes: interrupted; nothing was written\n");
    }
}

}  // namespace

void add_surface_command(CommandLine& line) {
    const auto options = std::make_shared<SurfaceOptions>();
    Command& command = line.add("surface", "Makes the splitting-cubes surface of a mesh");
    command.add_text("MESH", "", options->mesh, "Mesh in: .obj .ply .stl .gltf .glb")
        .required()
        .completes(meshes_in());
    command.add_text("-o,--output", "FILE", options->out, "Surface out: .ply .obj .stl .glb")
        .required()
        .completes(meshes_out());
    command.add_integer("--cells", "N", options->cells, {2, geometry::max_cells_per_axis},
                        "Cells along the longest side (48)");
    command.add_number("--cell-size", "LENGTH", options->cell_size, {1e-12, 1e12}, "Cell size, in the unit")
        .excludes("--cells");
    options->scale.add_to(command);
    command.add_text("--report", "FILE", options->report, "Writes a JSON report").completes(files());
    add_lost_material_options(command, options->lost);
    command.add_threads(options->threads);
    command.example("splitcubes surface scenes/meshes/pear.obj -o pear.ply --cells 64");
    command.example(
        "splitcubes surface scenes/meshes/liver.obj --scale 1000 --unit mm --cell-size 4 -o whole.stl",
        "Metres to millimetres, with cells of four millimetres");
    command.run = [options] { return surface(*options); };
}

}  // namespace splitcubes::app
