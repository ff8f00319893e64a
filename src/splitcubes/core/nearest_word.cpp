#include <splitcubes/core/nearest_word.h>

#include <algorithm>

namespace splitcubes {

std::size_t typing_distance(std::string_view a, std::string_view b) {
    // Table rows of the letter before the last one, of the last one and of this one.
    std::vector<std::size_t> older(b.size() + 1), old(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::swap(older, old);
        std::swap(old, row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({old[j] + 1, row[j - 1] + 1, old[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], older[j - 2] + 1);
        }
    }
    return row[b.size()];
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
    constexpr std::size_t longest = 100;  // letters; avoids a long table
    if (word.empty() || word.size() > longest) return "";
    std::string best;
    std::size_t best_distance = std::string::npos;
    for (const std::string& candidate : known) {
        const bool begun = word.size() > 2 && candidate.rfind(word, 0) == 0;
        const std::size_t distance = begun ? 1 : typing_distance(word, candidate);
        const std::size_t max_distance = (std::min(word.size(), candidate.size()) + 1) / 3;
        if (distance >= best_distance || distance > max_distance) continue;
        best_distance = distance;
        best = candidate;
    }
    return best;
}

}  // namespace splitcubes
