// splitcubes: cuts, tears and breaks soft solids. Exit codes: 0 done, 1 failed (or interrupted), 2 bad input
// or usage.
#include "command_line.h"
#include "commands.h"
#include "interrupts.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/monitor.h>

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>
#include <stdexcept>

namespace {

using splitcubes::app::CommandLine;

void add_commands(CommandLine& line) {
    splitcubes::app::add_surface_command(line);
    splitcubes::app::add_cut_command(line);
    splitcubes::app::add_run_command(line);
    splitcubes::app::add_replay_command(line);
    splitcubes::app::add_render_command(line);
    splitcubes::app::add_view_command(line);
    splitcubes::app::add_validate_command(line);
    splitcubes::app::add_bench_command(line);
    splitcubes::app::add_figure_command(line);
    splitcubes::app::add_info_command(line);
    splitcubes::app::add_help_commands(line);
}

int run(const std::vector<std::string>& words) {
    CommandLine line("Cuts, tears and breaks soft solids in real time.", SPLITCUBES_VERSION);
    add_commands(line);
    const int code = line.read(words)();
    if (!std::cout.flush() || std::fflush(stdout) != 0)
        throw splitcubes::JobError("standard output cannot be written (is the disk full?)");
    return code;
}

// Prefixes each line of the message with the program's name.
int fail(int code, const std::string& text) {
    std::cout.flush();
    std::string lines = "splitcubes: ";
    for (const char c : text) {
        lines += c;
        if (c == '\n') lines += "splitcubes: ";
    }
    std::cerr << lines << '\n';
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    splitcubes::app::watch_interrupts();
    try {
        return run({argv + (argc > 0 ? 1 : 0), argv + argc});
    } catch (const splitcubes::Cancelled&) {
        return splitcubes::app::end_interrupted();
    } catch (const splitcubes::InputError& error) {
        return fail(2, error.what());
    } catch (const splitcubes::JobError& error) {
        return fail(1, splitcubes::printable(error.what(), 2000));
    } catch (const std::bad_alloc&) {
        return fail(1, "out of memory; use fewer cells or phyxels");
    } catch (const std::length_error&) {
        return fail(1, "out of memory; use fewer cells or phyxels");
    } catch (const std::filesystem::filesystem_error& error) {
        const std::string path = splitcubes::printable(error.path1().string(), 500);
        return fail(1, path + ": cannot be read or written (" + error.code().message() + ")");
    } catch (const std::exception&) {
        // The texts of library exceptions mean nothing to users; use `catch throw` in a debugger.
        return fail(1, "failed because of a bug in the program; please report the command and its input");
    }
}
