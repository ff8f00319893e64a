// States to go back and forward to, within budgets of memory and disk.
#pragma once

#include <splitcubes/api/internal/session.h>
#include <splitcubes/api/settings.h>

#include <cstddef>
#include <deque>
#include <filesystem>
#include <optional>

namespace splitcubes::api {

/// The bytes of a state lie in memory or, beyond the budget, in a file of the folder; the oldest go first.
/// The names of the things of a state stay in memory: they are small and shared.
class History {
  public:
    /// Throws InputError for a folder that is not there.
    explicit History(const HistorySettings& settings);
    ~History();
    History(const History&) = delete;
    History& operator=(const History&) = delete;

    bool is_automatic() const { return settings_.automatic; }
    /// Keeps a state to go back to, and forgets those to go forward to.
    void mark(Snapshot now);
    /// The state to go back or forward to; none: there is none. It stays until the step is taken.
    std::optional<Snapshot> peek(bool back) const;
    /// The session went to what peek gave; `now` is what it was before.
    void moved(bool back, Snapshot now);
    void clear();
    std::size_t count(bool back) const { return (back ? past_ : future_).size(); }
    std::size_t memory() const;  // bytes
    std::size_t disk() const;    // bytes

  private:
    struct Entry {
        Snapshot snapshot;                // without its state where that is in a file
        std::filesystem::path file = {};  // empty: in memory
        std::size_t file_size = 0;        // bytes
    };
    void fit();
    bool move_to_disk(Entry& entry);
    void drop(std::deque<Entry>& list, bool front);

    HistorySettings settings_;
    std::deque<Entry> past_, future_;  // the next at the back
};

}  // namespace splitcubes::api
