#include <splitcubes/api/internal/history.h>
#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <atomic>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include <unistd.h>

namespace splitcubes::api {

namespace {

std::string read_bytes(const std::filesystem::path& path, std::size_t size) {
    std::ifstream in(path, std::ios::binary);
    std::string out(size, '\0');
    if (!in.read(out.data(), static_cast<std::streamsize>(size)))
        throw JobError(path.string() + ": a state of the history cannot be read back");
    return out;
}

// Another one for each state of this process: simulations may share a folder.
std::filesystem::path new_history_file(const std::filesystem::path& folder) {
    static std::atomic<std::uint64_t> last = 0;
    return folder /
           ("splitcubes-history-" + std::to_string(::getpid()) + "-" + std::to_string(++last) + ".state");
}

}  // namespace

History::History(const HistorySettings& settings) : settings_(settings) {
    std::error_code ignored;
    if (!settings.disk_folder.empty() && !std::filesystem::is_directory(settings.disk_folder, ignored))
        throw InputError("history folder '" + settings.disk_folder + "'", "is no folder", "make it first");
}

History::~History() {
    clear();
}

void History::clear() {
    while (!past_.empty()) drop(past_, true);
    while (!future_.empty()) drop(future_, true);
}

void History::drop(std::deque<Entry>& list, bool front) {
    std::error_code ignored;
    if (const Entry& entry = front ? list.front() : list.back(); !entry.file.empty())
        std::filesystem::remove(entry.file, ignored);
    front ? list.pop_front() : list.pop_back();
}

void History::mark(Snapshot now) {
    past_.push_back({std::move(now)});
    while (!future_.empty()) drop(future_, true);
    fit();
}

std::optional<Snapshot> History::peek(bool back) const {
    const std::deque<Entry>& from = back ? past_ : future_;
    if (from.empty()) return std::nullopt;
    Snapshot out = from.back().snapshot;
    if (!from.back().file.empty()) out.state = read_bytes(from.back().file, from.back().file_size);
    return out;
}

void History::moved(bool back, Snapshot now) {
    (back ? future_ : past_).push_back({std::move(now)});
    drop(back ? past_ : future_, false);
    fit();
}

std::size_t History::memory() const {
    std::size_t sum = 0;
    for (const auto* list : {&past_, &future_})
        for (const Entry& entry : *list) sum += entry.snapshot.state.size();
    return sum;
}

std::size_t History::disk() const {
    std::size_t sum = 0;
    for (const auto* list : {&past_, &future_})
        for (const Entry& entry : *list) sum += entry.file_size;
    return sum;
}

bool History::move_to_disk(Entry& entry) {
    if (settings_.disk_folder.empty() || entry.snapshot.state.size() > settings_.disk_budget) return false;
    const std::filesystem::path file = new_history_file(settings_.disk_folder);
    try {
        write_file(file, entry.snapshot.state);
    } catch (const std::exception&) {
        return false;  // a full disk costs the entry, not the call
    }
    entry.file = file;
    entry.file_size = entry.snapshot.state.size();
    std::string().swap(entry.snapshot.state);
    return true;
}

// Oldest of the past first, then what lies farthest ahead.
void History::fit() {
    const auto oldest_in_memory = [&]() -> std::pair<std::deque<Entry>*, std::size_t> {
        for (auto* list : {&past_, &future_})
            for (std::size_t k = 0; k < list->size(); ++k)
                if ((*list)[k].file.empty()) return {list, k};
        return {nullptr, 0};
    };
    while (memory() > settings_.memory_budget) {
        const auto [list, k] = oldest_in_memory();
        if (move_to_disk((*list)[k])) continue;
        // An entry is of no use without those after it: what is older goes along.
        for (std::size_t gone = 0; gone <= k; ++gone) drop(*list, true);
    }
    while (disk() > settings_.disk_budget) drop(past_.empty() ? future_ : past_, true);
}

}  // namespace splitcubes::api
