// The commands of the program. Each adds itself to the command line and leaves
// in `run` what to do when it is chosen; run returns the exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace splitcubes::app {

using Run = std::function<int()>;

void add_surface_command(CLI::App& app, Run& run);
void add_cut_command(CLI::App& app, Run& run);
void add_run_command(CLI::App& app, Run& run);
void add_replay_command(CLI::App& app, Run& run);
void add_render_command(CLI::App& app, Run& run);
void add_validate_command(CLI::App& app, Run& run);
void add_bench_command(CLI::App& app, Run& run);
void add_figure_command(CLI::App& app, Run& run);
void add_info_command(CLI::App& app, Run& run);

}  // namespace splitcubes::app
