#include "command_line.h"
#include "commands.h"
#include "figures/figures.h"
#include "figures/weights.h"
#include "output_targets.h"

#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>

#include <algorithm>
#include <iostream>
#include <memory>

namespace splitcubes::app {

namespace {

struct FigureOptions {
    std::string name, out, csv;
    bool list = false;
};

int list_figures() {
    for (const figures::Figure& figure : figures::all_figures())
        std::cout << figure.name << ": " << figure.shows << '\n';
    std::cout << "weights: weights around a phyxel beside cuts, by criterion (PNG, CSV)\n";
    return 0;
}

int draw_weight_figure(const FigureOptions& options) {
    if (std::filesystem::path(options.out).extension() != ".png")
        throw InputError(options.out.empty() ? "figure weights" : options.out, "no output that ends in .png",
                         "give -o FILE.png");
    check_output_file(options.out);
    check_output_file(options.csv);
    check_distinct({options.out, options.csv});
    figures::draw_weights(options.out);
    std::cout << options.out << ": weights around a phyxel beside cuts, by criterion\n";
    if (options.csv.empty()) return 0;
    figures::write_weights(options.csv);
    std::cout << options.csv << ": the same as numbers\n";
    return 0;
}

int draw_figure(const FigureOptions& options) {
    if (options.list) return list_figures();
    if (options.name == "weights") return draw_weight_figure(options);
    if (!options.csv.empty())
        throw InputError("--csv", "is not for figure '" + options.name + "'", "it goes with: weights");
    if (options.name.empty()) throw InputError("figure", "no name given", "see splitcubes figure --list");
    const auto all = figures::all_figures();
    const auto found = std::find_if(
        all.begin(), all.end(), [&](const figures::Figure& figure) { return figure.name == options.name; });
    if (found == all.end()) throw InputError(options.name, "is not a figure", "see splitcubes figure --list");
    if (std::filesystem::path(options.out).extension() != ".svg")
        throw InputError(options.out.empty() ? "figure " + options.name : options.out,
                         "no output that ends in .svg", "give -o FILE.svg");
    check_output_file(options.out);
    io::write_file(options.out, found->draw().document());
    std::cout << options.out << ": " << found->shows << '\n';
    return 0;
}

}  // namespace

void add_figure_command(CommandLine& line) {
    const auto options = std::make_shared<FigureOptions>();
    Command& command = line.add("figure", "Draws a figure of the algorithm as SVG");
    std::vector<std::string> names{"weights"};
    for (const figures::Figure& figure : figures::all_figures()) names.push_back(figure.name);
    command.add_text("NAME", "", options->name, "Which figure; --list names them").completes(words(names));
    command.add_text("-o,--output", "FILE", options->out, "Drawing out: .svg, of weights .png")
        .completes(files({"svg", "png"}));
    command.add_text("--csv", "FILE", options->csv, "Of weights: the numbers, too").completes(files({"csv"}));
    command.add_flag("--list", options->list, "Lists the figures")
        .excludes("NAME")
        .excludes("--output")
        .excludes("--csv");
    command.example("splitcubes figure faces -o faces.svg");
    command.run = [options] { return draw_figure(*options); };
}

}  // namespace splitcubes::app
