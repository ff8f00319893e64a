// Micro-benchmarks of a surface, a cut and an occlusion disk.
#include <benchmark/benchmark.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/occlusion/visibility.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/surface.h>

namespace {

using namespace splitcubes;

splitting::NodeGrid solid_sphere(int cells) {
    const geometry::TriangleMesh mesh = geometry::make_sphere(1, 5);
    splitting::SolidifyReport report;
    return splitting::solidify(mesh, geometry::grid_around(mesh.bounds(), 2.0 / cells), report, Parallel(1));
}

// Times building the whole surface, per triangle. Argument: cells along the diameter.
void build_surface(benchmark::State& state) {
    const splitting::NodeGrid grid = solid_sphere(static_cast<int>(state.range(0)));
    std::size_t triangles = 0;
    for (auto _ : state) {
        const splitting::Surface surface(grid);
        triangles += surface.triangle_count();
        benchmark::DoNotOptimize(surface.vertices().data());
    }
    state.counters["per_triangle"] = benchmark::Counter(
        static_cast<double>(triangles), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(build_surface)->Arg(32)->Arg(64)->Arg(128)->Unit(benchmark::kMillisecond);

// Times the same small cut in spheres of several sizes, per cut edge: the cost should depend on the cut, not
// on the body.
void retessellate_cut(benchmark::State& state) {
    const int cells = static_cast<int>(state.range(0));
    const splitting::NodeGrid whole = solid_sphere(cells);
    const splitting::Surface uncut(whole);
    const geometry::TriangleMesh sheet =
        geometry::make_plane_sheet(Vec3(0, 0, 0.01 / cells), Vec3(0.1, 0.2, 1), 8.0 / cells);
    const geometry::TriangleMesh elsewhere =
        geometry::make_plane_sheet(Vec3(0.4, 0.4, 0.4), Vec3(0.1, 0.2, 1), 8.0 / cells);
    std::size_t edges = 0;
    for (auto _ : state) {
        state.PauseTiming();
        splitting::NodeGrid grid = whole;
        splitting::Surface surface = uncut;
        // A first cut elsewhere, so that the copies' arrays have spare capacity.
        surface.retessellate(grid, splitting::cut_with_sheet(grid, elsewhere, 0));
        const std::vector<std::int32_t> slots = splitting::cut_with_sheet(grid, sheet, 1);
        edges += slots.size();
        state.ResumeTiming();
        benchmark::DoNotOptimize(surface.retessellate(grid, slots).size());
    }
    state.counters["per_edge"] = benchmark::Counter(
        static_cast<double>(edges), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(retessellate_cut)->Arg(32)->Arg(64)->Arg(128)->Unit(benchmark::kMicrosecond);

// Times a disk of 16 x 16 with the triangles of a sheet near it.
void occlusion_disk(benchmark::State& state) {
    const auto backend = occlusion::make_cpu_backend({});
    geometry::OccluderGrid occluders(Vec3::Zero(), 1, Vec3i::Constant(16));
    const geometry::TriangleMesh sheet =
        geometry::make_wavy_sheet(Vec3(8, 8, 8), Vec3::UnitZ(), 7.5, 15, 0.3, 5);
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x) {
                std::vector<geometry::OccluderTriangle> own;
                for (const geometry::Triangle& t : sheet.triangles) {
                    const Vec3& a = sheet.positions[t[0]];
                    if ((a.array().floor().cast<int>() == Vec3i(x, y, z).array()).all())
                        own.push_back({{a, sheet.positions[t[1]], sheet.positions[t[2]]}, false});
                }
                occluders.set_cell(Vec3i(x, y, z), own);
            }
    std::vector<occlusion::PairQuery> pairs;
    for (int k = 0; k < 256; ++k) {
        const double x = 4 + 8.0 * (k % 16) / 16, y = 4 + 8.0 * (k / 16) / 16;
        pairs.push_back({Vec3(x, y, 7), Vec3(x + 0.7, y - 0.4, 9)});
    }
    std::vector<float> visibility(pairs.size());
    const Parallel one(1);
    for (auto _ : state) backend->evaluate(occluders, pairs, visibility, one);
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(pairs.size()));
}
BENCHMARK(occlusion_disk)->Unit(benchmark::kMicrosecond);

}  // namespace
