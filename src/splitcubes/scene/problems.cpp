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

void Problems::raise(const std::string& name) const {
    if (empty()) return;
    std::vector<const Problem*> sorted;
    for (const Problem& problem : held_) sorted.push_back(&problem);
    // Those of options, which stand on no line, come last.
    std::stable_sort(sorted.begin(), sorted.end(), [](const Problem* a, const Problem* b) {
        return a->line != b->line && a->line != 0 && (b->line == 0 || a->line < b->line);
    });
    std::vector<InputError> lines;
    for (const Problem* p : sorted) lines.emplace_back(p->place, p->problem, p->remedy);
    lines.insert(lines.end(), options_.begin(), options_.end());
    if (lines.size() > told_most) {
        const std::size_t rest = lines.size() - told_most;
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(told_most), lines.end());
        lines.emplace_back(name, "and " + std::to_string(rest) + (full() ? " more, at least" : " more"));
    }
    throw InputErrors(lines);
}

}  // namespace splitcubes::scene
