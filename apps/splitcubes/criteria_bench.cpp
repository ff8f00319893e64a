#include "criteria_bench.h"

#include "figures/svg.h"
#include "paper_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

namespace splitcubes::app {

namespace {

constexpr auto stage = static_cast<std::size_t>(body::Stage::update_visibility);

CriterionTimes time_criterion(std::size_t kind, int runs, const std::shared_ptr<const Parallel>& parallel) {
    CriterionTimes out;
    out.name = occlusion::criterion_names[kind];
    std::map<int, std::vector<double>> by_step;  // ms
    std::size_t count = 0;
    for (int run = 0; run < runs; ++run) {
        const auto world = make_paper_world(parallel, static_cast<occlusion::CriterionKind>(kind));
        for (int k = 0; k < paper_steps; ++k) {
            const body::StepReport report = world->step();
            if (report.counts.new_cut_edges == 0) continue;
            by_step[k].push_back(1e3 * report.seconds[stage]);
            out.pairs += static_cast<double>(report.counts.disks);
            ++count;
        }
    }
    out.pairs /= static_cast<double>(std::max<std::size_t>(1, count));
    for (auto& [step, values] : by_step) {
        std::sort(values.begin(), values.end());
        out.step.push_back(step);
        out.milliseconds.push_back(values[values.size() / 2]);
    }
    return out;
}

}  // namespace

std::vector<CriterionTimes> time_criteria(int runs, int threads) {
    const auto parallel = std::make_shared<const Parallel>(threads);
    std::vector<CriterionTimes> out;
    for (std::size_t kind = 0; kind < occlusion::criterion_names.size(); ++kind)
        out.push_back(time_criterion(kind, runs, parallel));
    return out;
}

std::string criteria_plot(const std::vector<CriterionTimes>& times) {
    constexpr double left = 70, top = 30, wide = 480, high = 300;  // of the axes, pixels
    constexpr std::array<const char*, 4> colours = {"#08519c", "#c0392b", "#229954", "#d68910"};
    constexpr int decades = 4;  // from 0.01 ms
    int first = paper_steps, last = 0;
    for (const CriterionTimes& c : times)
        for (const int step : c.step) {
            first = std::min(first, step);
            last = std::max(last, step);
        }
    const auto x_of = [&](int step) { return left + wide * (step - first) / std::max(1, last - first); };
    const auto y_of = [&](double ms) {
        const double decade = std::clamp(std::log10(std::max(ms, 1e-9)) + 2, 0.0, double{decades});
        return top + high * (1 - decade / decades);
    };
    figures::Svg svg(720, 400);
    const figures::Style grid{"none", "#cccccc", 1, 1, ""};
    for (int k = 0; k <= decades; ++k) {
        const double ms = std::pow(10.0, k - 2);
        char words[16];
        std::snprintf(words, sizeof words, "%g ms", ms);
        svg.line({left, y_of(ms)}, {left + wide, y_of(ms)}, grid);
        svg.text({left - 8, y_of(ms)}, words, figures::Anchor::end, 12);
    }
    for (int step = first; step <= last; step += 5) {
        svg.line({x_of(step), top}, {x_of(step), top + high}, grid);
        svg.text({x_of(step), top + high + 14}, std::to_string(step), figures::Anchor::middle, 12);
    }
    svg.text({left + wide / 2, top + high + 36}, "step of the run", figures::Anchor::middle, 12);
    for (std::size_t c = 0; c < times.size(); ++c) {
        const figures::Style style{"none", colours[c % colours.size()], 2, 1, ""};
        std::vector<Vec2> line;
        for (std::size_t k = 0; k < times[c].step.size(); ++k)
            line.emplace_back(x_of(times[c].step[k]), y_of(times[c].milliseconds[k]));
        svg.polyline(line, style);
        const double y = top + 20 + 22 * static_cast<double>(c);
        svg.line({left + wide + 16, y}, {left + wide + 38, y}, style);
        svg.text({left + wide + 46, y}, times[c].name, figures::Anchor::start, 12);
    }
    return svg.document();
}

}  // namespace splitcubes::app
