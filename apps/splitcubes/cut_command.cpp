#include "command_line.h"
#include "commands.h"
#include "cut_pieces.h"
#include "cutters.h"
#include "idle_notes.h"
#include "interrupts.h"
#include "lost_material.h"
#include "output_folder.h"
#include "output_targets.h"
#include "progress.h"
#include "report.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/node_motion/rest_cut.h>
#include <splitcubes/splitting/enclosed.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

namespace splitcubes::app {

namespace {

struct CutOptions {
    std::string mesh, out, report, pieces_folder;
    LostMaterialOptions lost;
    std::vector<CutterOption> cutters;
    MeshScale scale;
    std::string mode = "separate";
    int cells = 0;
    double cell_size = 0;   // in units of the files
    double min_volume = 0;  // in cubed units of the files
    int largest = 0;
    int threads = 0;
    bool force = false;
    bool remove() const { return mode == "remove"; }
    splitting::PieceChoice choice() const {
        return {scale.unit().volume_to_metres(min_volume), static_cast<std::size_t>(largest)};
    }
};

void check_options(const CutOptions& options) {
    check_mesh_output(options.out);
    check_report_output(options.report);
    check_lost_material_options(options.lost);
    check_output_folder(options.pieces_folder);
    const std::vector<std::string> written{options.mesh, options.out, options.report,
                                           options.lost.mesh.string(), options.lost.picture.string()};
    check_distinct(written);
    if (options.cutters.empty())
        throw InputError("cut", "has nothing to cut with", "give --with SHEET, --path FILE or --plane z=D");
    for (const CutterOption& cutter : options.cutters) {
        if (cutter.kind == CutterOption::Kind::plane) continue;
        for (std::size_t k = 1; k < written.size(); ++k) check_distinct({cutter.text, written[k]});
        if (options.remove() && cutter.kind == CutterOption::Kind::path)
            throw InputError(cutter.text, "is a path, which has no inside to remove",
                             "give closed meshes with --with, or --mode separate");
    }
}

void cut_all(std::vector<Cutter>& cutters, splitting::NodeGrid& grid, splitting::Surface& surface,
             const Parallel& parallel) {
    for (std::size_t k = 0; k < cutters.size(); ++k) {
        Cutter& cutter = cutters[k];
        const auto cut_number = static_cast<std::int32_t>(k);
        parallel.begin(cutter.file);
        const std::vector<std::int32_t> slots =
            cutter.blade ? body::cut_with_blade(grid, *cutter.blade, cut_number, parallel, interrupted)
                         : splitting::cut_with_sheet(grid, cutter.sheet, cut_number);
        cutter.cut_edges = slots.size();
        surface.retessellate(grid, slots);
    }
}

// Returns flags of the pieces that lie inside a cutter.
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

// Returns whether the cutter cut no edge and contains no piece.
bool is_idle(const Cutter& cutter) {
    return cutter.cut_edges == 0 && !cutter.encloses;
}

splitting::CrossedEdges edges_crossed(const Cutter& cutter, const splitting::NodeGrid& grid,
                                      const Parallel& parallel) {
    return cutter.blade ? body::edges_crossed_by_blade(grid, *cutter.blade, parallel)
                        : splitting::edges_crossed_by_sheet(grid, cutter.sheet);
}

geometry::Box bounds_of(const Cutter& cutter) {
    if (!cutter.blade) return cutter.sheet.bounds();
    geometry::Box out;
    const cutting::Blade& blade = *cutter.blade;
    for (const cutting::SweptBlade& part : cutting::sweep(blade, blade.active_from(), blade.active_until()))
        out.add(part.bounds);
    return out;
}

void note_idle_cutters(const CutOptions& options, std::vector<Cutter>& cutters,
                       const splitting::NodeGrid& grid, const geometry::Box& body, const Parallel& parallel) {
    for (Cutter& cutter : cutters) {
        if (!is_idle(cutter)) continue;
        const cutting::Blade* blade = cutter.blade ? &*cutter.blade : nullptr;
        const IdleCutter idle{
            .cutter = bounds_of(cutter),
            .body = body,
            .crossed = edges_crossed(cutter, grid, parallel),
            .cell_size = grid.rest().cell_size,
            .body_name = options.mesh,
            .cell_option = "cell size",
            .unit = options.scale.unit(),
            .sweeps_nothing =
                blade != nullptr && sweeps_nothing(*blade, blade->active_from(), blade->active_until()),
            .plane = cutter.plane};
        cutter.idle_reason = idle_reason(idle.crossed);
        print_notes(cutter.what(), {idle_note(idle)});
    }
}

// Adds the entries of `cut` to a report of the surface.
void complete_report(Json& report, const CutOptions& options, const std::vector<Cutter>& cutters,
                     const CutResult& result) {
    report["pieces"] = pieces_report(result);
    report["mode"] = options.mode;
    report["cutters"] = cutters_report(cutters);
    report["volume_kept"] = result.volume(Fate::kept);
    report["volume_removed"] = result.volume(Fate::removed);
    report["volume_dropped"] = result.volume(Fate::dropped);
    report["volume_whole"] = result.whole.mesh.volume();
    if (result.kept().mesh.triangles.empty()) report["closed"] = true;  // an empty surface has no boundary
}

void name_files_for_report(Json& report, const std::string& file) {
    for (const char* list : {"pieces", "cutters"})
        for (Json& one : report[list])
            if (one.contains("file")) one["file"] = name_for_report(one["file"].get<std::string>(), file);
}

std::string count_text(std::size_t count, const char* thing) {
    return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

// Describes the pieces that --min-volume and --largest dropped.
std::string dropped_text(const CutOptions& options, const CutResult& result) {
    if (options.choice().all()) return "";
    const std::size_t dropped = result.count(Fate::dropped);
    if (dropped == 0) return "no piece was dropped\n";
    std::string why;
    if (options.min_volume > 0)
        why = "smaller than " + plain_number(options.min_volume) + " " + options.scale.unit_name + "^3";
    if (options.largest > 0)
        why += (why.empty() ? "" : " or ") + std::string("not among the ") + std::to_string(options.largest) +
               " largest";
    return count_text(dropped, "piece") + " dropped, " + why + ": " +
           options.scale.volume_text(result.volume(Fate::dropped)) + " in all\n";
}

void print_summary(const CutOptions& options, const CutResult& result, const Json& report) {
    const std::size_t kept = result.count(Fate::kept);
    std::cout << options.out << ": " << count_text(kept, "piece") << ", ";
    if (options.remove()) std::cout << result.count(Fate::removed) << " removed, ";
    std::cout << report["cut_edges"] << " cut edges, volume "
              << options.scale.volume_text(result.volume(Fate::kept));
    if (options.remove())
        std::cout << ", removed " << options.scale.volume_text(result.volume(Fate::removed));
    if (kept == 0) std::cout << ": nothing was kept, the surface is empty";
    std::cout << '\n' << dropped_text(options, result) << pieces_table(result, options.scale);
}

// Checks and locks the folder for pieces before the work.
std::optional<OutputFolder> open_pieces_folder(const CutOptions& options) {
    std::optional<OutputFolder> folder;
    if (options.pieces_folder.empty()) return folder;
    std::vector<std::filesystem::path> others{options.mesh, options.out, options.report, options.lost.mesh,
                                              options.lost.picture};
    for (const CutterOption& cutter : options.cutters)
        if (cutter.kind != CutterOption::Kind::plane) others.emplace_back(cutter.text);
    folder.emplace(options.pieces_folder, pieces_folder, options.force, others);
    for (const std::filesystem::path& file : others)
        if (!file.empty() && folder->may_write(file))
            throw InputError(file.string(), "has the name of a piece in the folder for pieces",
                             "give another name or folder");
    return folder;
}

int cut(const CutOptions& options, Progress& progress) {
    check_options(options);
    std::optional<OutputFolder> pieces_out = open_pieces_folder(options);
    Parallel parallel(options.threads);
    parallel.watch(&progress);
    parallel.begin("reading");
    Json seconds;
    Stopwatch watch;
    io::Model model = read_model_noted(options.mesh, options.out);
    options.scale.apply(model.mesh, options.mesh);
    const geometry::TriangleMesh& mesh = model.mesh;
    std::vector<Cutter> cutters =
        read_cutters(options.cutters, options.scale, options.remove(), mesh.bounds());
    seconds["read"] = watch.lap();

    const geometry::RestGrid rest = geometry::grid_around(
        mesh.bounds(),
        chosen_cell_size(mesh.bounds(), options.cells, options.cell_size, options.scale.unit()));
    parallel.begin("solid");
    splitting::SolidifyReport solid;
    solid.unit = options.scale.unit();
    splitting::NodeGrid grid = solid_of(options.mesh, mesh, rest, solid, parallel);
    seconds["solidify"] = watch.lap();
    parallel.begin("surface");
    splitting::Surface surface(grid, parallel);
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
    transfer_attributes(model, rest.cell_size, options.out, parallel, whole);
    seconds["attributes"] = watch.lap();
    const CutResult result = arrange_pieces(std::move(whole), pieces, removed, options.choice());
    progress.begin("files");
    note_idle_cutters(options, cutters, grid, mesh.bounds(), parallel);
    Json report = surface_report(grid, surface, pieces, solid, result.kept());
    complete_report(report, options, cutters, result);
    const std::string extension = std::filesystem::path(options.out).extension().string();
    if (pieces_out) write_pieces(*pieces_out, extension, result, options.scale, report["pieces"]);
    write_lost_material(options.lost, options.scale, solid, result.kept(), mesh.bounds(), rest.cell_size);
    write_scaled(options.out, result.kept(), options.scale);
    seconds["write"] = watch.lap();
    progress.finish();
    report["seconds"] = seconds;
    name_files_for_report(report, options.report);
    write_json(options.report, report);
    print_summary(options, result, report);
    if (extension == ".stl" && result.count(Fate::kept) > 1)
        print_notes(options.out,
                    {"STL does not say which triangles share a vertex: programs that read it join "
                     "pieces that touch; --pieces FOLDER or another format keeps them apart"});
    return 0;
}

int cut(const CutOptions& options) {
    Progress progress("cut");
    try {
        return cut(options, progress);
    } catch (const Cancelled&) {
        progress.finish();
        return end_interrupted("splitcubes: interrupted; nothing was written\n");
    }
}

}  // namespace

void add_cut_command(CommandLine& line) {
    const auto options = std::make_shared<CutOptions>();
    Command& command =
        line.add("cut", "Cuts a solid at rest with sheets, closed meshes, planes or blades on paths");
    command.add_text("MESH", "", options->mesh, "Mesh in: .obj .ply .stl .gltf .glb")
        .required()
        .completes(meshes_in());
    command.add_text("-o,--output", "FILE", options->out, "Whole surface out: .ply .obj .stl .glb")
        .required()
        .completes(meshes_out());
    add_cutter_options(command, options->cutters);
    command.add_choice(
        "--mode", "MODE", options->mode, {"separate", "remove"},
        "separate: keeps all pieces (default); remove: takes away those inside closed cutters");
    command.add_integer("--cells", "N", options->cells, {2, geometry::max_cells_per_axis},
                        "Cells along the longest side (48)");
    command.add_number("--cell-size", "LENGTH", options->cell_size, {1e-12, 1e12}, "Cell size, in the unit")
        .excludes("--cells");
    options->scale.add_to(command);
    command.add_number("--min-volume", "VOLUME", options->min_volume, above(0, 1e36),
                       "Drops pieces below this volume, in the unit's cube; they are counted and reported");
    command
        .add_integer("--largest", "N", options->largest, {1, 1000000000},
                     "Keeps only so many of the largest pieces (1); the others are counted and reported")
        .optional_number("1");
    command.add_text("--pieces", "FOLDER", options->pieces_folder, "Folder for one closed mesh a piece")
        .completes(folders());
    add_force_option(command, options->force, pieces_folder);
    command.add_text("--report", "FILE", options->report, "Writes a JSON report").completes(files());
    add_lost_material_options(command, options->lost);
    command.add_threads(options->threads);
    command.details =
        "Cutters cut in the order in which they are given; where two cross a grid edge, the first holds. "
        "MESH may stand anywhere; where nothing else is MESH, it is the last file after --with or --path.";
    command.example(
        "splitcubes cut scenes/meshes/pear.obj --with scenes/meshes/sheet.obj -o cut.ply --pieces pieces");
    command.example(
        "splitcubes cut scenes/meshes/pear.obj --with scenes/meshes/drill.obj --mode remove -o drilled.ply",
        "Takes away what lies inside a closed mesh");
    command.example("splitcubes cut whole.stl --plane z=10 --unit mm --largest -o half.stl",
                    "Cuts what 'surface' wrote at a height of 10 mm, keeps the larger part");
    command.run = [options] { return cut(*options); };
}

}  // namespace splitcubes::app
