#include "commands.h"
#include "cut_pieces.h"
#include "interrupts.h"
#include "lost_material.h"
#include "progress.h"
#include "report.h"

#include <splitcubes/body/rest_cut.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/splitting/enclosed.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

namespace splitcubes::app {

namespace {

struct Options {
    std::string mesh, out, report, pieces_folder;
    LostMaterialOptions lost;
    std::vector<std::string> sheets, paths;
    std::string mode = "separate";
    int cells = 0;
    double cell_size = 0;
    int threads = 0;
    bool remove() const { return mode == "remove"; }
};

// One thing to cut with: a sheet or a blade on its path.
struct Cutter {
    std::string file;
    geometry::TriangleMesh sheet;
    std::optional<cutting::Blade> blade;
    std::size_t cut_edges = 0;
    bool encloses = false;  // a piece lies inside

    std::string what() const { return blade ? file + ": blade '" + blade->name() + "'" : file; }
};

void check_options(const Options& options) {
    check_mesh_output(options.out);
    check_report_output(options.report);
    check_lost_material_options(options.lost);
    check_pieces_folder(options.pieces_folder);
    const std::vector<std::string> written{options.mesh, options.out, options.report,
                                           options.lost.mesh.string(), options.lost.picture.string()};
    check_distinct(written);
    for (const std::vector<std::string>& cutters : {options.sheets, options.paths})
        for (const std::string& cutter : cutters)
            for (std::size_t k = 1; k < written.size(); ++k) check_distinct({cutter, written[k]});
    if (options.sheets.empty() && options.paths.empty())
        throw InputError("cut", "has nothing to cut with", "give --with SHEET or --path FILE");
    if (options.remove() && !options.paths.empty())
        throw InputError(options.paths.front(), "is a path, which has no inside to remove",
                         "give closed meshes with --with, or --mode separate");
}

void check_closed(const Cutter& cutter) {
    const geometry::MeshCheck check = geometry::check_mesh(cutter.sheet);
    if (!check.closed())
        throw InputError(cutter.file,
                         "is not closed (" + std::to_string(check.boundary_edges) + " boundary edges, " +
                             std::to_string(check.misoriented_edges) +
                             " between triangles of opposite orientation) and has no inside to remove",
                         "give a closed mesh, or --mode separate");
}

std::vector<Cutter> read_cutters(const Options& options) {
    std::vector<Cutter> out;
    for (const std::string& name : options.sheets) {
        out.push_back({name, read_noted(name), std::nullopt});
        if (!options.remove()) continue;
        out.back().sheet = geometry::weld_equal_vertices(out.back().sheet);
        check_closed(out.back());
    }
    for (const std::string& name : options.paths)
        for (const scene::ToolDescription& tool : scene::parse_path_file(name))
            out.push_back({name, {}, scene::make_blade(tool)});
    return out;
}

void cut_all(std::vector<Cutter>& cutters, splitting::NodeGrid& grid, splitting::Surface& surface,
             const Parallel& parallel) {
    for (std::size_t k = 0; k < cutters.size(); ++k) {
        Cutter& cutter = cutters[k];
        const auto number = static_cast<std::int32_t>(k);
        parallel.begin(cutter.file);
        const std::vector<std::int32_t> slots =
            cutter.blade ? body::cut_with_blade(grid, *cutter.blade, number, parallel, interrupted)
                         : splitting::cut_with_sheet(grid, cutter.sheet, number);
        cutter.cut_edges = slots.size();
        surface.retessellate(grid, slots);
    }
}

// Flags of the pieces that lie inside a cutter.
std::vector<std::uint8_t> pieces_to_remove(std::vector<Cutter>& cutters, const splitting::NodeGrid& grid,
                                           const splitting::Pieces& pieces) {
    std::vector<std::uint8_t> removed(pieces.count(), 0);
    for (Cutter& cutter : cutters) {
        const auto where = splitting::enclosure_of_pieces(grid, pieces, cutter.sheet);
        for (std::size_t k = 0; k < where.size(); ++k) {
            if (where[k] != splitting::Enclosure::inside) continue;
            cutter.encloses = true;
            removed[k] = 1;
        }
    }
    return removed;
}

void note_idle_cutters(const std::vector<Cutter>& cutters) {
    for (const Cutter& cutter : cutters)
        if (cutter.cut_edges == 0 && !cutter.encloses)
            print_notes(cutter.what(), {"crosses no edge inside the body: nothing was cut"});
}

Json cutters_report(const std::vector<Cutter>& cutters) {
    Json out = Json::array();
    for (const Cutter& cutter : cutters) {
        out.push_back({{"file", cutter.file}});
        if (cutter.blade) out.back()["blade"] = cutter.blade->name();
        out.back()["cut_edges"] = cutter.cut_edges;
    }
    return out;
}

// Adds to a report of the surface what `cut` alone knows.
void complete_report(Json& report, const Options& options, const std::vector<Cutter>& cutters,
                     const CutResult& result) {
    report["pieces"] = pieces_report(result);
    report["mode"] = options.mode;
    report["cutters"] = cutters_report(cutters);
    report["volume_kept"] = result.volume(false);
    report["volume_removed"] = result.volume(true);
    report["volume_whole"] = result.whole.mesh.volume();
    if (result.kept().mesh.triangles.empty()) report["closed"] = true;  // nothing has no rim
}

void print_summary(const Options& options, const CutResult& result, const Json& report) {
    const std::size_t kept = result.kept_count(), removed = result.pieces.size() - kept;
    std::cout << options.out << ": " << kept << (kept == 1 ? " piece, " : " pieces, ");
    if (options.remove()) std::cout << removed << " removed, ";
    std::cout << report["cut_edges"] << " cut edges, volume " << result.volume(false) << " m^3";
    if (options.remove()) std::cout << ", removed " << result.volume(true) << " m^3";
    if (kept == 0) std::cout << ": all was removed, the surface is empty";
    std::cout << '\n' << pieces_table(result);
}

int cut(const Options& options, Progress& progress) {
    check_options(options);
    Parallel parallel(options.threads);
    parallel.watch(&progress);
    parallel.begin("reading");
    Json seconds;
    Stopwatch watch;
    const io::Model model = read_model_noted(options.mesh);
    const geometry::TriangleMesh& mesh = model.mesh;
    std::vector<Cutter> cutters = read_cutters(options);
    seconds["read"] = watch.lap();

    const geometry::RestGrid rest = geometry::grid_around(
        mesh.bounds(), chosen_cell_size(mesh.bounds(), options.cells, options.cell_size));
    parallel.begin("solid");
    splitting::SolidifyReport solid;
    splitting::NodeGrid grid = solid_of(options.mesh, mesh, rest, solid, parallel);
    seconds["solidify"] = watch.lap();
    parallel.begin("surface");
    splitting::Surface surface(grid);
    seconds["tessellate"] = watch.lap();
    cut_all(cutters, grid, surface, parallel);
    seconds["cut"] = watch.lap();
    parallel.begin("pieces");
    const splitting::Pieces pieces(grid);
    const std::vector<std::uint8_t> removed = options.remove() ? pieces_to_remove(cutters, grid, pieces)
                                                               : std::vector<std::uint8_t>(pieces.count(), 0);
    const bool all_cut =
        std::all_of(cutters.begin(), cutters.end(), [](const Cutter& c) { return c.cut_edges > 0; });
    if (options.remove() && all_cut && std::find(removed.begin(), removed.end(), 1) == removed.end())
        print_notes(options.mesh, {"nothing was removed: no node of the grid lies inside a cutter; a cutter "
                                   "thinner than a cell needs a smaller cell size"});
    geometry::SurfaceMesh whole = splitting::extract(grid, surface, pieces, {}, {}, parallel);
    seconds["extract"] = watch.lap();
    carry_attributes(model, rest.cell_size, options.out, parallel, whole);
    seconds["attributes"] = watch.lap();
    const CutResult result = arrange_pieces(std::move(whole), pieces, removed);
    progress.begin("files");
    note_idle_cutters(cutters);
    Json report = surface_report(grid, surface, pieces, solid, result.kept());
    complete_report(report, options, cutters, result);
    const std::string extension = std::filesystem::path(options.out).extension().string();
    if (!options.pieces_folder.empty())
        write_pieces(options.pieces_folder, extension, result, report["pieces"]);
    write_lost_material(options.lost, solid, result.kept(), mesh.bounds(), rest.cell_size);
    io::write_mesh(options.out, result.kept());
    seconds["write"] = watch.lap();
    progress.finish();
    report["seconds"] = seconds;
    write_json(options.report, report);
    print_summary(options, result, report);
    return 0;
}

int cut(const Options& options) {
    Progress progress("cut");
    try {
        return cut(options, progress);
    } catch (const Cancelled&) {
        progress.finish();
        return end_interrupted("splitcubes: interrupted; nothing was written\n");
    }
}

}  // namespace

void add_cut_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("cut", "Cuts a solid at rest with sheets, closed meshes or blades on paths");
    command->add_option("mesh", options->mesh, "Mesh in: .obj .ply .stl .gltf .glb")->required();
    command->add_option("--with", options->sheets, "Sheets or closed meshes, in the mesh's coordinates");
    command->add_option("--path", options->paths,
                        "Blades on their paths: JSON files, tools as in a scene, in the mesh's coordinates");
    command
        ->add_option("--mode", options->mode,
                     "separate: keeps all pieces (default); remove: takes away those inside closed cutters")
        ->check(CLI::IsMember({"separate", "remove"}));
    command->add_option("-o,--output", options->out, "Whole surface out: .ply .obj .stl .glb")->required();
    CLI::Option* cells = command->add_option("--cells", options->cells, "Cells along the longest side (48)")
                             ->check(CLI::Range(2, geometry::max_cells_per_axis));
    command->add_option("--cell-size", options->cell_size, "Cell size in metres")
        ->check(CLI::Range(1e-12, 1e12))
        ->excludes(cells);
    command->add_option("--pieces", options->pieces_folder, "Folder for one closed mesh a piece");
    command->add_option("--report", options->report, "Writes a JSON report");
    add_lost_material_options(*command, options->lost);
    command->add_option("--threads", options->threads, "Threads (all)")->check(CLI::Range(1, 1024));
    command->callback([options, &run] { run = [options] { return cut(*options); }; });
}

}  // namespace splitcubes::app
