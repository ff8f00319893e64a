// Times building a surface, stage by stage, next to other libraries that build one from the same mesh; and
// the same cut in a small body and a large one.
//   bench_build [--cells N] [--runs N] [--threads N] [--local-cells N] [--file MESH] [--json FILE]
#include "node_distance.h"
#include "other_tools.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <nlohmann/json.hpp>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <limits>

namespace splitcubes::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
    int cells = 128, runs = 5, threads = 2, local_cells = 48;
    std::string file, json;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    return n == 0 ? 0 : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

// Returns a ball with bumps: 102,400 triangles.
geometry::TriangleMesh bumpy_ball() {
    geometry::TriangleMesh mesh = geometry::make_capsule(1, 0, 320);
    for (Vec3& p : mesh.positions)
        p *= 1 + 0.06 * std::sin(7 * p[0]) * std::sin(8 * p[1] + 0.3) * std::sin(6 * p[2] + 0.7);
    return mesh;
}

struct Built {
    Timed timed;
    std::size_t cells = 0, bytes = 0;
};

// Times all stages. solidify welds, checks and sweeps itself: these are timed separately, and the rest of
// solidify is its third part.
Built our_surface(const Options& options, const geometry::TriangleMesh& made, const geometry::RestGrid& rest,
                  int threads) {
    Built out;
    out.timed = {"Splitcubes",
                 "",
                 threads,
                 0,
                 {"weld and check", "sweep", "rest of solidify", "tessellate", "pieces", "extract"},
                 std::vector<std::vector<double>>(6)};
    const bool from_file = !options.file.empty();
    if (from_file) {
        out.timed.parts.insert(out.timed.parts.begin(), "read");
        out.timed.seconds.emplace_back();
    }
    const Parallel parallel(threads);
    for (int run = 0; run < options.runs; ++run) {
        std::size_t part = 0;
        const auto note = [&](double seconds) { out.timed.seconds[part++].push_back(seconds); };
        Stopwatch watch;
        const geometry::TriangleMesh mesh = from_file ? io::read_mesh(options.file) : made;
        const double read = watch.lap();
        if (from_file) note(read);
        const geometry::TriangleMesh welded = geometry::weld_equal_vertices(mesh);
        const bool closed = geometry::is_closed(welded);
        const double checked = watch.lap();
        const std::size_t crossings = geometry::sweep_grid(rest, welded, parallel).crossings.size();
        const double swept = watch.lap();
        if (!closed || crossings == 0) throw InputError("bench_build", "needs a closed mesh");
        watch.lap();
        splitting::SolidifyReport report;
        const splitting::NodeGrid grid = splitting::solidify(mesh, rest, report, parallel);
        const double solid = watch.lap();
        note(checked);
        note(swept);
        note(std::max(0.0, solid - checked - swept));
        const splitting::Surface surface(grid);
        note(watch.lap());
        const splitting::Pieces pieces(grid);
        note(watch.lap());
        const geometry::SurfaceMesh extracted = splitting::extract(grid, surface, pieces, {}, {}, parallel);
        note(watch.lap());
        out.timed.triangles = extracted.mesh.triangles.size();
        out.cells = surface.cells().size();
        out.bytes = surface.bytes() + grid.bytes();
    }
    return out;
}

Json print(const Timed& timed) {
    if (!timed.skipped.empty()) {
        std::printf("%-28s skipped: %s\n", timed.name.c_str(), timed.skipped.c_str());
        return {{"name", timed.name}, {"skipped", timed.skipped}};
    }
    std::vector<double> whole(timed.seconds[0].size(), 0);
    for (const std::vector<double>& part : timed.seconds)
        for (std::size_t run = 0; run < part.size(); ++run) whole[run] += part[run];
    const double total = median(whole), triangles = static_cast<double>(timed.triangles);
    Json out = {{"name", timed.name},
                {"threads", timed.threads},
                {"triangles", timed.triangles},
                {"total_ms", 1e3 * total},
                {"ns_per_triangle", 1e9 * total / triangles},
                {"parts", Json::object()}};
    const std::string threads = timed.threads > 0 ? std::to_string(timed.threads) : "all";
    std::printf("%-28s %7s %10zu %10.2f %7s %9.1f\n", timed.name.c_str(), threads.c_str(), timed.triangles,
                1e3 * total, "", 1e9 * total / triangles);
    for (std::size_t k = 0; k < timed.parts.size(); ++k) {
        const double seconds = median(timed.seconds[k]);
        std::printf("    %-24s %7s %10s %10.2f %6.1f%% %9.1f\n", timed.parts[k].c_str(), "", "",
                    1e3 * seconds, 100 * seconds / total, 1e9 * seconds / triangles);
        out["parts"][timed.parts[k]] = {{"median_ms", 1e3 * seconds}, {"share", seconds / total}};
    }
    return out;
}

Json bench_surfaces(const Options& options) {
    const geometry::TriangleMesh mesh = options.file.empty() ? bumpy_ball() : io::read_mesh(options.file);
    const geometry::TriangleMesh welded = geometry::weld_equal_vertices(mesh);
    const geometry::RestGrid grid =
        geometry::grid_around(mesh.bounds(), geometry::cell_size_for(mesh.bounds(), options.cells));
    std::printf("surface of %s, %zu triangles, %d cells a side, medians of %d runs\n",
                options.file.empty() ? "a bumpy ball" : options.file.c_str(), mesh.triangles.size(),
                options.cells, options.runs);
    std::printf("%-28s %7s %10s %10s %7s %9s\n", "", "threads", "triangles", "ms", "share", "ns/triangle");
    Json rows = Json::array();
    Built built;
    for (int threads = 1; threads <= options.threads; ++threads) {
        built = our_surface(options, mesh, grid, threads);
        rows.push_back(print(built.timed));
    }
    for (int threads = 1; threads <= options.threads; ++threads)
        rows.push_back(print(openvdb_surface(welded, grid, threads, options.runs)));
    const std::vector<float> distance = node_distances(grid, welded);
    for (const int threads : {1, 0})
        rows.push_back(print(vtk_surface(distance, grid, threads, options.runs)));
    const double per_cell = static_cast<double>(built.bytes) / static_cast<double>(built.cells);
    std::printf("memory: %.1f MB of Surface and NodeGrid, %zu surface cells, %.0f bytes a surface cell\n",
                1e-6 * static_cast<double>(built.bytes), built.cells, per_cell);
    return {{"input_triangles", mesh.triangles.size()},
            {"cells_a_side", options.cells},
            {"runs", options.runs},
            {"rows", rows},
            {"bytes", built.bytes},
            {"surface_cells", built.cells},
            {"bytes_per_surface_cell", per_cell}};
}

struct Locality {
    std::size_t new_edges = 0, nodes = 0;
    std::vector<double> cut, retessellate, update, total;
};

// Times an incision of about 1000 edges from the top, z = 0, into a cube of `cells` cells of size 1 per side;
// its position does not depend on the cube.
Locality local_cut(int cells, int runs) {
    geometry::TriangleMesh box = geometry::make_box(Vec3::Constant(cells));
    for (Vec3& p : box.positions) p[2] -= 0.5 * cells;
    const geometry::RestGrid rest = geometry::grid_around(box.bounds(), 1.0);
    splitting::SolidifyReport report;
    const splitting::NodeGrid whole = splitting::solidify(box, rest, report, Parallel(1));
    const splitting::Surface uncut(whole);
    const geometry::TriangleMesh sheet =
        geometry::make_plane_sheet(Vec3(0.17, 0.23, -1.3), Vec3(1, 0.37, 0.11), 18.4, 8);
    // A small cut elsewhere first, so that copied arrays have grown before timing.
    const geometry::TriangleMesh elsewhere =
        geometry::make_plane_sheet(Vec3(0.1, 0.2, -32.4), Vec3(0.1, 0.2, 1), 3);
    Locality out;
    out.nodes = report.nodes_inside;
    for (int run = 0; run <= runs; ++run) {
        splitting::NodeGrid grid = whole;
        splitting::Surface surface = uncut;
        surface.retessellate(grid, splitting::cut_with_sheet(grid, elsewhere, 0));
        splitting::Pieces pieces(grid);
        Stopwatch watch;
        const std::vector<std::int32_t> slots = splitting::cut_with_sheet(grid, sheet, 1);
        const double cut = watch.lap();
        surface.retessellate(grid, slots);
        const double retessellate = watch.lap();
        pieces.update(grid, slots);
        const double update = watch.lap();
        if (pieces.count() != 1) throw JobError("the incision severs");
        out.new_edges = slots.size();
        if (run == 0) continue;  // warm-up
        out.cut.push_back(cut);
        out.retessellate.push_back(retessellate);
        out.update.push_back(update);
        out.total.push_back(cut + retessellate + update);
    }
    return out;
}

Json bench_locality(const Options& options) {
    const int runs = std::max(9, options.runs);
    const Locality small = local_cut(options.local_cells, runs);
    const Locality large = local_cut(4 * options.local_cells, runs);
    if (small.new_edges != large.new_edges) throw JobError("the two cuts are not the same");
    std::printf("\nlocality: one incision of %zu new edges, medians of %d runs, 1 thread, ms\n",
                small.new_edges, runs);
    const std::string head[2] = {std::to_string(options.local_cells) + "^3 cells",
                                 std::to_string(4 * options.local_cells) + "^3 cells"};
    std::printf("%-28s %14s %14s %8s\n", "", head[0].c_str(), head[1].c_str(), "ratio");
    Json out = {{"new_edges", small.new_edges}, {"runs", runs}, {"nodes", {small.nodes, large.nodes}}};
    const auto row = [&](const char* name, const std::vector<double>& a, const std::vector<double>& b) {
        const double first = 1e3 * median(a), second = 1e3 * median(b);
        std::printf("%-28s %14.4f %14.4f %8.2f\n", name, first, second, second / first);
        out[name] = {{"small_ms", first}, {"large_ms", second}, {"ratio", second / first}};
    };
    row("cut", small.cut, large.cut);
    row("retessellate", small.retessellate, large.retessellate);
    row("pieces", small.update, large.update);
    row("total", small.total, large.total);
    return out;
}

int whole_number(const std::string& option, const std::string& text, int low, int high) {
    char* end = nullptr;
    const long value = std::strtol(text.c_str(), &end, 10);
    if (text.empty() || *end != '\0' || value < low || value > high)
        throw InputError(option, "is '" + text + "'",
                         "give " + std::to_string(low) + " to " + std::to_string(high));
    return static_cast<int>(value);
}

Options parse(const std::vector<std::string>& words) {
    Options out;
    for (std::size_t k = 0; k < words.size(); k += 2) {
        const std::string& option = words[k];
        if (k + 1 == words.size()) throw InputError(option, "has no value");
        const std::string& value = words[k + 1];
        if (option == "--cells") {
            out.cells = whole_number(option, value, 8, geometry::max_cells_per_axis);
        } else if (option == "--runs") {
            out.runs = whole_number(option, value, 1, 1000);
        } else if (option == "--threads") {
            out.threads = whole_number(option, value, 1, 256);
        } else if (option == "--local-cells") {
            // Below, the incision does not fit; above, the large cube is too large.
            out.local_cells = whole_number(option, value, 40, geometry::max_cells_per_axis / 4);
        } else if (option == "--file") {
            out.file = value;
        } else if (option == "--json") {
            out.json = value;
        } else {
            throw InputError(option, "is not an option",
                             "known: --cells --runs --threads --local-cells --file --json");
        }
    }
    return out;
}

int run(const Options& options) {
    double load[3] = {-1, -1, -1};
    if (getloadavg(load, 3) > 0) std::printf("load of the machine at the start: %.2f\n", load[0]);
    Json out = {{"bench", "build"}, {"load_at_start", load[0]}};
    out["surface"] = bench_surfaces(options);
    out["locality"] = bench_locality(options);
    if (!options.json.empty()) {
        io::AtomicFile file(options.json);
        file.stream() << out.dump(2) << '\n';
        file.commit();
    }
    return 0;
}

}  // namespace
}  // namespace splitcubes::bench

int main(int argc, char** argv) {
#ifdef __GLIBC__
    // Keeps freed memory: otherwise the small body's arrays are recycled, the large one's are new page
    // faults, and the locality rows compare that.
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
    try {
        return splitcubes::bench::run(splitcubes::bench::parse({argv + 1, argv + argc}));
    } catch (const splitcubes::InputError& error) {
        std::cerr << "bench_build: " << error.what() << '\n';
        return 2;
    } catch (const std::exception& error) {
        std::cerr << "bench_build: " << error.what() << '\n';
        return 1;
    }
}
