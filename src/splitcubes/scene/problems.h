// All that is wrong with one text, found by readers that go on after each problem. Internal to scene.
#pragma once

#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_path.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

/// One line of what is wrong: `place: problem; remedy`.
struct Problem {
    std::string place;  // file:line, or the option that made the value
    int line = 0;       // of the file; 0: an option's
    std::string problem, remedy;
    JsonPath path;  // the value that it is about; of a missing key: where it would stand
    /// Of an unknown key near no known one: the missing one that it may have been meant for.
    JsonPath meant_for = {};
    bool unexplained = false;  // an unknown key that is near no known one and meant for none so far
    std::string kind = {};     // those of one kind are told a few of and counted
    bool unplaced = false;     // one of many: counted alone
};

class Problems {
  public:
    /// Reading ends with the problem after so many, or after so many whose line was looked for, so that a
    /// hostile text costs no more than a faulty one.
    static constexpr std::size_t held_most = 1000, placed_most = 100;
    /// At most so many are told, in the order of their lines, those of options last; then how many there are
    /// besides. Kinds take turns, so that many of one do not hide the others.
    static constexpr std::size_t told_most = 20;

    bool full() const { return held_.size() >= held_most || placed_count_ >= placed_most; }
    /// Whether the line of one more of the kind is needed.
    bool wants_place(const std::string& kind) const;
    Problem* add(Problem problem);
    /// An option that could not be applied.
    void add_option(const InputError& error);
    bool empty() const { return held_.empty() && options_.empty(); }

    /// The problem of the value at exactly this path; null: none.
    Problem* at(const JsonPath& path);
    /// Whether a problem is about the value at the path or about something in it.
    bool within(const JsonPath& path) const;

    /// Throws InputErrors with a line for each where there are any; name: the file's.
    void raise(const std::string& name) const;

  private:
    std::vector<Problem> held_;
    std::map<std::string, std::size_t> kind_counts_;
    std::size_t placed_count_ = 0;
    std::vector<InputError> options_;
};

}  // namespace splitcubes::scene
