#include <splitcubes/core/input_errors.h>
#include <splitcubes/scene/problems.h>

#include <algorithm>

namespace splitcubes::scene {

void Problems::add_option(const InputError& error) {
    options_.push_back(error);
}

Problem* Problems::at(const JsonPath& path) {
    const auto found = std::find_if(held_.begin(), held_.end(), [&](const Problem& p) {
        return p.path == path || (!p.meant_for.empty() && p.meant_for == path);
    });
    return found == held_.end() ? nullptr : &*found;
}

bool Problems::within(const JsonPath& path) const {
    return std::any_of(held_.begin(), held_.end(), [&](const Problem& p) {
        return is_within(p.path, path) || (!p.meant_for.empty() && is_within(p.meant_for, path));
    });
}

namespace {

// Returns how many problems of each kind are shown: kinds take turns.
std::map<std::string, std::size_t> shares_of(const std::vector<const Problem*>& sorted,
                                             std::size_t remaining) {
    std::map<std::string, std::size_t> counts, out;
    std::vector<std::string> order;
    for (const Problem* p : sorted)
        if (counts[p->kind]++ == 0) order.push_back(p->kind);
    for (bool more = true; more && remaining > 0;) {
        more = false;
        for (const std::string& kind : order) {
            if (remaining == 0 || out[kind] == counts[kind]) continue;
            ++out[kind];
            --remaining;
            more = true;
        }
    }
    return out;
}

}  // namespace

bool Problems::wants_location(const std::string& kind) const {
    const auto found = kind_counts_.find(kind);
    return found == kind_counts_.end() || found->second < max_shown;
}

Problem* Problems::add(Problem problem) {
    ++kind_counts_[problem.kind];
    placed_count_ += !problem.unplaced;
    held_.push_back(std::move(problem));
    return &held_.back();
}

void Problems::raise(const std::string& name) const {
    if (empty()) return;
    std::vector<const Problem*> sorted;
    for (const Problem& problem : held_)
        if (!problem.unplaced) sorted.push_back(&problem);
    // Problems of options, which have no line, come last.
    std::stable_sort(sorted.begin(), sorted.end(), [](const Problem* a, const Problem* b) {
        return a->line != b->line && a->line != 0 && (b->line == 0 || a->line < b->line);
    });
    const std::size_t shown_options = std::min(options_.size(), max_shown / 2);
    const std::map<std::string, std::size_t> shares = shares_of(sorted, max_shown - shown_options);
    std::map<std::string, std::size_t> shown_counts;
    std::vector<InputError> lines;
    for (const Problem* p : sorted) {
        const auto share = shares.find(p->kind);
        if (share == shares.end() || shown_counts[p->kind] == share->second) continue;
        const std::size_t rest = kind_counts_.at(p->kind) - share->second;
        const bool is_last = ++shown_counts[p->kind] == share->second;
        const std::string more =
            is_last && rest > 0 ? " (and " + std::to_string(rest) + " more like it)" : "";
        lines.emplace_back(p->location, p->problem + more, p->remedy);
    }
    for (std::size_t k = 0; k < options_.size() && lines.size() < max_shown; ++k)
        lines.push_back(options_[k]);
    const std::size_t all = held_.size() + options_.size();
    if (all > lines.size())
        lines.emplace_back(
            name, "and " + std::to_string(all - lines.size()) + (full() ? " more, at least" : " more"));
    throw InputErrors(lines);
}

}  // namespace splitcubes::scene
