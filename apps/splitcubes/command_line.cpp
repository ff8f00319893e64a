#include "command_line.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/nearest_word.h>

#include <algorithm>
#include <iostream>

namespace splitcubes::app {

namespace {

bool looks_like_option(std::string_view word) {
    return word.size() > 1 && word[0] == '-';
}

bool is_whole_number(std::string_view word) {
    return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

std::string in_quotes(std::string_view word) {
    return "'" + printable(std::string(word)) + "'";
}

// Returns "did you mean --cells? " if a known word is similar, else nothing.
std::string suggestion(std::string_view word, const std::vector<std::string>& known) {
    const std::string near = nearest_word(word, known);
    return near.empty() ? "" : "did you mean " + near + "? ";
}

// A value, in the order of the command line.
struct Given {
    const Argument* argument;
    std::string value;
    int option_index;  // index of the option on the line: values of one list share it
};

class Reader {
  public:
    Reader(const Command& command, const std::vector<std::string>& words_given)
        : command_(command), words_(words_given) {}

    std::vector<Given> read() {
        for (at_ = 0; at_ < words_.size(); ++at_) {
            const std::string& word = words_[at_];
            if (!only_plain_ && word == "--") {
                only_plain_ = true;
                open_list_ = nullptr;
            } else if (!only_plain_ && looks_like_option(word)) {
                read_option(word);
            } else {
                read_plain(word);
            }
        }
        fill_positionals();
        check();
        return std::move(given_);
    }

  private:
    [[noreturn]] void fail(const std::string& where, const std::string& problem,
                           const std::string& remedy = "") const {
        throw InputError(
            where, problem,
            (remedy.empty() ? "" : remedy + "; ") + "see splitcubes " + command_.name + " --help");
    }

    void read_option(const std::string& word) {
        open_list_ = nullptr;
        const std::size_t equals = word.rfind("--", 0) == 0 ? word.find('=') : std::string::npos;
        const std::string name = word.substr(0, equals);
        const Argument* option = command_.find(name);
        bool inline_value = equals != std::string::npos;
        std::string value = inline_value ? word.substr(equals + 1) : "";
        if (option == nullptr && word[1] != '-') {  // -oFILE
            option = command_.find(word.substr(0, 2));
            if (option != nullptr && option->flag()) option = nullptr;
            inline_value = option != nullptr;
            if (inline_value) value = word.substr(2);
        }
        if (option == nullptr) fail_unknown(name);
        ++position_;
        if (option->flag()) {
            if (inline_value) fail(name, "takes no value (" + in_quotes(value) + ")", "leave it out");
        } else if (!inline_value) {
            value = next_value(*option, name);
        }
        given_.push_back({option, value, position_});
        if (option->is_list) open_list_ = option;
    }

    std::string next_value(const Argument& option, const std::string& name) {
        const bool more = at_ + 1 < words_.size();
        if (!option.otherwise.empty())
            return more && is_whole_number(words_[at_ + 1]) ? words_[++at_] : option.otherwise;
        const std::string missing = "needs a value";
        if (!more) fail(name, missing, "write " + name + " " + option.value);
        const std::string& next = words_[at_ + 1];
        if (next.rfind("--", 0) == 0 || command_.find(next) != nullptr)
            fail(name, missing + ", and " + in_quotes(next) + " is an option",
                 "write " + option.name() + "=" + printable(next) + " where it is meant as the value");
        ++at_;
        return next;
    }

    void read_plain(const std::string& word) {
        if (open_list_ != nullptr && (!open_list_->further || open_list_->further(word)))
            given_.push_back({open_list_, word, position_});
        else
            plain_.push_back(word);
    }

    [[noreturn]] void fail_unknown(const std::string& name) const {
        std::vector<std::string> known{"--help", "--version"};
        for (const Argument& argument : command_.arguments)
            known.insert(known.end(), argument.names.begin(), argument.names.end());
        const std::string near = nearest_word(name, known);
        fail(printable(name), "is not an option of 'splitcubes " + command_.name + "'",
             near.empty() ? "" : "did you mean " + near + "?");
    }

    // Assigns positional arguments in order. If the last required one is missing, it is the last value of a
    // list: `--with sheet.obj pear.obj` names a sheet and a mesh, as `cp` takes its last name.
    void fill_positionals() {
        std::size_t next = 0;
        for (const Argument& argument : command_.arguments) {
            if (!argument.positional()) continue;
            if (next == plain_.size() && argument.is_required) take_from_list();
            for (; next < plain_.size(); ++next) {
                if (plain_[next].empty()) fail(argument.name(), "is an empty name", "give one");
                given_.push_back({&argument, plain_[next], 0});
                if (!argument.is_list) {
                    ++next;
                    break;
                }
            }
        }
        if (next < plain_.size())
            fail(printable(plain_[next]), "is one argument too many", "usage: " + usage_text(command_));
    }

    void take_from_list() {
        for (std::size_t k = given_.size(); k-- > 1;) {
            const Given& last = given_[k];
            if (!last.argument->is_list || last.argument->further) continue;
            if (given_[k - 1].option_index != last.option_index) continue;
            plain_.push_back(last.value);
            given_.erase(given_.begin() + static_cast<std::ptrdiff_t>(k));
            return;
        }
    }

    bool is_given(const Argument& argument) const {
        return std::any_of(given_.begin(), given_.end(),
                           [&](const Given& given) { return given.argument == &argument; });
    }

    void check() const {
        for (const Argument& argument : command_.arguments) {
            if (!is_given(argument)) continue;
            for (const Argument& other : command_.arguments)
                if (argument.is_excluded(other) && is_given(other))
                    fail(argument.name(), "cannot stand beside " + other.name(), "give one of the two");
            std::size_t option_count = 0;
            int last = -1;
            for (const Given& given : given_) {
                if (given.argument != &argument) continue;
                option_count += given.option_index != last;
                last = given.option_index;
            }
            if (option_count > 1 && !argument.is_repeatable && !argument.flag())
                fail(argument.name(), "is given " + std::to_string(option_count) + " times", "give it once");
        }
        for (const Argument& argument : command_.arguments)
            if (argument.is_required && !is_given(argument)) {
                const std::string shown =
                    argument.positional() ? argument.value : argument.names.front() + " " + argument.value;
                fail(argument.name(), "is missing", "give " + shown);
            }
    }

    const Command& command_;
    const std::vector<std::string>& words_;
    std::size_t at_ = 0;
    int position_ = 0;
    bool only_plain_ = false;
    const Argument* open_list_ = nullptr;
    std::vector<Given> given_;
    std::vector<std::string> plain_;
};

bool requests(const std::vector<std::string>& words_given, std::string_view short_name,
              std::string_view long_name) {
    for (const std::string& word : words_given) {
        if (word == "--") return false;
        if (word == short_name || word == long_name) return true;
    }
    return false;
}

std::function<int()> print(std::string text) {
    return [text = std::move(text)] {
        std::cout << text;
        return 0;
    };
}

}  // namespace

Completion files(std::vector<std::string> endings) {
    return {Completion::Kind::files, std::move(endings)};
}
Completion folders() {
    return {Completion::Kind::folders, {}};
}
Completion words(std::vector<std::string> list) {
    return {Completion::Kind::words, std::move(list)};
}
Completion meshes_in() {
    return files({"obj", "ply", "stl", "gltf", "glb"});
}
Completion meshes_out() {
    return files({"ply", "obj", "stl", "glb"});
}

Argument::Argument(std::string_view all_names, std::string placeholder, std::string help,
                   std::function<void(const std::string&)> taker)
    : value(std::move(placeholder)), text(std::move(help)), take(std::move(taker)) {
    if (all_names.empty() || all_names[0] != '-') {
        value = all_names;
        return;
    }
    for (std::size_t at = 0; at < all_names.size();) {
        const std::size_t end = std::min(all_names.find(',', at), all_names.size());
        names.emplace_back(all_names.substr(at, end - at));
        at = end + 1;
    }
}

Argument& Argument::required() {
    is_required = true;
    return *this;
}
Argument& Argument::repeatable() {
    is_repeatable = true;
    return *this;
}
Argument& Argument::list(std::function<bool(std::string_view)> which) {
    is_list = is_repeatable = true;
    further = std::move(which);
    return *this;
}
Argument& Argument::optional_number(std::string stands_for_it) {
    otherwise = std::move(stands_for_it);
    return *this;
}
Argument& Argument::excludes(std::string_view other) {
    excluded.emplace_back(other);
    return *this;
}
Argument& Argument::completes(Completion what) {
    completion = std::move(what);
    return *this;
}
bool Argument::is_excluded(const Argument& other) const {
    return std::find(excluded.begin(), excluded.end(), other.name()) != excluded.end();
}
bool Argument::has_name(std::string_view wanted) const {
    return std::find(names.begin(), names.end(), wanted) != names.end();
}

Argument& Command::add(Argument argument) {
    return arguments.emplace_back(std::move(argument));
}

Argument& Command::add_text(std::string_view names, const std::string& value, std::string& target,
                            const std::string& help) {
    return add({names, value, help, [&target](const std::string& word) { target = word; }});
}

Argument& Command::add_path(std::string_view names, const std::string& value, std::filesystem::path& target,
                            const std::string& help) {
    return add({names, value, help, [&target](const std::string& word) { target = word; }});
}

Argument& Command::add_list(std::string_view names, const std::string& value,
                            std::vector<std::string>& target, const std::string& help) {
    return add({names, value, help, [&target](const std::string& word) { target.push_back(word); }}).list();
}

Argument& Command::add_flag(std::string_view names, bool& target, const std::string& help) {
    return add({names, "", help, [&target](const std::string&) { target = true; }});
}

Argument& Command::add_integer(std::string_view names, const std::string& value, int& target,
                               const Range& range, const std::string& help) {
    Argument& argument = add({names, value, help + "; " + range_text(range), {}});
    const std::string where = argument.name();
    argument.take = [&target, range, where](const std::string& word) {
        target = read_integer(word, range, where);
    };
    return argument;
}

Argument& Command::add_number(std::string_view names, const std::string& value, double& target,
                              const Range& range, const std::string& help) {
    Argument& argument = add({names, value, help + "; " + range_text(range), {}});
    const std::string where = argument.name();
    argument.take = [&target, range, where](const std::string& word) {
        target = read_number(word, range, where);
    };
    return argument;
}

Argument& Command::add_choice(std::string_view names, const std::string& value, std::string& target,
                              const std::vector<std::string>& choices, const std::string& help) {
    Argument& argument = add({names, value, help, {}});
    argument.completes(words(choices));
    const std::string where = argument.name();
    argument.take = [&target, choices, where](const std::string& word) {
        if (std::find(choices.begin(), choices.end(), word) == choices.end()) {
            std::string known;
            for (const std::string& choice : choices) known += (known.empty() ? "" : ", ") + choice;
            throw InputError(where, in_quotes(word) + " is not known",
                             suggestion(word, choices) + "give one of: " + known);
        }
        target = word;
    };
    return argument;
}

Argument& Command::add_threads(int& target, const std::string& help) {
    return add_integer("--threads", "N", target, {1, 1024}, help);
}

Command& Command::example(const std::string& line, const std::string& does) {
    examples.push_back({line, does});
    return *this;
}

const Argument* Command::find(std::string_view option) const {
    for (const Argument& argument : arguments)
        if (argument.has_name(option)) return &argument;
    return nullptr;
}

void Command::read(const std::vector<std::string>& words_given) const {
    for (const Given& given : Reader(*this, words_given).read()) {
        try {
            given.argument->take(given.value);
            if (given.value.empty() && !given.argument->flag())
                throw InputError(given.argument->name(), "its value is empty");
        } catch (const InputError& error) {
            const std::string text_of = error.what(), where = given.argument->name();
            const bool placed = text_of.rfind(where + ": ", 0) == 0;
            throw InputError(where, placed ? text_of.substr(where.size() + 2) : text_of,
                             "see splitcubes " + name + " --help");
        }
    }
}

Command& CommandLine::add(const std::string& name, const std::string& command_text) {
    return commands.emplace_back(name, command_text);
}

const Command* CommandLine::find(std::string_view name) const {
    for (const Command& command : commands)
        if (command.name == name) return &command;
    return nullptr;
}

std::vector<std::string> CommandLine::command_names() const {
    std::vector<std::string> out;
    for (const Command& command : commands) out.push_back(command.name);
    return out;
}

std::function<int()> CommandLine::read(const std::vector<std::string>& words_given) const {
    const std::string see = "see splitcubes --help";
    if (words_given.empty()) throw InputError("command line", "no command is given", see);
    const std::string& first = words_given.front();
    const std::string version_text = "splitcubes " + version + "\n";
    if (first == "--help" || first == "-h") return print(help_text(*this));
    if (first == "--version") return print(version_text);
    const Command* command = find(first);
    if (command == nullptr) {
        const std::vector<std::string> known = command_names();
        if (looks_like_option(first))
            throw InputError(printable(first), "is not an option of splitcubes itself",
                             "options of a command come after its name; " + see);
        throw InputError(printable(first), "is not a command", suggestion(first, known) + see);
    }
    const std::vector<std::string> rest(words_given.begin() + 1, words_given.end());
    if (requests(rest, "-h", "--help")) return print(help_text(*command));
    if (requests(rest, "--version", "--version")) return print(version_text);
    command->read(rest);
    return command->run;
}

}  // namespace splitcubes::app
