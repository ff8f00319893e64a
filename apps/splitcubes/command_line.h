// Commands and options of the program as data, from which parsing, help texts, the man page and shell
// completion are derived.
#pragma once

#include "option_values.h"

#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::app {

/// Completions that a shell offers for a value.
struct Completion {
    enum class Kind { nothing, files, folders, words };
    Kind kind = Kind::nothing;
    std::vector<std::string> words;  // choices, or extensions without the dot; empty: any file
};
Completion files(std::vector<std::string> endings = {});
Completion folders();
Completion words(std::vector<std::string> list);
/// Mesh files that can be read or written.
Completion meshes_in();
Completion meshes_out();

/// An option or a positional argument.
class Argument {
  public:
    /// names: "-o,--output" of an option, "MESH" of a positional. value: placeholder; empty: a flag.
    Argument(std::string_view names, std::string value, std::string text,
             std::function<void(const std::string&)> take);

    Argument& required();
    /// Allows the option several times; values are kept in the order of the command line.
    Argument& repeatable();
    /// Takes one or more values. `further`: returns which words after the first belong to it; default: all.
    Argument& list(std::function<bool(std::string_view)> further = {});
    /// Makes the value optional with the default `otherwise`. Only whole numbers are taken as its value.
    Argument& optional_number(std::string otherwise);
    /// other: its long name, or the placeholder of a positional.
    Argument& excludes(std::string_view other);
    Argument& completes(Completion completion);

    bool positional() const { return names.empty(); }
    bool flag() const { return value.empty(); }
    /// Returns the long name, or the placeholder of a positional.
    const std::string& name() const { return positional() ? value : names.back(); }
    bool has_name(std::string_view wanted) const;
    bool is_excluded(const Argument& other) const;

    std::vector<std::string> names;  // short before long
    std::string value, text;
    std::function<void(const std::string&)> take;  // throws InputError for invalid values
    std::function<bool(std::string_view)> further;
    std::string otherwise;
    std::vector<std::string> excluded;
    Completion completion;
    bool is_required = false, is_repeatable = false, is_list = false;
};

class Command {
  public:
    Command(std::string command_name, std::string command_text)
        : name(std::move(command_name)), text(std::move(command_text)) {}

    // The target must outlive the command; help texts include ranges and choices automatically.
    Argument& add_text(std::string_view names, const std::string& value, std::string& target,
                       const std::string& help);
    Argument& add_path(std::string_view names, const std::string& value, std::filesystem::path& target,
                       const std::string& help);
    Argument& add_list(std::string_view names, const std::string& value, std::vector<std::string>& target,
                       const std::string& help);
    Argument& add_flag(std::string_view names, bool& target, const std::string& help);
    Argument& add_integer(std::string_view names, const std::string& value, int& target, const Range& range,
                          const std::string& help);
    Argument& add_number(std::string_view names, const std::string& value, double& target, const Range& range,
                         const std::string& help);
    Argument& add_choice(std::string_view names, const std::string& value, std::string& target,
                         const std::vector<std::string>& choices, const std::string& help);
    Argument& add(Argument argument);
    /// Adds --threads, which all commands have.
    Argument& add_threads(int& target, const std::string& help = "Threads (all)");
    /// Adds an example line with a description.
    Command& example(const std::string& line, const std::string& does = "");

    /// Assigns the words to the arguments. Throws InputError; the message names --help.
    void read(const std::vector<std::string>& words_given) const;

    /// Returns null if there is no option of that name.
    const Argument* find(std::string_view option) const;

    struct Example {
        std::string line, does;
    };

    std::string name, text;
    std::string details;             // paragraphs for --help, after the options
    std::deque<Argument> arguments;  // positionals in order, and options
    std::vector<Example> examples;
    std::function<int()> run;
};

class CommandLine {
  public:
    CommandLine(std::string program_text, std::string program_version)
        : text(std::move(program_text)), version(std::move(program_version)) {}

    Command& add(const std::string& name, const std::string& command_text);
    /// Parses the words after the program's name and returns the action. Throws InputError.
    std::function<int()> read(const std::vector<std::string>& words_given) const;

    const Command* find(std::string_view name) const;
    std::vector<std::string> command_names() const;

    std::string text, version;
    std::deque<Command> commands;
};

/// Returns the text of --help for the program or a command.
std::string help_text(const CommandLine& line);
std::string help_text(const Command& command);
/// Returns "splitcubes surface MESH -o FILE [OPTION...]".
std::string usage_text(const Command& command);
/// Returns a page for man(1), in the macros of man(7).
std::string man_page(const CommandLine& line);
/// Returns a script for bash, zsh or fish. Throws InputError for another shell.
std::string completion_script(const CommandLine& line, const std::string& shell);

}  // namespace splitcubes::app
