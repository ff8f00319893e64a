#include "mechanics_bench.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/dynamics/time_integrator.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <numeric>

namespace splitcubes::app {

namespace {

using meshless::LinkSlices;

constexpr double spacing = 0.05;  // m
constexpr double time_step = 1.0 / 60;

// A vibrating lattice of phyxels, held at one side like typical bodies.
struct Block {
    meshless::Phyxels phyxels;
    meshless::Pairs pairs;
    meshless::Neighbourhoods neighbourhoods;
    meshless::Material material;
    meshless::TimeIntegrator solver;
    meshless::StepInput input;
    meshless::SolverOptions options;
    std::vector<std::uint8_t> held;
    std::vector<Vec3> held_position;

    Block(const Vec3i& count, double youngs_modulus, const Parallel& parallel) {
        material.youngs_modulus = youngs_modulus;
        material.poisson_ratio = 0.33;
        for (int z = 0; z < count.z(); ++z)
            for (int y = 0; y < count.y(); ++y)
                for (int x = 0; x < count.x(); ++x) {
                    phyxels.append(spacing * Vec3(x, y, z), 0.5 * spacing);
                    phyxels.volume.back() = spacing * spacing * spacing;
                    phyxels.mass.back() = material.density * phyxels.volume.back();
                }
        const meshless::PhyxelLocator locator(phyxels.rest_position, 1.6 * spacing);
        meshless::compute_support_radii(phyxels, locator, parallel);
        pairs = meshless::find_pairs(phyxels, locator, parallel);
        neighbourhoods.rebuild(phyxels, pairs, material, parallel);
        input.dt = time_step;
        input.gravity = Vec3(0, 0, -9.81);
        for (const Vec3& rest : phyxels.rest_position) held.push_back(rest.x() < 0.5 * spacing);
        held_position = phyxels.rest_position;
        input.held = held;
        input.held_position = held_position;
    }
    meshless::SolverReport step(const Parallel& parallel) {
        return solver.step(phyxels, neighbourhoods, material, input, options, parallel);
    }
    double links() const { return static_cast<double>(neighbourhoods.link_count()); }
};

struct Spread {
    double median = 0, fastest = 0, slowest = 0;
    explicit Spread(std::vector<double> values) {
        std::sort(values.begin(), values.end());
        median = values[values.size() / 2];
        fastest = values.front();
        slowest = values.back();
    }
};

// Returns milliseconds per call, averaged over `calls` calls; repeated `runs` times.
Spread timed(int runs, int calls, const std::function<void()>& call) {
    std::vector<double> ms;
    for (int run = 0; run < runs; ++run) {
        Stopwatch watch;
        for (int k = 0; k < calls; ++k) call();
        ms.push_back(1e3 * watch.seconds() / calls);
    }
    return Spread(ms);
}

// Times the gathers of gradients and forces alone.
double bare_gathers(const Block& block, int runs, const Parallel& parallel) {
    const LinkSlices& slices = block.neighbourhoods.slices();
    const std::size_t n = slices.stride();
    meshless::FloatArray p(3 * n), gradient(9 * n), force(3 * n);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = static_cast<float>(i % 17) * 1e-3F;
    const int calls = std::max(3, static_cast<int>(3e7 / block.links()));
    return timed(runs, calls,
                 [&] {
                     meshless::for_slices(
                         parallel, slices.slice_count(), [&](const meshless::SliceRange& range) {
                             meshless::bare_gradients(slices, range, p.data(), gradient.data());
                         });
                     meshless::for_slices(
                         parallel, slices.slice_count(), [&](const meshless::SliceRange& range) {
                             meshless::bare_forces(slices, range, gradient.data(), force.data());
                         });
                 })
        .fastest;
}

// Measures the bandwidth, GB/s, of reading the links that one product with the stiffness reads.
double streaming(const Block& block, int runs, const Parallel& parallel) {
    const std::size_t words = block.neighbourhoods.slices().bytes() / sizeof(std::uint64_t);
    const std::vector<std::uint64_t> memory(words, 1);
    std::vector<std::uint64_t> sums((words + 8191) / 8192);
    const int calls = std::max(3, static_cast<int>(1e8 / static_cast<double>(words)));
    const Spread ms = timed(runs, calls, [&] {
        parallel.for_chunks(words, 8192, [&](std::size_t begin, std::size_t end) {
            sums[begin / 8192] +=
                std::accumulate(memory.begin() + static_cast<std::ptrdiff_t>(begin),
                                memory.begin() + static_cast<std::ptrdiff_t>(end), std::uint64_t{0});
        });
    });
    return static_cast<double>(words * sizeof(std::uint64_t)) / (1e6 * ms.median);
}

struct MechanicsCase {
    const char* kind;
    double youngs_modulus;
    bool is_explicit;
};

Json bench_case(const Vec3i& count, const MechanicsCase& which, int runs, double bare,
                const Parallel& parallel) {
    Block block(count, which.youngs_modulus, parallel);
    block.options.kind =
        which.is_explicit ? meshless::SolverKind::explicit_steps : meshless::SolverKind::implicit_steps;
    std::vector<double> ms, processor;
    double iterations = 0, substeps = 0;
    for (int k = 0; k < 20; ++k) block.step(parallel);
    const int steps = 10 * runs;
    bool finite = true;
    for (int k = 0; k < steps; ++k) {
        Stopwatch watch;
        const std::clock_t before = std::clock();
        const meshless::SolverReport report = block.step(parallel);
        processor.push_back(1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
        ms.push_back(1e3 * watch.seconds());
        iterations += static_cast<double>(report.iterations) / steps;
        substeps += static_cast<double>(report.substeps) / steps;
        finite = finite && report.non_finite == 0 && report.inverted == 0;
    }
    const Spread spread(ms), busy(processor);
    // Products with the stiffness per step: one per substep or per iteration.
    const double products = which.is_explicit ? substeps : iterations + 1;
    const double each = 1e6 * spread.median / (products * block.links());
    // Uses the minima, which other load on the machine affects least.
    const double share = bare * products / spread.fastest;
    const std::size_t n = block.phyxels.size();
    std::printf(
        "| %6zu | %7d | %-13s | %7.0e | %8.3f | %8.3f | %8.3f | %9.3f | %6.1f | %8.1f | %6.2f | %4.0f %% "
        "|%s\n",
        n, parallel.thread_count(), which.kind, which.youngs_modulus, spread.median, spread.fastest,
        spread.slowest, busy.median, products, 1e3 * spread.median / products, each, 100 * share,
        finite ? "" : " NOT FINITE");
    return {{"phyxels", n},
            {"threads", parallel.thread_count()},
            {"kind", which.kind},
            {"youngs_modulus", which.youngs_modulus},
            {"median_ms", spread.median},
            {"processor_ms", busy.median},
            {"min_ms", spread.fastest},
            {"max_ms", spread.slowest},
            {"products", products},
            {"us_per_product", 1e3 * spread.median / products},
            {"ns_per_neighbour", each},
            {"floor_share", share}};
}

// Returns pairs across a plane within a patch of about a hundred grid edges of half a spacing.
std::vector<std::uint32_t> patch_pairs(const Block& block) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& rest : block.phyxels.rest_position)
        middle += rest / static_cast<double>(block.phyxels.size());
    middle.x() = spacing * (std::floor(middle.x() / spacing) + 0.5);
    std::vector<std::uint32_t> out;
    for (std::uint32_t p = 0; p < block.pairs.size(); ++p) {
        const Vec3 a = block.phyxels.rest_position[block.pairs.a[p]] - middle;
        const Vec3 b = block.phyxels.rest_position[block.pairs.b[p]] - middle;
        if ((a.x() < 0) == (b.x() < 0)) continue;
        const Vec3 at = a + (b - a) * (a.x() / (a.x() - b.x()));
        if (at.tail<2>().cwiseAbs().maxCoeff() < 2.5 * spacing) out.push_back(p);
    }
    return out;
}

Json bench_cut(const Vec3i& count, int runs, const Parallel& parallel) {
    Block block(count, 2.5e5, parallel);
    const std::vector<std::uint32_t> pairs = patch_pairs(block);
    std::vector<double> ms;
    for (int run = 0; run < 2 * runs; ++run) {
        for (const std::uint32_t p : pairs) block.pairs.visibility[p] = run % 2 == 0 ? 0.0F : 1.0F;
        Stopwatch watch;
        block.neighbourhoods.update(block.phyxels, block.pairs, pairs, block.material, parallel);
        ms.push_back(1e3 * watch.seconds());
    }
    const Spread spread(ms);
    std::printf("| %6zu | %7d | %5zu | %8.3f | %8.3f | %8.3f |\n", block.phyxels.size(),
                parallel.thread_count(), pairs.size(), spread.median, spread.fastest, spread.slowest);
    return {{"phyxels", block.phyxels.size()}, {"threads", parallel.thread_count()},
            {"pairs", pairs.size()},           {"median_ms", spread.median},
            {"min_ms", spread.fastest},        {"max_ms", spread.slowest}};
}

// Builds the largest body with a surface and a blade that passes through it.
std::unique_ptr<body::World> cut_world(const std::shared_ptr<const Parallel>& parallel) {
    constexpr double side = 31 * spacing;
    body::WorldSettings settings;
    settings.time_step = time_step;
    auto world = std::make_unique<body::World>(settings, parallel);
    body::BodySettings cube;
    cube.name = "cube";
    cube.cell_size = 0.5 * spacing;
    cube.phyxel_spacing = spacing;
    cube.material.youngs_modulus = 2.5e5;
    cube.material.poisson_ratio = 0.33;
    body::Body& body = world->add_body(geometry::make_box(Vec3::Constant(side)), cube);
    body.add_constraint({[](const Vec3& rest) { return rest.x() < -0.46 * side; },
                         [](double) { return Isometry::Identity(); }});
    const cutting::BladeShape shape = cutting::make_straight_blade({0, -0.7 * side, 0}, {0, 0.7 * side, 0});
    world->add_tool(cutting::Blade("blade", shape,
                                   {{0.1, {0.013 * side, 0, 0.6 * side}, Quat::Identity()},
                                    {1.1, {0.013 * side, 0, -0.8 * side}, Quat::Identity()}}));
    return world;
}

Json bench_world(const std::shared_ptr<const Parallel>& parallel) {
    const std::unique_ptr<body::World> world = cut_world(parallel);
    std::array<std::vector<double>, body::stage_count> stages;
    std::vector<double> whole, idle;
    double edges = 0;
    std::size_t phyxels = 0, triangles = 0;
    for (int k = 0; k < 50; ++k) {
        const body::StepReport report = world->step();
        phyxels = report.totals.phyxels;
        triangles = report.totals.triangles;
        if (report.counts.new_cut_edges == 0) {
            idle.push_back(1e3 * report.total_seconds());
            continue;
        }
        whole.push_back(1e3 * report.total_seconds());
        edges += static_cast<double>(report.counts.new_cut_edges);
        for (std::size_t s = 0; s < body::stage_count; ++s) stages[s].push_back(1e3 * report.seconds[s]);
    }
    const Spread cutting(whole), still(idle);
    const double per_step = edges / static_cast<double>(whole.size());
    std::printf(
        "\nWhole steps of %zu phyxels with a surface of %zu triangles, %d threads, a blade passing\n"
        "(%.0f new cut edges a step): median %.2f ms, longest %.2f ms; without a cut %.2f ms.\n\n",
        phyxels, triangles, parallel->thread_count(), per_step, cutting.median, cutting.slowest,
        still.median);
    std::printf("| stage | median ms | longest ms |\n|---|---|---|\n");
    Json rows;
    for (std::size_t s = 0; s < body::stage_count; ++s) {
        const Spread spread(stages[s]);
        std::printf("| %-22s | %8.3f | %8.3f |\n", body::stage_names[s], spread.median, spread.slowest);
        rows[body::stage_names[s]] = {{"median_ms", spread.median}, {"max_ms", spread.slowest}};
    }
    return {{"phyxels", phyxels},
            {"triangles", triangles},
            {"threads", parallel->thread_count()},
            {"new_edges_a_step", per_step},
            {"median_ms", cutting.median},
            {"max_ms", cutting.slowest},
            {"idle_median_ms", still.median},
            {"stages", rows}};
}

Json bench_floor(const Block& block, int runs, const Parallel& parallel, double& bare) {
    const LinkSlices& slices = block.neighbourhoods.slices();
    const double links = block.links();
    bare = bare_gathers(block, runs, parallel);
    const double speed = streaming(block, runs, parallel);
    const double bytes = static_cast<double>(slices.bytes()) / links;
    const double padding = static_cast<double>(slices.column_count() * LinkSlices::lanes) / links;
    std::printf("| %6zu | %7d | %6.1f | %6.1f | %5.2f | %6.2f | %6.3f | %6.2f | %5.0f |\n",
                block.phyxels.size(), parallel.thread_count(),
                links / static_cast<double>(block.phyxels.size()), bytes, padding,
                static_cast<double>(slices.gather_count()) / static_cast<double>(slices.column_count()), bare,
                1e6 * bare / links, speed);
    return {{"phyxels", block.phyxels.size()},
            {"threads", parallel.thread_count()},
            {"neighbours", links / static_cast<double>(block.phyxels.size())},
            {"bytes_per_neighbour", bytes},
            {"padding", padding},
            {"gathers_ms", bare},
            {"gathers_ns_per_neighbour", 1e6 * bare / links},
            {"streaming_gb_per_s", speed}};
}

}  // namespace

Json bench_mechanics(const MechanicsBenchSettings& settings) {
    const std::vector<int> threads = settings.threads.empty() ? std::vector<int>{1, 2} : settings.threads;
    const std::vector<Vec3i> counts = {{10, 10, 8}, {17, 17, 17}, {31, 31, 31}};
    const std::vector<MechanicsCase> cases = {
        {"explicit step", 2.5e5, true}, {"implicit step", 2.5e5, false}, {"implicit step", 1e8, false}};
    Json floor = Json::array(), steps = Json::array(), cuts = Json::array(), worlds = Json::array();
    std::vector<double> bare(threads.size() * counts.size());
    std::printf("bench mechanics: spacing %.2f m, Poisson's ratio 0.33, %d runs, vectors: %s\n\n", spacing,
                settings.runs, meshless::instruction_set());
    std::printf(
        "The floor: gathers of gradients and forces alone, and reading as many bytes.\n\n"
        "| phyxels | threads | neighbours | bytes a neighbour | padding | gathered | ms | ns a neighbour "
        "| GB/s |\n|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t c = 0; c < counts.size(); ++c)
        for (std::size_t t = 0; t < threads.size(); ++t) {
            const Parallel parallel(threads[t]);
            const Block block(counts[c], 2.5e5, parallel);
            floor.push_back(bench_floor(block, settings.runs, parallel, bare[c * threads.size() + t]));
        }
    std::printf(
        "\nSteps of 1/60 s, held at one side. A product with the stiffness is a "
        "substep of the explicit solver or an iteration of the implicit one.\n\n| phyxels | threads | kind | "
        "E, Pa | ms | min | max | "
        "processor ms | products | us a product | ns a neighbour and product | of the floor |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t c = 0; c < counts.size(); ++c)
        for (const MechanicsCase& which : cases)
            for (std::size_t t = 0; t < threads.size(); ++t)
                steps.push_back(bench_case(counts[c], which, settings.runs, bare[c * threads.size() + t],
                                           Parallel(threads[t])));
    std::printf(
        "\nRows rebuilt after a cut of about 100 edges of a grid of half the spacing.\n\n"
        "| phyxels | threads | pairs | ms | min | max |\n|---|---|---|---|---|---|\n");
    for (const Vec3i& count : counts)
        for (const int t : threads) cuts.push_back(bench_cut(count, settings.runs, Parallel(t)));
    for (const int t : threads) worlds.push_back(bench_world(std::make_shared<const Parallel>(t)));
    return {{"bench", "mechanics"}, {"vectors", meshless::instruction_set()},
            {"floor", floor},       {"steps", steps},
            {"cuts", cuts},         {"worlds", worlds}};
}

}  // namespace splitcubes::app
