// Texts of --help and of the man page.
#include "command_line.h"

#include <algorithm>

namespace splitcubes::app {

namespace {

constexpr std::size_t line_width = 100, text_column = 26;

// Returns "-o, --output FILE".
std::string heading(const Argument& argument) {
    if (argument.positional()) return argument.value + (argument.is_list ? "..." : "");
    std::string out;
    for (const std::string& name : argument.names) out += (out.empty() ? "" : ", ") + name;
    if (argument.flag()) return out;
    const std::string value = argument.value + (argument.is_list ? "..." : "");
    return out + (argument.otherwise.empty() ? " " + value : " [" + value + "]");
}

std::string description(const Argument& argument) {
    std::string out = argument.text;
    if (argument.is_required && !argument.positional()) out += " (required)";
    if (argument.is_repeatable && !argument.positional()) out += "; may be given again";
    return out;
}

// Breaks text at blanks and indents all lines but the first by `indent` blanks. A text with line breaks keeps
// them.
std::string wrapped(const std::string& text, std::size_t column, std::size_t indent) {
    std::string out;
    for (std::size_t at = 0; at < text.size();) {
        if (text[at] == '\n' || text[at] == ' ') {
            if (text[at] == '\n') {
                out += '\n' + std::string(text[at + 1] == '\n' ? 0 : indent, ' ');
                column = indent;
            }
            ++at;
            continue;
        }
        const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
        const std::string word = text.substr(at, end - at);
        if (column > indent && column + 1 + word.size() > line_width) {
            out += '\n' + std::string(indent, ' ');
            column = indent;
        }
        if (column > indent) {
            out += ' ';
            ++column;
        }
        out += word;
        column += word.size();
        at = end;
    }
    return out + '\n';
}

std::string entry(const std::string& head, const std::string& text) {
    std::string out = "  " + head;
    if (out.size() + 2 > text_column) {
        out += '\n' + std::string(text_column, ' ');
    } else {
        out.resize(text_column, ' ');
    }
    return out + wrapped(text, text_column, text_column);
}

std::string options_text(const Command& command) {
    std::string positionals, options;
    for (const Argument& argument : command.arguments)
        (argument.positional() ? positionals : options) += entry(heading(argument), description(argument));
    options += entry("-h, --help", "Prints this");
    options += entry("--version", "Prints the version");
    return positionals + "\nOptions:\n" + options;
}

// Escapes for roff: no line begins with a control character, dashes of options stay dashes.
std::string roff(const std::string& text) {
    std::string out;
    for (std::size_t k = 0; k < text.size(); ++k) {
        const bool line_start = k == 0 || text[k - 1] == '\n';
        if (line_start && (text[k] == '.' || text[k] == '\'')) out += "\\&";
        if (text[k] == '\\')
            out += "\\e";
        else if (text[k] == '-')
            out += "\\-";
        else
            out += text[k];
    }
    return out;
}

std::string paragraphs(const std::string& text) {
    std::string out = roff(text);
    for (std::size_t at = out.find("\n\n"); at != std::string::npos; at = out.find("\n\n", at))
        out.replace(at, 2, "\n.PP\n");
    return out;
}

std::string man_of(const Command& command) {
    std::string out = ".SS " + roff(command.name) + "\n";
    out += roff(command.text) + ".\n.PP\n.B " + roff(usage_text(command)) + "\n";
    for (const Argument& argument : command.arguments)
        out += ".TP\n.B " + roff(heading(argument)) + "\n" + roff(description(argument)) + ".\n";
    if (!command.details.empty()) out += ".PP\n" + paragraphs(command.details) + "\n";
    return out;
}

}  // namespace

std::string usage_text(const Command& command) {
    std::string out = "splitcubes " + command.name;
    for (const Argument& argument : command.arguments)
        if (argument.positional())
            out += argument.is_required ? " " + heading(argument) : " [" + heading(argument) + "]";
    bool more = false;
    for (const Argument& argument : command.arguments) {
        if (argument.positional()) continue;
        if (argument.is_required)
            out += " " + argument.names.front() + " " + argument.value;
        else
            more = true;
    }
    return more ? out + " [OPTION...]" : out;
}

std::string help_text(const Command& command) {
    std::string out = "Usage: " + usage_text(command) + "\n\n" + wrapped(command.text + ".", 0, 0) + "\n" +
                      options_text(command);
    if (!command.details.empty()) out += "\n" + wrapped(command.details, 0, 0);
    if (!command.examples.empty()) out += "\nExamples:\n";
    for (const Command::Example& example : command.examples) {
        if (!example.does.empty()) out += "  # " + example.does + "\n";
        out += "  " + example.line + "\n";
    }
    return out;
}

std::string help_text(const CommandLine& line) {
    std::string out =
        "Usage: splitcubes COMMAND [ARGUMENT...]\n\n" + wrapped(line.text, 0, 0) + "\nCommands:\n";
    for (const Command& command : line.commands) out += entry(command.name, command.text);
    out += "\nOptions:\n" + entry("-h, --help", "Prints this; after a command, its options") +
           entry("--version", "Prints the version");
    out +=
        "\n" + wrapped(
                   "'splitcubes COMMAND --help' or 'splitcubes help COMMAND' lists the options of a command. "
                   "Exit codes: 0 done, 1 failed or interrupted, 2 bad input or usage.",
                   0, 0);
    return out;
}

std::string man_page(const CommandLine& line) {
    std::string out = ".TH SPLITCUBES 1 \"\" \"splitcubes " + line.version +
                      "\" \"User Commands\"\n"
                      ".SH NAME\nsplitcubes \\- cuts, tears and breaks soft solids\n"
                      ".SH SYNOPSIS\n.B splitcubes\n.I COMMAND\n.RI [ ARGUMENT ...]\n"
                      ".SH DESCRIPTION\n" +
                      roff(line.text) + "\n.SH COMMANDS\n";
    for (const Command& command : line.commands) out += man_of(command);
    out +=
        ".SH OPTIONS\nOf every command:\n"
        ".TP\n.B \\-h, \\-\\-help\nPrints what the command does and its options.\n"
        ".TP\n.B \\-\\-version\nPrints the version.\n"
        ".SH EXIT STATUS\n.TP\n0\nDone.\n.TP\n1\nFailed or interrupted; files are complete or absent.\n"
        ".TP\n2\nBad input or usage; one line on standard error says where, what and what to do.\n"
        ".SH EXAMPLES\n";
    for (const Command& command : line.commands)
        for (const Command::Example& example : command.examples)
            out += ".TP\n.B " + roff(example.line) + "\n" +
                   roff((example.does.empty() ? command.text : example.does) + ".") + "\n";
    return out;
}

}  // namespace splitcubes::app
