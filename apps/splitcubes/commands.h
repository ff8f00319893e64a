// Commands of the program. Each adds itself to the command line.
#pragma once

namespace splitcubes::app {

class CommandLine;

void add_surface_command(CommandLine& line);
void add_cut_command(CommandLine& line);
void add_run_command(CommandLine& line);
void add_replay_command(CommandLine& line);
void add_render_command(CommandLine& line);
void add_view_command(CommandLine& line);
void add_validate_command(CommandLine& line);
void add_bench_command(CommandLine& line);
void add_figure_command(CommandLine& line);
void add_info_command(CommandLine& line);
/// Adds help, man and completion, which list all commands; to be called last.
void add_help_commands(CommandLine& line);

}  // namespace splitcubes::app
