#include "command_line.h"
#include "commands.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/nearest_word.h>

#include <iostream>
#include <memory>

namespace splitcubes::app {

void add_help_commands(CommandLine& line) {
    const auto topic = std::make_shared<std::string>(), shell = std::make_shared<std::string>();
    Command& man = line.add("man", "Prints the man page of the program, for man(1)");
    man.run = [&line] {
        std::cout << man_page(line);
        return 0;
    };
    man.example("splitcubes man | man -l -", "Reads the man page");

    Command& completion =
        line.add("completion", "Prints a script that completes commands and options in a shell");
    completion.add_choice("SHELL", "", *shell, {"bash", "zsh", "fish"}, "bash, zsh or fish").required();
    completion.run = [&line, shell] {
        std::cout << completion_script(line, *shell);
        return 0;
    };
    completion.example("source <(splitcubes completion bash)", "Completes in this bash from now on");

    Command& help = line.add("help", "Prints what a command does and its options");
    help.example("splitcubes help cut");
    std::vector<std::string> topics = line.command_names();
    help.add_text("COMMAND", "", *topic, "A command; without it, all commands").completes(words(topics));
    help.run = [&line, topic] {
        const Command* command = line.find(*topic);
        if (command == nullptr && !topic->empty()) {
            const std::string near = nearest_word(*topic, line.command_names());
            throw InputError(*topic, "is not a command",
                             (near.empty() ? "" : "did you mean " + near + "? ") + "see splitcubes --help");
        }
        std::cout << (command == nullptr ? help_text(line) : help_text(*command));
        return 0;
    };
}

}  // namespace splitcubes::app
