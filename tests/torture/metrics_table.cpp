#include "metrics_table.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> out;
    std::istringstream in(line);
    for (std::string word; std::getline(in, word, ',');) out.push_back(word);
    return out;
}

double number(const std::string& word) {
    try {
        std::size_t end = 0;
        const double out = std::stod(word, &end);
        if (end == word.size()) return out;
    } catch (const std::out_of_range&) {
        return 0;  // below the smallest double, as momenta at rest are
    } catch (const std::invalid_argument&) {
    }
    return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

MetricsTable::MetricsTable(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    if (!std::getline(lines, line)) throw std::runtime_error("no table of metrics");
    const std::vector<std::string> names = split(line);
    for (std::size_t k = 0; k < names.size(); ++k) columns_[names[k]] = k;
    const std::size_t flags = index_of("flags");
    for (; std::getline(lines, line);) {
        const std::vector<std::string> words = split(line);
        if (words.size() != names.size())
            throw std::runtime_error("a row of " + std::to_string(words.size()) + " values, not " +
                                     std::to_string(names.size()));
        std::vector<double> row(words.size(), 0);
        for (std::size_t k = 0; k < words.size(); ++k)
            if (k != flags) row[k] = number(words[k]);
        rows_.push_back(std::move(row));
        flags_.push_back(words[flags]);
    }
}

std::size_t MetricsTable::index_of(const std::string& column) const {
    const auto found = columns_.find(column);
    if (found == columns_.end()) throw std::runtime_error("the metrics have no column " + column);
    return found->second;
}

bool MetricsTable::finite(std::size_t row) const {
    for (const double value : rows_[row])
        if (!std::isfinite(value)) return false;
    return true;
}

MetricsTable read_metrics(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    try {
        return MetricsTable(std::string{std::istreambuf_iterator<char>(in), {}});
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(file.string() + ": " + error.what());
    }
}

}  // namespace splitcubes::torture
