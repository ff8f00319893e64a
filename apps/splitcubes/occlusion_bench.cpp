#include "occlusion_bench.h"

#include "embree_rays.h"
#include "opengl_backend.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/occlusion/criterion.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>

namespace splitcubes::app {

namespace {

using Triangles = std::vector<geometry::OccluderTriangle>;

// Returns a wavy sheet across pairs of phyxels at distance 1, cut half way through the disks: `count`
// triangles in a square of side 2.4, with waves in two directions.
Triangles waved_sheet(int count) {
    const int quads = std::max(1, static_cast<int>(std::lround(std::sqrt(count / 2.0))));
    const auto at = [&](int i, int j) {
        const double u = -1.2 + 2.4 * i / quads, v = -1.2 + 2.4 * j / quads;
        return Vec3(u, v, 0.07 * std::sin(4 * u + 1) + 0.05 * std::cos(5 * v) + 0.05 * u);
    };
    Triangles out;
    for (int j = 0; j < quads; ++j)
        for (int i = 0; i < quads / 2 + 1; ++i) {
            out.push_back({{at(i, j), at(i + 1, j), at(i + 1, j + 1)}, false});
            out.push_back({{at(i, j), at(i + 1, j + 1), at(i, j + 1)}, false});
        }
    return out;
}

// Uses cells of a fifth of the pairs' distance, as for surface cells with a phyxel spacing of 5 cells.
geometry::OccluderGrid bench_grid(const Triangles& triangles) {
    constexpr int cells = 24;
    constexpr double size = 0.2;
    const Vec3 origin = Vec3::Constant(-0.5 * cells * size);
    geometry::OccluderGrid grid(origin, size, Vec3i::Constant(cells));
    std::vector<Triangles> by_cell(cells * cells * cells);
    for (const auto& t : triangles) {
        const Vec3i c = ((t.corner[0] - origin) / size).array().floor().cast<int>();
        by_cell[static_cast<std::size_t>(c[0] + cells * (c[1] + cells * c[2]))].push_back(t);
    }
    for (int k = 0; k < cells * cells * cells; ++k)
        if (const auto& own = by_cell[static_cast<std::size_t>(k)]; !own.empty())
            grid.set_cell({k % cells, k / cells % cells, k / cells / cells}, own);
    return grid;
}

std::vector<occlusion::PairQuery> pairs_across(std::size_t count) {
    Random random(1);
    std::vector<occlusion::PairQuery> out;
    for (std::size_t k = 0; k < count; ++k) {
        const auto jitter = [&](double z) {
            const double x = random.uniform(-0.15, 0.15), y = random.uniform(-0.15, 0.15);
            return Vec3(x, y, z + random.uniform(-0.1, 0.1));
        };
        const Vec3 below = jitter(-0.5);
        out.push_back({below, jitter(0.5)});
    }
    return out;
}

struct Seconds {
    double median, shortest;
};

Seconds time_of(int runs, const std::function<void()>& work) {
    work();
    std::vector<double> seconds;
    for (int k = 0; k < runs; ++k) {
        Stopwatch watch;
        work();
        seconds.push_back(watch.seconds());
    }
    std::sort(seconds.begin(), seconds.end());
    return {seconds[static_cast<std::size_t>(runs / 2)], seconds[0]};
}

struct OcclusionCase {
    int size;
    std::size_t near;  // triangles near a disk, mean
    std::vector<occlusion::PairQuery> pairs;
    Json* rows;

    void add(const char* how, int threads, const Seconds& seconds) const {
        const auto count = static_cast<double>(pairs.size());
        const double disk = seconds.median / count, shortest = seconds.shortest / count;
        std::printf("| %4d | %6zu | %-6s | %7d | %9.3f | %9.3f | %12.2f | %9.0f |\n", size, near, how,
                    threads, 1e6 * disk, 1e6 * shortest, 1e9 * shortest / static_cast<double>(near),
                    1 / disk);
        rows->push_back({{"size", size},
                         {"near", near},
                         {"how", how},
                         {"threads", threads},
                         {"microseconds_per_disk", 1e6 * disk},
                         {"microseconds_per_disk_fastest", 1e6 * shortest},
                         {"nanoseconds_per_disk_and_triangle", 1e9 * shortest / static_cast<double>(near)},
                         {"disks_per_second", 1 / disk}});
    }
};

// Returns the largest difference between two sets of visibilities.
double worst(std::span<const float> a, std::span<const float> b) {
    double out = 0;
    for (std::size_t k = 0; k < a.size(); ++k)
        out = std::max(out, std::abs(static_cast<double>(a[k]) - static_cast<double>(b[k])));
    return out;
}

// Fails if backends differ by more than samples at edges.
void check_equal(const char* how, const OcclusionCase& c, std::span<const float> a,
                 std::span<const float> b) {
    if (const double difference = worst(a, b); difference > 0.06)
        throw JobError(std::string("bench occlusion: ") + how + " differs from cpu by " +
                       std::to_string(difference) + " at size " + std::to_string(c.size));
}

void time_occlusion(const OcclusionCase& c, const Triangles& triangles, int runs,
                    const decltype(body::BodySettings::make_visibility_backend)& make_opengl) {
    const geometry::OccluderGrid grid = bench_grid(triangles);
    const occlusion::VisibilityOptions options{.disk_size = c.size, .full_occlusion_threshold = 0};
    std::vector<float> cpu(c.pairs.size()), other(c.pairs.size());
    const auto backend = occlusion::make_cpu_backend(options);
    for (const int threads : {1, 2}) {
        const Parallel parallel(threads);
        c.add("cpu", threads, time_of(runs, [&] { backend->evaluate(grid, c.pairs, cpu, parallel); }));
    }
    if (EmbreeRays::built_in()) {
        const EmbreeRays rays(triangles);
        const occlusion::DiskRaster raster(c.size);
        std::vector<int> visible(c.pairs.size());
        c.add("embree", 1, time_of(runs, [&] { rays.count(c.pairs, raster, visible); }));
        for (std::size_t k = 0; k < visible.size(); ++k)
            other[k] = static_cast<float>(visible[k]) / static_cast<float>(raster.sample_count);
        check_equal("embree", c, cpu, other);
        c.rows->push_back({{"how", "embree, building"},
                           {"triangles", triangles.size()},
                           {"milliseconds", 1e3 * rays.build_seconds()}});
    }
    // Runs last: threads of a software rasteriser stay busy for a while.
    if (make_opengl) {
        const auto drawn = make_opengl(options);
        const Parallel parallel(1);
        c.add("opengl", 1, time_of(1, [&] { drawn->evaluate(grid, c.pairs, other, parallel); }));
        check_equal("opengl", c, cpu, other);
    }
}

}  // namespace

Json bench_occlusion(int runs) {
    decltype(body::BodySettings::make_visibility_backend) make_opengl;
    std::string no_opengl = "built without OpenGL";
    try {
        make_opengl = opengl_backend_maker(true);
    } catch (const JobError& error) {
        no_opengl = error.what();
    }
    if (!make_opengl) std::printf("no rows of opengl: %s\n", no_opengl.c_str());
    if (!EmbreeRays::built_in())
        std::printf("no rows of embree: built without (configure with -DSPLITCUBES_BENCH_EMBREE=ON)\n");
    std::printf("| size | near   | how    | threads | us a disk | fastest   | ns disk, tri | disks / s |\n");
    std::printf("|---|---|---|---|---|---|---|---|\n");
    Json rows = Json::array();
    for (const int size : {8, 16, 32})
        // Triangle counts for which 10, 50, 200, 1000 and 10,000 are near a disk.
        for (const int count : {20, 320, 1600, 9600, 98000}) {
            const Triangles triangles = waved_sheet(count);
            const geometry::OccluderGrid grid = bench_grid(triangles);
            OcclusionCase c{size, 0, pairs_across(count > 5000 ? 50 : 1000), &rows};
            std::size_t near = 0;
            for (const auto& pair : c.pairs)
                grid.visit(occlusion::double_cone_bounds(pair), [&](const auto&) { ++near; });
            c.near = std::max<std::size_t>(1, near / c.pairs.size());
            time_occlusion(c, triangles, runs, make_opengl);
        }
    const Json json = {{"bench", "occlusion"}, {"runs", runs}, {"rows", rows}};
    std::cout << json.dump() << '\n';
    return json;
}

}  // namespace splitcubes::app
