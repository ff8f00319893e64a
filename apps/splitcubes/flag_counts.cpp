#include "flag_counts.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace splitcubes::app {

namespace {

constexpr double often = 0.1;          // of the steps
constexpr double much_removed = 0.01;  // of the largest energy

struct Advice {
    body::Flag flag;
    const char* meaning;
    const char* remedy;
};

// Not frame_fallback, which stands wherever there are slivers and harms nothing that is seen.
constexpr Advice advices[] = {
    {body::flag_inverted, "phyxels were turned inside out",
     "take a smaller time_step, or let what pulls move more slowly"},
    {body::flag_not_converged, "the elastic solve stopped before its tolerance",
     "raise solver.max_iterations, or take a smaller time_step"},
    {body::flag_non_finite, "phyxels went on without elastic force",
     "take a smaller time_step, or let what pulls move more slowly"},
    {body::flag_rank_deficient, "some phyxels have too few neighbours to tell how they are deformed",
     "usual in small fragments; where whole parts are one phyxel thick, take a smaller phyxel_spacing"},
    {body::flag_energy_excess, "pieces gained energy that nothing put in, and it was removed",
     "take a smaller time_step"},
    {body::flag_took_implicit,
     "a body would have needed more explicit substeps than allowed, and was stepped implicitly",
     "take a smaller time_step or a softer material, or set solver.kind to implicit"},
};

std::string name_of(std::size_t bit) {
    return body::flag_text(std::uint32_t{1} << bit);
}

// The field of a row of the table, from 0.
std::string field(const std::string& row, std::size_t index) {
    std::istringstream in(row);
    std::string out;
    for (std::size_t k = 0; k <= index; ++k)
        if (!std::getline(in, out, ',')) return "";
    return out;
}

std::size_t column_of(const std::string& head, const std::string& name) {
    std::istringstream in(head);
    std::size_t index = 0;
    for (std::string column; std::getline(in, column, ','); ++index)
        if (column == name) return index;
    return index;
}

}  // namespace

void FlagCounts::add(std::uint32_t flags, double energy_removed, double energy) {
    ++steps_;
    energy_removed_ += energy_removed;
    largest_energy_ = std::max(largest_energy_, energy);
    for (std::size_t bit = 0; bit < flag_count; ++bit) counts_[bit] += flags >> bit & 1U;
}

void FlagCounts::add_table(const std::string& metrics) {
    std::istringstream in(metrics);
    std::string row;
    if (!std::getline(in, row)) return;
    const std::size_t column = column_of(row, "flags"), removed = column_of(row, "energy_removed"),
                      kinetic = column_of(row, "kinetic_energy"), elastic = column_of(row, "elastic_energy");
    const auto number = [&](std::size_t of_column) {
        return std::strtod(field(row, of_column).c_str(), nullptr);
    };
    while (std::getline(in, row)) {
        const std::string text = '|' + field(row, column) + '|';
        std::uint32_t flags = 0;
        for (std::size_t bit = 0; bit < flag_count; ++bit)
            if (text.find('|' + name_of(bit) + '|') != std::string::npos) flags |= std::uint32_t{1} << bit;
        add(flags, number(removed), number(kinetic) + number(elastic));
    }
}

nlohmann::ordered_json FlagCounts::json() const {
    nlohmann::ordered_json out;
    for (std::size_t bit = 0; bit < flag_count; ++bit) out[name_of(bit)] = counts_[bit];
    return out;
}

std::string FlagCounts::amount_removed() const {
    std::ostringstream out;
    out.precision(3);
    out << " (" << energy_removed_ << " J in all; the largest energy was " << largest_energy_ << " J)";
    return out.str();
}

std::vector<std::string> FlagCounts::notes() const {
    std::vector<std::string> out;
    for (const Advice& advice : advices)
        for (std::size_t bit = 0; bit < flag_count; ++bit) {
            if (advice.flag != std::uint32_t{1} << bit) continue;
            const auto count = static_cast<double>(counts_[bit]), steps = static_cast<double>(steps_);
            const bool is_energy = advice.flag == body::flag_energy_excess;
            const bool much = is_energy && energy_removed_ > much_removed * largest_energy_;
            const double share = advice.flag == body::flag_took_implicit ? 0 : often;
            if (!(count > share * steps) && !much) continue;
            out.push_back(
                name_of(bit) + " in " + std::to_string(counts_[bit]) + " of " + std::to_string(steps_) +
                " steps (" + std::to_string(static_cast<int>(100 * count / steps + 0.5)) +
                " %): " + advice.meaning + (is_energy ? amount_removed() : "") + "; " + advice.remedy);
        }
    return out;
}

}  // namespace splitcubes::app
