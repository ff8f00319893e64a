// splitcubes: cuts, tears and breaks soft solids. Exit codes: 0 done, 1 failed
// (or interrupted), 2 bad input or usage.
#include "commands.h"
#include "interrupts.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/monitor.h>

#include <exception>
#include <iostream>
#include <new>
#include <string>

namespace {

// Each line of what is wrong with a file says who found it.
std::string prefixed(const std::string& lines) {
    std::string out;
    for (const char c : lines) {
        out += c;
        if (c == '\n') out += "splitcubes: ";
    }
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    splitcubes::app::watch_interrupts();
    CLI::App app("Cuts, tears and breaks soft solids in real time.", "splitcubes");
    app.require_subcommand(1);
    app.set_version_flag("--version", SPLITCUBES_VERSION);
    splitcubes::app::Run run;
    splitcubes::app::add_surface_command(app, run);
    splitcubes::app::add_cut_command(app, run);
    splitcubes::app::add_run_command(app, run);
    splitcubes::app::add_replay_command(app, run);
    splitcubes::app::add_render_command(app, run);
    splitcubes::app::add_validate_command(app, run);
    splitcubes::app::add_bench_command(app, run);
    splitcubes::app::add_figure_command(app, run);
    splitcubes::app::add_info_command(app, run);
    try {
        const auto is_named = [&](const CLI::App* command) { return command->check_name(argv[1]); };
        if (argc > 1 && argv[1][0] != '-' && app.get_subcommands(is_named).empty())
            throw splitcubes::InputError(argv[1], "is no command", "see splitcubes --help");
        app.parse(argc, argv);
        return run();
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);  // help, version
        std::cerr << "splitcubes: " << splitcubes::printable(error.what(), 500)
                  << "; see splitcubes --help\n";
        return 2;
    } catch (const splitcubes::Cancelled&) {
        return splitcubes::app::end_interrupted();
    } catch (const splitcubes::InputError& error) {
        std::cerr << "splitcubes: " << prefixed(error.what()) << '\n';
        return 2;
    } catch (const std::bad_alloc&) {
        std::cerr << "splitcubes: out of memory; use fewer cells or phyxels\n";
        return 1;
    } catch (const std::exception& error) {
        std::cerr << "splitcubes: " << splitcubes::printable(error.what(), 500) << '\n';
        return 1;
    }
}
