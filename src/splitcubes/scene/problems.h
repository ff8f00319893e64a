// All problems of one text, found by readers that continue after each problem. Internal to scene.
#pragma once

#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_path.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

/// One line of a message: `location: problem; remedy`.
struct Problem {
    std::string location;  // file:line, or the option that gave the value
    int line = 0;          // of the file; 0: of an option
    std::string problem, remedy;
    JsonPath path;  // of the value; for a missing key: where it would be
    /// For an unknown key without a similar known one: the missing key that it may be intended as.
    JsonPath meant_for = {};
    bool unexplained = false;  // unknown key without a similar known one, not yet matched to a missing one
    std::string kind = {};     // groups similar problems: a few are shown, the rest counted
    bool unplaced = false;     // its line was not determined; only counted
};

class Problems {
  public:
    /// Reading stops after `max_held` problems, or after `max_placed` whose line was determined, which
    /// bounds the time for hostile texts.
    static constexpr std::size_t max_held = 1000, max_placed = 100;
    /// Problems shown, sorted by line with those of options last; the rest are counted. Kinds take turns, so
    /// that one kind does not hide the others.
    static constexpr std::size_t max_shown = 20;

    bool full() const { return held_.size() >= max_held || placed_count_ >= max_placed; }
    /// Returns whether the line of one more problem of the kind is needed.
    bool wants_location(const std::string& kind) const;
    Problem* add(Problem problem);
    /// Adds the problem of an option that could not be applied.
    void add_option(const InputError& error);
    bool empty() const { return held_.empty() && options_.empty(); }

    /// Returns the problem of the value at exactly this path, or null.
    Problem* at(const JsonPath& path);
    /// Returns whether a problem concerns the value at the path or one inside it.
    bool within(const JsonPath& path) const;

    /// Throws InputErrors with a line per problem, if there are any; name: of the file.
    void raise(const std::string& name) const;

  private:
    std::vector<Problem> held_;
    std::map<std::string, std::size_t> kind_counts_;
    std::size_t placed_count_ = 0;
    std::vector<InputError> options_;
};

}  // namespace splitcubes::scene
