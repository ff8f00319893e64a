#include "accuracy_bench.h"
#include "command_line.h"
#include "commands.h"
#include "contact_bench.h"
#include "criteria_bench.h"
#include "mechanics_bench.h"
#include "notch_bench.h"
#include "occlusion_bench.h"
#include "output_targets.h"
#include "paper_world.h"
#include "report.h"
#include "stalls_bench.h"
#include "validation.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/io/atomic_file.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <iostream>
#include <memory>
#include <mutex>
#include <span>
#include <thread>

namespace splitcubes::app {

namespace {

struct BenchOptions {
    std::string name, json, plot, world, tetrahedra, document;
    std::vector<std::string> meshes;
    int threads = 0;
    int runs = 5;
};

double quantile(std::vector<double> values, double q) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Sample {
    std::array<std::vector<double>, body::stage_count> stages;  // ms, of steps that cut
    std::vector<double> cutting, idle;                          // ms, whole steps
    std::size_t new_edges = 0, disks = 0, iterations = 0;
    body::StepReport first, last;
};

void run_once(const std::shared_ptr<const Parallel>& parallel, Sample& sample) {
    const std::unique_ptr<body::World> world = make_paper_world(parallel);
    for (int k = 0; k < paper_steps; ++k) {
        const body::StepReport report = world->step();
        if (k == 0) sample.first = report;
        sample.last = report;
        const bool cut = report.counts.new_cut_edges > 0;
        (cut ? sample.cutting : sample.idle).push_back(1e3 * report.total_seconds());
        if (!cut) continue;
        sample.new_edges += report.counts.new_cut_edges;
        sample.disks += report.counts.disks;
        sample.iterations += static_cast<std::size_t>(report.solver.iterations);
        for (std::size_t s = 0; s < body::stage_count; ++s)
            sample.stages[s].push_back(1e3 * report.seconds[s]);
    }
}

int bench_paper(const BenchOptions& options) {
    const auto parallel = std::make_shared<const Parallel>(options.threads);
    Sample sample;
    for (int k = 0; k < options.runs; ++k) run_once(parallel, sample);
    double mean = 0;
    for (const double ms : sample.cutting) mean += ms / static_cast<double>(sample.cutting.size());
    const std::size_t steps = sample.cutting.size();
    std::printf(
        "bench paper: %zu phyxels, %zu links, %zu surface cells, %zu -> %zu triangles, %d threads, %d runs\n",
        sample.first.totals.phyxels, sample.first.totals.pairs, sample.first.totals.surface_cells,
        sample.first.totals.triangles, sample.last.totals.triangles, parallel->thread_count(), options.runs);
    std::printf("%-24s %10s %10s\n", "stage, steps that cut", "median ms", "p95 ms");
    Json stages;
    for (std::size_t s = 0; s < body::stage_count; ++s) {
        const double median = quantile(sample.stages[s], 0.5), high = quantile(sample.stages[s], 0.95);
        std::printf("%-24s %10.3f %10.3f\n", body::stage_names[s], median, high);
        stages[body::stage_names[s]] = {{"median_ms", median}, {"p95_ms", high}};
    }
    const double median = quantile(sample.cutting, 0.5);
    std::printf("%-24s %10.3f %10.3f\n", "whole step", median, quantile(sample.cutting, 0.95));
    std::printf("%zu steps that cut: mean %.3f ms, longest %.3f ms: %.0f steps a second\n", steps, mean,
                quantile(sample.cutting, 1), 1e3 / mean);
    std::printf("steps that do not cut: median %.3f ms: %.0f steps a second\n", quantile(sample.idle, 0.5),
                1e3 / quantile(sample.idle, 0.5));
    std::printf("a cutting step: %.1f new cut edges, %.0f disks, %.1f solver iterations\n",
                static_cast<double>(sample.new_edges) / static_cast<double>(steps),
                static_cast<double>(sample.disks) / static_cast<double>(steps),
                static_cast<double>(sample.iterations) / static_cast<double>(steps));
    Json json = {
        {"bench", "paper"},
        {"threads", parallel->thread_count()},
        {"runs", options.runs},
        {"phyxels", sample.first.totals.phyxels},
        {"surface_cells", sample.first.totals.surface_cells},
        {"triangles_first", sample.first.totals.triangles},
        {"triangles_last", sample.last.totals.triangles},
        {"cutting",
         {{"steps", steps},
          {"median_ms", median},
          {"mean_ms", mean},
          {"max_ms", quantile(sample.cutting, 1)},
          {"steps_per_second", 1e3 / mean}}},
        {"idle",
         {{"median_ms", quantile(sample.idle, 0.5)}, {"steps_per_second", 1e3 / quantile(sample.idle, 0.5)}}},
        {"stages", stages}};
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    return 0;
}

int bench_criteria(const BenchOptions& options) {
    const std::vector<CriterionTimes> times = time_criteria(options.runs, options.threads);
    std::printf(
        "| criterion        | median ms | p95 ms | longest ms | pairs a step |\n|---|---|---|---|---|\n");
    Json rows = Json::array();
    for (const CriterionTimes& c : times) {
        const double median = quantile(c.milliseconds, 0.5), high = quantile(c.milliseconds, 0.95);
        const double longest = quantile(c.milliseconds, 1);
        std::printf("| %-16s | %9.3f | %6.3f | %10.3f | %12.0f |\n", c.name.c_str(), median, high, longest,
                    c.pairs);
        rows.push_back({{"criterion", c.name},
                        {"median_ms", median},
                        {"p95_ms", high},
                        {"max_ms", longest},
                        {"pairs_a_step", c.pairs},
                        {"step", c.step},
                        {"ms", c.milliseconds}});
    }
    const Json json = {{"bench", "criteria"}, {"runs", options.runs}, {"criteria", rows}};
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    if (!options.plot.empty()) io::write_file(options.plot, criteria_plot(times));
    return 0;
}

int bench_validation(const BenchOptions& options) {
    const auto parallel = std::make_shared<const Parallel>(options.threads);
    TetrahedraResults tetrahedra;
    if (!options.tetrahedra.empty()) tetrahedra = read_tetrahedra(options.tetrahedra);
    if (!options.document.empty()) with_table(options.document, {{}});  // refuses another document early
    const std::vector<ValidationPoint> points = validate_mechanics(parallel);
    const TableRows table = validation_table(points, tetrahedra);
    Json rows = Json::array();
    for (const ValidationPoint& p : points) {
        rows.push_back({{"test", p.test},
                        {"across", p.across},
                        {"phyxels", p.count},
                        {"free_phyxels", p.free},
                        {"measured", p.measured},
                        {"expected", p.expected},
                        {"unit", p.unit},
                        {"error", p.error()},
                        {"stiffness_seen", p.seen}});
    }
    const Json json = {{"bench", "validation"}, {"points", rows}};
    std::cout << table_text(table, true) << json_text(json) << '\n';
    write_json(options.json, json);
    if (!options.plot.empty()) io::write_file(options.plot, error_plot(points, tetrahedra));
    if (!options.document.empty()) io::write_file(options.document, with_table(options.document, table));
    return 0;
}

// Prints one row per cell of depth: added sag over theory, and in brackets its rise over theory's in the
// whole cell, and the largest in a part of it.
void print_notches(std::span<const NotchDepth> depths) {
    std::printf(
        "added sag over theory (its rise in a cell over theory's; the largest in a part of the cell)\n");
    std::printf("| across | cells deep |");
    for (const char* name : occlusion::criterion_names) std::printf(" %s |", name);
    std::printf("\n|---|---|---|---|---|---|\n");
    constexpr std::size_t parts = notch_depths_per_cell;
    for (std::size_t last = parts - 1; last < depths.size(); last += parts) {
        // No cut comes before the first depth of a bar.
        const auto before_of = [&](std::size_t k) {
            return depths[k].cells > 1.0 / parts ? depths[k - 1] : NotchDepth{};
        };
        const NotchDepth& depth = depths[last];
        const NotchDepth before = before_of(last + 1 - parts);
        std::printf("| %d | %.3f |", depth.across, depth.cells);
        for (std::size_t c = 0; c < depth.sag.size(); ++c) {
            const auto rise = [&](const NotchDepth& from, const NotchDepth& to) {
                return (to.sag[c] - from.sag[c]) / (to.expected - from.expected);
            };
            double largest = 0;
            for (std::size_t k = last + 1 - parts; k <= last; ++k)
                largest = std::max(largest, rise(before_of(k), depths[k]));
            std::printf(" %.2f (%.2f; %.2f) |", depth.sag[c] / depth.expected, rise(before, depth), largest);
        }
        std::printf("\n");
    }
}

int bench_notch(const BenchOptions& options) {
    const std::vector<NotchDepth> depths = measure_notches(std::make_shared<const Parallel>(options.threads));
    print_notches(depths);
    Json rows = Json::array();
    for (const NotchDepth& depth : depths)
        rows.push_back({{"across", depth.across},
                        {"cells", depth.cells},
                        {"expected", depth.expected},
                        {"sag", depth.sag}});
    const Json json = {{"bench", "notch"}, {"criteria", occlusion::criterion_names}, {"depths", rows}};
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    return 0;
}

int bench_surface(const BenchOptions& options) {
    const Json json = bench_accuracy(options.meshes, Parallel(options.threads));
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    return 0;
}

int run_mechanics_bench(const BenchOptions& options) {
    MechanicsBenchSettings settings;
    if (options.threads > 0) settings.threads = {options.threads};
    settings.runs = options.runs;
    const Json json = bench_mechanics(settings);
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    return 0;
}

int bench_contact_and_tearing(const BenchOptions& options) {
    const Json json = bench_contact(options.runs, options.threads, options.world);
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    return 0;
}

int bench_longest_steps(const BenchOptions& options) {
    const Json json = bench_stalls(options.runs, options.threads, options.world);
    std::cout << json_text(json) << '\n';
    write_json(options.json, json);
    return 0;
}

void check_for_bench(const BenchOptions& options) {
    check_report_output(options.json);
    check_output_file(options.plot, {".svg"});
    check_output_file(options.document, {".md"});
    check_distinct({options.json, options.plot, options.tetrahedra, options.document});
    const std::string problem = "is not for benchmark '" + options.name + "'";
    if (!options.meshes.empty() && options.name != "surface")
        throw InputError(options.meshes.front(), problem, "meshes go with: surface");
    if (!options.world.empty() && options.name != "contact" && options.name != "stalls")
        throw InputError("--world", problem, "it goes with: contact, stalls");
    for (const auto& [option, value] :
         {std::pair{"--tetrahedra", options.tetrahedra}, {"--document", options.document}})
        if (!value.empty() && options.name != "validation")
            throw InputError(option, problem, "it goes with: validation");
    if (!options.plot.empty() && options.name != "validation" && options.name != "criteria")
        throw InputError("--plot", problem, "it goes with: validation, criteria");
}

// Reports on standard error which bench runs, within the first second: tables are printed when they are
// complete. A refused command prints its reason only.
class SaysWhatRuns {
  public:
    explicit SaysWhatRuns(std::string line)
        : thread_([line = std::move(line)](const std::stop_token& stop) {
              std::mutex mutex;
              std::unique_lock lock(mutex);
              std::condition_variable_any ended;
              ended.wait_for(lock, stop, std::chrono::milliseconds(500), [] { return false; });
              if (!stop.stop_requested()) std::cerr << line + '\n';
          }) {}

  private:
    std::jthread thread_;
};

std::string what_runs(const BenchOptions& options) {
    const bool repeats = options.name != "surface" && options.name != "validation" && options.name != "notch";
    return "bench " + options.name + ": under way" +
           (repeats ? ", " + std::to_string(options.runs) + (options.runs == 1 ? " run" : " runs") : "");
}

int bench(const BenchOptions& options) {
    check_for_bench(options);
    const SaysWhatRuns says(what_runs(options));
    if (options.name == "surface") return bench_surface(options);
    if (options.name == "paper") return bench_paper(options);
    if (options.name == "occlusion") {
        write_json(options.json, bench_occlusion(options.runs));
        return 0;
    }
    if (options.name == "criteria") return bench_criteria(options);
    if (options.name == "validation") return bench_validation(options);
    if (options.name == "notch") return bench_notch(options);
    if (options.name == "mechanics") return run_mechanics_bench(options);
    if (options.name == "contact") return bench_contact_and_tearing(options);
    if (options.name == "stalls") return bench_longest_steps(options);
    throw InputError(
        "bench", "there is no benchmark '" + options.name + "'",
        "known: contact, criteria, mechanics, notch, occlusion, paper, stalls, surface, validation");
}

}  // namespace

void add_bench_command(CommandLine& line) {
    const auto options = std::make_shared<BenchOptions>();
    Command& command = line.add("bench", "Runs a benchmark; prints a table, then one line of JSON");
    command
        .add_choice(
            "NAME", "", options->name,
            {"contact", "criteria", "mechanics", "notch", "occlusion", "paper", "stalls", "surface",
             "validation"},
            "contact: the cost of contact and tearing within a step; "
            "criteria: the visibility criteria, each timed on one cut; mechanics: the "
            "elastic step and its lower bound; notch: a cut that deepens layer by layer, under each "
            "criterion; occlusion: disks by backend; paper: the published "
            "size, a blade passing; stalls: the longest steps of bodies that fall apart; surface: accuracy "
            "of surfaces; validation: linear elasticity")
        .required();
    command.add_list("MESH", "", options->meshes,
                     "surface only: further meshes to count folded triangles in");
    command
        .add_text("--plot", "FILE", options->plot,
                  "validation and criteria only: SVG plot of the errors or of the times")
        .completes(files({"svg"}));
    command
        .add_text("--tetrahedra", "FILE", options->tetrahedra,
                  "validation only: results of bench_tetrahedra to compare with")
        .completes(files({"json"}));
    command
        .add_text("--document", "FILE", options->document,
                  "validation only: Markdown whose table of validation is replaced")
        .completes(files({"md"}));
    command.add_text("--world", "NAME", options->world,
                     "contact and stalls only: the one world to run (all)");
    command.add_threads(options->threads, "Threads (all; of mechanics: one, then two)");
    command.add_integer("--runs", "N", options->runs, {1, 10000}, "Runs to take medians over (5)");
    command.add_text("--json", "FILE", options->json, "Writes the JSON to a file too").completes(files());
    command.example("splitcubes bench paper");
    command.run = [options] { return bench(*options); };
}

}  // namespace splitcubes::app
