// Completion scripts for shells.
#include "command_line.h"

#include <splitcubes/core/error.h>

namespace splitcubes::app {

namespace {

std::string joined(const std::vector<std::string>& list, const std::string& between = " ") {
    std::string out;
    for (const std::string& word : list) out += (out.empty() ? "" : between) + word;
    return out;
}

// Quotes text with single quotes for any of the shells.
std::string shell_quoted(const std::string& text, const std::string& quote) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? quote : std::string(1, c);
    return out + "'";
}

std::vector<std::string> option_names(const Command& command) {
    std::vector<std::string> out;
    for (const Argument& argument : command.arguments)
        out.insert(out.end(), argument.names.begin(), argument.names.end());
    out.insert(out.end(), {"-h", "--help", "--version"});
    return out;
}

const Argument* first_positional(const Command& command) {
    for (const Argument& argument : command.arguments)
        if (argument.positional()) return &argument;
    return nullptr;
}

const Argument* last_positional(const Command& command) {
    const Argument* out = nullptr;
    for (const Argument& argument : command.arguments)
        if (argument.positional()) out = &argument;
    return out;
}

// Returns the call that completes a value in bash.
std::string bash_value(const Completion& completion) {
    switch (completion.kind) {
        case Completion::Kind::nothing:
            return "return";
        case Completion::Kind::files:
            return "_splitcubes_files " + joined(completion.words);
        case Completion::Kind::folders:
            return "_splitcubes_folders";
        case Completion::Kind::words:
            return "_splitcubes_words " + shell_quoted(joined(completion.words), "");
    }
    return "return";
}

std::string bash_script(const CommandLine& line) {
    std::string out = R"(# bash completion for splitcubes
_splitcubes_words() {
    mapfile -t COMPREPLY < <(compgen -W "$1" -- "$cur")
}
_splitcubes_folders() {
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -d -- "$cur")
}
# Files with one of the endings, and folders to go into; all files without an ending.
_splitcubes_files() {
    compopt -o filenames 2>/dev/null
    local ending
    if (($# == 0)); then
        mapfile -t COMPREPLY < <(compgen -f -- "$cur")
        return
    fi
    mapfile -t COMPREPLY < <({
        for ending in "$@"; do compgen -f -X "!*.$ending" -- "$cur"; done
        compgen -d -- "$cur"
    } | sort -u)
}
_splitcubes() {
    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
    COMPREPLY=()
    # bash makes three words of --option=value.
    if [[ $cur == = ]]; then
        cur=
    elif [[ $prev == = ]]; then
        prev=${COMP_WORDS[COMP_CWORD-2]}
    fi
    if ((COMP_CWORD == 1)); then
        _splitcubes_words ')" +
                      joined(line.command_names()) + R"( --help --version'
        return
    fi
    case "$command $prev" in
)";
    for (const Command& command : line.commands)
        for (const Argument& argument : command.arguments) {
            if (argument.positional() || argument.flag() || !argument.otherwise.empty()) continue;
            std::vector<std::string> cases;
            for (const std::string& name : argument.names)
                cases.push_back("\"" + command.name + " " + name + "\"");
            out += "        " + joined(cases, "|") + ") " + bash_value(argument.completion) + "; return ;;\n";
        }
    out += "    esac\n    case \"$command\" in\n";
    for (const Command& command : line.commands) {
        const Argument *first = first_positional(command), *plain = last_positional(command);
        out += "        " + command.name + ")\n            if [[ $cur == -* ]]; then\n" +
               "                _splitcubes_words '" + joined(option_names(command)) + "'\n" +
               (first != plain ? "            elif ((COMP_CWORD == 2)); then\n                " +
                                     bash_value(first->completion) + "\n"
                               : "") +
               "            else\n                " +
               (plain != nullptr ? bash_value(plain->completion) : "return") + "\n            fi ;;\n";
    }
    return out + "    esac\n}\ncomplete -F _splitcubes splitcubes\n";
}

std::string zsh_value(const Completion& completion) {
    switch (completion.kind) {
        case Completion::Kind::nothing:
            return "";
        case Completion::Kind::files:
            return completion.words.empty() ? "_files"
                                            : "_files -g \"*.(" + joined(completion.words, "|") + ")\"";
        case Completion::Kind::folders:
            return "_files -/";
        case Completion::Kind::words:
            return "(" + joined(completion.words) + ")";
    }
    return "";
}

// Escapes text inside a specification of _arguments.
std::string zsh_text(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
        out += c;
    }
    return out;
}

std::string zsh_specification(const Argument& argument, const std::string& name) {
    std::string out = argument.is_repeatable ? "*" : "";
    out += name + "[" + zsh_text(argument.text) + "]";
    if (argument.flag()) return out;
    return out + (argument.otherwise.empty() ? ":" : "::") + zsh_text(argument.value) + ":" +
           zsh_value(argument.completion);
}

std::string zsh_script(const CommandLine& line) {
    const std::string quote = "'\\''";
    std::string out = "#compdef splitcubes\n_splitcubes() {\n    local -a commands\n    commands=(\n";
    for (const Command& command : line.commands)
        out += "        " + shell_quoted(command.name + ":" + zsh_text(command.text), quote) + "\n";
    out +=
        "    )\n    if ((CURRENT == 2)); then\n        _describe command commands\n        return\n    fi\n"
        "    local command=$words[2]\n    shift words\n    ((CURRENT--))\n    case $command in\n";
    for (const Command& command : line.commands) {
        out += "        " + command.name + ") _arguments";
        for (const Argument& argument : command.arguments) {
            if (argument.positional()) {
                out += " \\\n            " +
                       shell_quoted((argument.is_list ? "*:" : ":") + zsh_text(argument.value) + ":" +
                                        zsh_value(argument.completion),
                                    quote);
                continue;
            }
            for (const std::string& name : argument.names)
                out += " \\\n            " + shell_quoted(zsh_specification(argument, name), quote);
        }
        out += " \\\n            '--help[Prints the options]' '--version[Prints the version]' ;;\n";
    }
    return out +
           "    esac\n}\nif [[ $funcstack[1] == _splitcubes ]]; then\n    _splitcubes \"$@\"\nelse\n"
           "    compdef _splitcubes splitcubes\nfi\n";
}

std::string fish_value(const Completion& completion, const std::string& quote) {
    switch (completion.kind) {
        case Completion::Kind::nothing:
            return " -x";
        case Completion::Kind::files:
            return " -r -F";
        case Completion::Kind::folders:
            return " -x -a '(__fish_complete_directories)'";
        case Completion::Kind::words:
            return " -x -a " + shell_quoted(joined(completion.words), quote);
    }
    return "";
}

std::string fish_script(const CommandLine& line) {
    const std::string quote = "\\'";
    std::string out = "# fish completion for splitcubes\ncomplete -c splitcubes -f\n";
    for (const Command& command : line.commands) {
        out += "complete -c splitcubes -n __fish_use_subcommand -a " + command.name + " -d " +
               shell_quoted(command.text, quote) + "\n";
        const std::string seen =
            "complete -c splitcubes -n '__fish_seen_subcommand_from " + command.name + "'";
        for (const Argument& argument : command.arguments) {
            if (argument.positional()) {
                const bool files = argument.completion.kind == Completion::Kind::files;
                out += seen + (files ? " -F" : fish_value(argument.completion, quote)) + "\n";
                continue;
            }
            out += seen;
            for (const std::string& name : argument.names)
                out += name.rfind("--", 0) == 0 ? " -l " + name.substr(2) : " -s " + name.substr(1);
            if (!argument.flag() && argument.otherwise.empty()) out += fish_value(argument.completion, quote);
            out += " -d " + shell_quoted(argument.text, quote) + "\n";
        }
    }
    return out +
           "complete -c splitcubes -s h -l help -d 'Prints the options'\n"
           "complete -c splitcubes -l version -d 'Prints the version'\n";
}

}  // namespace

std::string completion_script(const CommandLine& line, const std::string& shell) {
    if (shell == "bash") return bash_script(line);
    if (shell == "zsh") return zsh_script(line);
    if (shell == "fish") return fish_script(line);
    throw InputError(shell, "is not a shell with completion support", "give bash, zsh or fish");
}

}  // namespace splitcubes::app
