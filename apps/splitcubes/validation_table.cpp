#include "validation.h"

#include <splitcubes/core/error.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

namespace splitcubes::app {

namespace {

std::string formatted(const char* format, double value) {
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

TetrahedraResults::Mesh mesh_of(const nlohmann::json& json) {
    return {json.at("free_nodes").get<std::size_t>(), json.at("error").get<double>()};
}

TetrahedraResults results_of(const nlohmann::json& json) {
    TetrahedraResults out;
    for (const nlohmann::json& point : json.at("points"))
        out.points[{point.at("test").get<std::string>(), point.at("across").get<int>()}] = {
            mesh_of(point.at("linear")), mesh_of(point.at("quadratic"))};
    for (const nlohmann::json& point : json.at("fine"))
        out.fine[point.at("test").get<std::string>()] = mesh_of(point);
    return out;
}

std::string whole_text(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    if (file) text << file.rdbuf();
    if (!file || !text) throw InputError(path.string(), "cannot be read", "give a file that can be read");
    return text.str();
}

void add_cells(std::vector<std::string>& row, const TetrahedraResults::Mesh& mesh) {
    row.push_back(std::to_string(mesh.free_nodes));
    row.push_back(formatted("%+.1f", 100 * mesh.error));
}

int rank_of_phyxels(const ValidationPoint& p, const TetrahedraResults& tetrahedra,
                    const TetrahedraResults::Point& beside) {
    const auto distance = [&](double error) { return deviation(tetrahedra.ratio_to_finest(p.test, error)); };
    return 1 + (distance(beside.linear.error) < distance(p.error())) +
           (distance(beside.quadratic.error) < distance(p.error()));
}

}  // namespace

double TetrahedraResults::ratio_to_finest(const std::string& test, double error) const {
    const auto finest = fine.find(test);
    return (1 + error) / (finest == fine.end() ? 1 : 1 + finest->second.error);
}

double deviation(double ratio) {
    return ratio > 0 ? std::max(ratio, 1 / ratio) - 1 : std::numeric_limits<double>::infinity();
}

TetrahedraResults read_tetrahedra(const std::filesystem::path& path) {
    const std::string text = whole_text(path);
    try {
        return results_of(nlohmann::json::parse(text));
    } catch (const nlohmann::json::exception&) {
        throw InputError(path.string(), "does not hold results of tetrahedra",
                         "give a file that bench_tetrahedra wrote");
    }
}

TableRows validation_table(const std::vector<ValidationPoint>& points, const TetrahedraResults& tetrahedra) {
    const bool compares = !tetrahedra.points.empty();
    TableRows rows{
        {"test", "across", "phyxels", "free", "measured", "expected", "unit", "error %", "stiffness seen"}};
    if (compares)
        for (const char* column : {"linear: nodes", "error %", "quadratic: nodes", "error %", "rank"})
            rows.front().emplace_back(column);
    for (std::size_t k = 0; k < points.size(); ++k) {
        const ValidationPoint& p = points[k];
        std::vector<std::string> row{p.test,
                                     std::to_string(p.across),
                                     std::to_string(p.count),
                                     std::to_string(p.free),
                                     formatted("%.4g", p.measured),
                                     formatted("%.4g", p.expected),
                                     p.unit,
                                     formatted("%+.1f", 100 * p.error()),
                                     p.seen > 0 ? formatted("%.2f", p.seen) : ""};
        const auto fine = tetrahedra.fine.find(p.test);
        const auto beside = tetrahedra.points.find({p.test, p.across});
        if (beside != tetrahedra.points.end()) {
            add_cells(row, beside->second.linear);
            add_cells(row, beside->second.quadratic);
            row.push_back(std::to_string(rank_of_phyxels(p, tetrahedra, beside->second)));
        }
        row.resize(rows.front().size());
        rows.push_back(std::move(row));
        if (fine == tetrahedra.fine.end() || (k + 1 < points.size() && points[k + 1].test == p.test))
            continue;
        std::vector<std::string> last(rows.front().size() - 3);
        last[0] = p.test;
        last[1] = "fine";
        add_cells(last, fine->second);
        last.emplace_back();
        rows.push_back(std::move(last));
    }
    return rows;
}

std::string table_text(const TableRows& rows, bool aligned) {
    std::vector<std::size_t> width(rows.front().size(), 0);
    for (const std::vector<std::string>& row : rows)
        for (std::size_t k = 0; k < row.size() && aligned; ++k) width[k] = std::max(width[k], row[k].size());
    std::string text;
    for (std::size_t r = 0; r < rows.size(); ++r) {
        for (std::size_t k = 0; k < rows[r].size(); ++k) {
            const std::string& cell = rows[r][k];
            const std::string spaces(width[k] > cell.size() ? width[k] - cell.size() : 0, ' ');
            text += (k == 0 ? "| " + cell + spaces : spaces + cell) + " |";
            if (k + 1 < rows[r].size() && (aligned || !rows[r][k + 1].empty())) text += ' ';
        }
        text += '\n';
        if (r > 0) continue;
        for (std::size_t k = 0; k < rows[r].size(); ++k) text += "|---";
        text += "|\n";
    }
    return text;
}

std::string with_table(const std::filesystem::path& document, const TableRows& rows) {
    const std::string text = whole_text(document);
    const std::string head = "| test | across |";
    std::size_t begin = text.starts_with(head) ? 0 : text.find('\n' + head);
    if (begin == std::string::npos)
        throw InputError(document.string(), "has no table of validation",
                         "give a document with a line '" + head + "'");
    if (begin > 0) ++begin;
    std::size_t end = begin;
    while (end < text.size() && text[end] == '|') end = std::min(text.find('\n', end), text.size() - 1) + 1;
    return text.substr(0, begin) + table_text(rows, false) + text.substr(end);
}

}  // namespace splitcubes::app
