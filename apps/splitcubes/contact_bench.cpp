#include "contact_bench.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/checkpoint.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <cstdio>
#include <memory>

namespace splitcubes::app {

namespace {

constexpr double bench_time_step = 1.0 / 60;
struct ContactCase {
    const char* name;
    double spacing;  // m, between phyxels
    int across;      // phyxels along a side on the ground
    int high;
    double strength;  // Pa, tensile strength
    int steps;        // the body settles during the first ones
    int warm;
    int compare_every;  // steps between two comparisons with a world without contacts
};

constexpr double small_spacing = 0.02, large_spacing = 0.05;  // m
// Standing bodies settle for two seconds; tearing ones tear from the start.
constexpr ContactCase contact_cases[] = {
    {"near its strength", small_spacing, 10, 8, 0.12, 180, 120, 5},
    {"tearing", small_spacing, 10, 8, 0.05, 80, 20, 5},
    {"large, near its strength", large_spacing, 31, 31, 0.12, 150, 120, 4},
    {"large, tearing", large_spacing, 31, 31, 0.05, 36, 6, 12}};
constexpr const ContactCase& large_tearing = contact_cases[3];

// Builds a block on the ground, compressed at the bottom by its weight with bulging sides; a blade cuts it in
// the middle, and the halves stand next to each other.
std::unique_ptr<body::World> make_contact_world(const ContactCase& c,
                                                const std::shared_ptr<const Parallel>& parallel,
                                                bool contact) {
    const double side = c.across * c.spacing, height = c.high * c.spacing;
    body::WorldSettings settings;
    settings.time_step = bench_time_step;
    settings.contact.pieces = contact;
    if (contact) settings.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.5 * height, 0.6};
    auto world = std::make_unique<body::World>(settings, parallel);
    body::BodySettings block;
    block.name = "block";
    block.cell_size = 0.5 * c.spacing;
    block.phyxel_spacing = c.spacing;
    // The weight compresses the block by a few per cent, whatever its size.
    block.material.youngs_modulus = 15 * block.material.density * 9.81 * height;
    block.material.poisson_ratio = 0.33;
    block.material.stiffness_damping = 0.004;
    block.tearing = body::TearSettings{};
    block.tearing->strength = c.strength * block.material.density * 9.81 * height;
    world->add_body(geometry::make_box({side, side, height}), block);
    const cutting::BladeShape shape = cutting::make_straight_blade({0, -0.7 * side, 0}, {0, 0.7 * side, 0});
    const double from = c.warm * bench_time_step, until = c.steps * bench_time_step;
    world->add_tool(cutting::Blade("blade", shape,
                                   {{from, {0.013 * side, 0, 0.55 * height}, Quat::Identity()},
                                    {until, {0.013 * side, 0, -0.55 * height}, Quat::Identity()}}));
    return world;
}

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

struct Times {
    std::array<std::vector<double>, body::stage_count> stages;  // ms
    std::vector<double> whole, added;                           // ms; of `integrate`, added by contacts
    // ms, of steps in which the blade cuts: whole steps, and the contact and tearing stages.
    std::vector<double> cutting, cutting_contact;
    body::StepReport first, last;
    std::size_t torn = 0, contacts = 0;
};

double ms_of(const body::StepReport& report, body::Stage stage) {
    return 1e3 * report.seconds[static_cast<std::size_t>(stage)];
}

// Measures what contacts add to `integrate`: time difference of the second step from one state in two new
// worlds, one with contacts and one without. The first step allocates memory.
double added_by_contacts(const ContactCase& c, body::World& world,
                         const std::shared_ptr<const Parallel>& parallel) {
    const std::string state = body::encode_checkpoint(world, c.name);
    double ms[2];
    for (const bool contact : {false, true}) {
        const auto world_copy = make_contact_world(c, parallel, contact);
        body::restore_checkpoint(*world_copy, state, c.name, "state");
        world_copy->step();
        ms[contact] = ms_of(world_copy->step(), body::Stage::integrate);
    }
    return std::max(0.0, ms[1] - ms[0]);
}

void run_contact_once(const ContactCase& c, const std::shared_ptr<const Parallel>& parallel, Times& out) {
    const std::unique_ptr<body::World> world = make_contact_world(c, parallel, true);
    for (int k = 0; k < c.steps; ++k) {
        if (k > c.warm && k % c.compare_every == 0)
            out.added.push_back(added_by_contacts(c, *world, parallel));
        const body::StepReport report = world->step();
        if (k == 0) out.first = report;
        out.last = report;
        if (k <= c.warm) continue;
        for (std::size_t s = 0; s < body::stage_count; ++s) out.stages[s].push_back(1e3 * report.seconds[s]);
        out.whole.push_back(1e3 * report.total_seconds());
        out.torn += report.counts.torn_edges;
        out.contacts += report.counts.contacts;
        if (report.counts.new_cut_edges <= report.counts.torn_edges) continue;
        out.cutting.push_back(out.whole.back());
        out.cutting_contact.push_back(ms_of(report, body::Stage::detect_contacts) +
                                      ms_of(report, body::Stage::tear));
    }
}

Json time_contact(const ContactCase& c, int runs, const std::shared_ptr<const Parallel>& parallel) {
    Times times;
    for (int run = 0; run < runs; ++run) run_contact_once(c, parallel, times);
    const auto steps = static_cast<double>(times.whole.size());
    const double whole = median(times.whole), added = median(times.added);
    std::printf("%s: %zu phyxels, %zu -> %zu pieces, %d threads, %.0f steps of which %zu cut\n", c.name,
                times.first.totals.phyxels, times.first.totals.pieces, times.last.totals.pieces,
                parallel->thread_count(), steps, times.cutting.size());
    std::printf("%-24s %10s %8s\n", "stage", "median ms", "share %");
    Json stages;
    for (std::size_t s = 0; s < body::stage_count; ++s) {
        const double ms = median(times.stages[s]);
        std::printf("%-24s %10.3f %8.1f\n", body::stage_names[s], ms, 100 * ms / whole);
        stages[body::stage_names[s]] = {{"median_ms", ms}, {"share", ms / whole}};
    }
    const auto stage = [&](body::Stage which) {
        return median(times.stages[static_cast<std::size_t>(which)]);
    };
    const double contact = stage(body::Stage::detect_contacts) + added;
    const double share = (contact + stage(body::Stage::tear)) / whole;
    std::printf("%-24s %10.3f %8.1f\n", "whole step", whole, 100.0);
    std::printf("%-24s %10.3f %8.1f\n", "of integrate: contacts", added, 100 * added / whole);
    std::printf("a step: %.0f contacts that push, %.2f torn edges\n",
                static_cast<double>(times.contacts) / steps, static_cast<double>(times.torn) / steps);
    const double cutting = median(times.cutting);
    const double cutting_share = cutting > 0 ? (median(times.cutting_contact) + added) / cutting : 0;
    // Uses means: medians describe the commoner kind of step, and medians of parts do not add up.
    const double mean_share =
        (mean(times.stages[static_cast<std::size_t>(body::Stage::detect_contacts)]) +
         mean(times.stages[static_cast<std::size_t>(body::Stage::tear)]) + mean(times.added)) /
        mean(times.whole);
    std::printf(
        "contact and tearing together: %.1f %%; of the time of all steps, %.3f ms each: %.1f %%; of steps "
        "that cut, %.3f ms: %.1f %%\n\n",
        100 * share, mean(times.whole), 100 * mean_share, cutting, 100 * cutting_share);
    std::fflush(stdout);
    return {{"world", c.name},
            {"phyxels", times.first.totals.phyxels},
            {"pieces", times.last.totals.pieces},
            {"steps", times.whole.size()},
            {"contacts_a_step", static_cast<double>(times.contacts) / steps},
            {"torn_edges_a_step", static_cast<double>(times.torn) / steps},
            {"whole_median_ms", whole},
            {"contacts_in_integrate_median_ms", added},
            {"contact_and_tearing_share", share},
            {"whole_mean_ms", mean(times.whole)},
            {"mean_contact_and_tearing_share", mean_share},
            {"cutting_steps", times.cutting.size()},
            {"cutting_median_ms", cutting},
            {"cutting_contact_and_tearing_share", cutting_share},
            {"stages", stages}};
}

}  // namespace

std::unique_ptr<body::World> make_large_tearing_world(const std::shared_ptr<const Parallel>& parallel) {
    return make_contact_world(large_tearing, parallel, true);
}

Json bench_contact(int runs, int threads, const std::string& world) {
    const auto parallel = std::make_shared<const Parallel>(threads);
    Json worlds = Json::array();
    for (const ContactCase& c : contact_cases) {
        if (!world.empty() && world != c.name) continue;
        // One run of a large case has enough steps.
        worlds.push_back(time_contact(c, c.across > 20 ? 1 : runs, parallel));
    }
    if (worlds.empty())
        throw InputError("--world", "there is no world '" + world + "'",
                         "known: near its strength; tearing; large, near its strength; large, tearing");
    return {{"bench", "contact"}, {"threads", parallel->thread_count()}, {"runs", runs}, {"worlds", worlds}};
}

}  // namespace splitcubes::app
