#include "stalls_bench.h"

#include "contact_bench.h"
#include "paper_world.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

namespace splitcubes::app {

namespace {

using ParallelPointer = std::shared_ptr<const Parallel>;
using WorldPointer = std::unique_ptr<body::World>;

constexpr double time_step = 1.0 / 60;
constexpr double large_spacing = 0.05;             // m
constexpr double large_side = 31 * large_spacing;  // m, 29,791 phyxels

body::BodySettings soft_block(double cell_size, double phyxel_spacing) {
    body::BodySettings block;
    block.name = "block";
    block.cell_size = cell_size;
    block.phyxel_spacing = phyxel_spacing;
    block.material.youngs_modulus = 2.5e5;
    block.material.poisson_ratio = 0.33;
    return block;
}

// A cube that a blade parts in the middle.
WorldPointer make_severed_world(const ParallelPointer& parallel) {
    body::WorldSettings settings;
    settings.time_step = time_step;
    auto world = std::make_unique<body::World>(settings, parallel);
    body::Body& body = world->add_body(geometry::make_box(Vec3::Constant(large_side)),
                                       soft_block(0.5 * large_spacing, large_spacing));
    body.add_constraint({[](const Vec3& rest) { return rest.x() < -0.46 * large_side; },
                         [](double) { return Isometry::Identity(); }});
    const cutting::BladeShape shape =
        cutting::make_straight_blade({0, -0.7 * large_side, 0}, {0, 0.7 * large_side, 0});
    world->add_tool(cutting::Blade("blade", shape,
                                   {{0.1, {0.013 * large_side, 0, 0.6 * large_side}, Quat::Identity()},
                                    {0.9, {0.013 * large_side, 0, -0.6 * large_side}, Quat::Identity()}}));
    return world;
}

Vec3 cut_direction(Random& random) {
    const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * std::numbers::pi);
    const double radius = std::sqrt(1 - z * z);
    return {radius * std::cos(angle), radius * std::sin(angle), z};
}

// Adds square flat cuts within a box, m, one every second step from the sixth on.
void add_random_cuts(body::World& world, const geometry::Box& centres, int count, double min_side,
                     double max_side) {
    Random random(1);
    for (int k = 0; k < count; ++k) {
        Vec3 centre;
        for (int axis = 0; axis < 3; ++axis)
            centre[axis] = random.uniform(centres.min[axis], centres.max[axis]);
        const Vec3 along = cut_direction(random);
        const Vec3 path = along.cross(cut_direction(random)).normalized();
        const double half = 0.5 * random.uniform(min_side, max_side);
        const cutting::BladeShape shape = cutting::make_straight_blade(-half * along, half * along);
        const double begin = (6 + 2 * k) * time_step;
        world.add_tool(cutting::Blade("blade " + std::to_string(k), shape,
                                      {{begin, centre - half * path, Quat::Identity()},
                                       {begin + time_step, centre + half * path, Quat::Identity()}}));
    }
}

// A block on the ground that random cuts turn into rubble.
WorldPointer make_rubble_world(const ParallelPointer& parallel) {
    body::WorldSettings settings;
    settings.time_step = time_step;
    settings.contact.pieces = true;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
    auto world = std::make_unique<body::World>(settings, parallel);
    geometry::TriangleMesh box = geometry::make_box({0.4, 0.5, 0.5});
    for (Vec3& position : box.positions) position.z() += 0.25;
    world->add_body(box, soft_block(0.025, 0.05));
    add_random_cuts(*world, {{-0.1, -0.1, 0.15}, {0.1, 0.1, 0.35}}, 30, 0.25, 0.55);
    return world;
}

WorldPointer make_random_cuts_world(const ParallelPointer& parallel) {
    body::WorldSettings settings;
    settings.time_step = time_step;
    auto world = std::make_unique<body::World>(settings, parallel);
    world->add_body(geometry::make_box(Vec3::Constant(large_side)),
                    soft_block(0.5 * large_spacing, large_spacing));
    const double reach = 0.25 * large_side;
    add_random_cuts(*world, {Vec3::Constant(-reach), Vec3::Constant(reach)}, 20, 0.6 * large_side,
                    1.6 * large_side);
    return world;
}

// A block that three gangs of parallel blades cut into cubes: into slabs, into columns, and row by row into
// 12,167 pieces of one node each.
WorldPointer make_shredded_world(const ParallelPointer& parallel) {
    constexpr int cells = 23;
    constexpr double cell = 0.02, side = cells * cell;
    body::WorldSettings settings;
    settings.time_step = time_step;
    settings.gravity = Vec3::Zero();
    auto world = std::make_unique<body::World>(settings, parallel);
    world->add_body(geometry::make_box(Vec3::Constant(side)), soft_block(cell, 2 * cell));
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 across = Vec3::Unit(axis), along = Vec3::Unit((axis + 1) % 3),
                   path = Vec3::Unit((axis + 2) % 3);
        cutting::BladeShape gang;
        for (int k = 1; k < cells; ++k) {
            const Vec3 at = (k * cell - 0.5 * side) * across;
            gang.polylines.push_back({at - 0.7 * side * along, at + 0.7 * side * along});
        }
        const double begin = (4 + 12 * axis) * time_step, end = begin + (axis == 2 ? 24 : 10) * time_step;
        world->add_tool(cutting::Blade(
            "gang " + std::to_string(axis), gang,
            {{begin, -0.6 * side * path, Quat::Identity()}, {end, 0.6 * side * path, Quat::Identity()}}));
    }
    return world;
}

struct StallCase {
    const char* name;
    std::function<WorldPointer(const ParallelPointer&)> make;
    int steps;
};

std::vector<StallCase> stall_cases() {
    return {{"paper", [](const ParallelPointer& p) { return make_paper_world(p); }, paper_steps},
            {"sever", make_severed_world, 60},
            {"random cuts", make_random_cuts_world, 52},
            {"tearing", make_large_tearing_world, 36},
            {"rubble", make_rubble_world, 130},
            {"shredding", make_shredded_world, 58}};
}

// Times of one step, the shortest of all runs.
struct StepTimes {
    std::array<double, body::stage_count> stages;                // ms
    double whole = std::numeric_limits<double>::infinity();      // ms
    double processor = std::numeric_limits<double>::infinity();  // ms, of all threads
    bool cuts = false;
};

struct StallRuns {
    std::vector<StepTimes> steps;
    body::StepReport first, last;
};

// Every run makes the same steps, so what a step takes longer in one of them is due to the machine.
void run_stalls_once(const StallCase& c, const ParallelPointer& parallel, StallRuns& runs) {
    const WorldPointer world = c.make(parallel);
    runs.steps.resize(static_cast<std::size_t>(c.steps));
    for (std::size_t k = 0; k < runs.steps.size(); ++k) {
        StepTimes& times = runs.steps[k];
        const std::clock_t before = std::clock();
        const body::StepReport report = world->step();
        const double processor = 1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
        times.processor = std::min(times.processor, processor);
        times.cuts = report.counts.new_cut_edges > 0;
        const double whole = 1e3 * report.total_seconds();
        if (whole < times.whole) {
            times.whole = whole;
            for (std::size_t s = 0; s < body::stage_count; ++s) times.stages[s] = 1e3 * report.seconds[s];
        }
        if (k == 0) runs.first = report;
        runs.last = report;
    }
}

double median_of_steps(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

Json time_stalls(const StallCase& c, int runs, const ParallelPointer& parallel) {
    StallRuns made;
    for (int run = 0; run < runs; ++run) run_stalls_once(c, parallel, made);
    // The first step allocates memory and computes what later ones update.
    const std::span<const StepTimes> steps = std::span<const StepTimes>(made.steps).subspan(1);
    std::vector<double> all, cutting;
    std::size_t worst = 0;
    for (std::size_t k = 0; k < steps.size(); ++k) {
        all.push_back(steps[k].whole);
        if (steps[k].cuts) cutting.push_back(steps[k].whole);
        if (steps[k].whole > steps[worst].whole) worst = k;
    }
    const StepTimes& longest = steps[worst];
    const double typical = median_of_steps(all), typical_cut = median_of_steps(cutting),
                 final_step = steps.back().whole;
    std::printf(
        "%s: %zu -> %zu phyxels, %zu -> %zu pieces, %d threads, %d runs, %zu steps of which %zu cut\n",
        c.name, made.first.totals.phyxels, made.last.totals.phyxels, made.first.totals.pieces,
        made.last.totals.pieces, parallel->thread_count(), runs, steps.size(), cutting.size());
    std::printf(
        "median step %.2f ms, median cutting step %.2f ms, last step %.2f ms; longest: step %zu, %.2f ms "
        "(%.2f ms of processor time), %.1f times the median, %.1f times the median cutting step\n",
        typical, typical_cut, final_step, worst + 1, longest.whole, longest.processor,
        longest.whole / typical, longest.whole / typical_cut);
    std::printf("%-24s %10s %16s\n", "stage", "longest ms", "longest step ms");
    Json stages;
    for (std::size_t s = 0; s < body::stage_count; ++s) {
        double longest_stage = 0;
        for (const StepTimes& step : steps) longest_stage = std::max(longest_stage, step.stages[s]);
        std::printf("%-24s %10.3f %16.3f\n", body::stage_names[s], longest_stage, longest.stages[s]);
        stages[body::stage_names[s]] = {{"max_ms", longest_stage}, {"in_longest_step_ms", longest.stages[s]}};
    }
    std::printf("\n");
    std::fflush(stdout);
    return {{"world", c.name},
            {"phyxels", made.first.totals.phyxels},
            {"pieces", made.last.totals.pieces},
            {"steps", steps.size()},
            {"cutting_steps", cutting.size()},
            {"median_ms", typical},
            {"cutting_median_ms", typical_cut},
            {"last_ms", final_step},
            {"longest_step", worst + 1},
            {"longest_ms", longest.whole},
            {"longest_processor_ms", longest.processor},
            {"stages", stages}};
}

}  // namespace

Json bench_stalls(int runs, int threads, const std::string& world) {
    const auto parallel = std::make_shared<const Parallel>(threads);
    Json worlds = Json::array();
    std::string known;
    for (const StallCase& c : stall_cases()) {
        known += (known.empty() ? "" : "; ") + std::string(c.name);
        if (world.empty() || world == c.name) worlds.push_back(time_stalls(c, runs, parallel));
    }
    if (worlds.empty()) throw InputError("--world", "there is no world '" + world + "'", "known: " + known);
    return {{"bench", "stalls"}, {"threads", parallel->thread_count()}, {"runs", runs}, {"worlds", worlds}};
}

}  // namespace splitcubes::app
