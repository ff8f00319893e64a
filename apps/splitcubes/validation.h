// Compares the mechanics with linear elasticity for several phyxel spacings.
#pragma once

#include <splitcubes/core/parallel.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::app {

/// A measured value and that of linear elasticity.
struct ValidationPoint {
    std::string test;       // name of the case
    int across = 0;         // phyxels across the thickness
    std::size_t count = 0;  // phyxels
    double measured = 0, expected = 0;
    std::string unit;
    double seen = 0;       // of beams: share of the bending stiffness that the gradients resolve; else 0
    std::size_t free = 0;  // phyxels that are not held
    double error() const { return measured / expected - 1; }
};

/// Runs all cases, coarse to fine; about a minute.
std::vector<ValidationPoint> validate_mechanics(const std::shared_ptr<const Parallel>& parallel);

/// The same cases on meshes of tetrahedra, as `bench_tetrahedra` writes them.
struct TetrahedraResults {
    struct Mesh {
        std::size_t free_nodes = 0;
        double error = 0;
    };
    struct Point {
        Mesh linear, quadratic;  // of about as many free nodes as phyxels
    };
    std::map<std::pair<std::string, int>, Point> points;  // by test and phyxels across
    std::map<std::string, Mesh> fine;                     // by test: quadratic, finest mesh
};

/// Throws InputError for a file of another content.
TetrahedraResults read_tetrahedra(const std::filesystem::path& path);

/// A row of cells, the first row being the head.
using TableRows = std::vector<std::vector<std::string>>;

/// The points, and tetrahedra beside them if there are any: with those, each test ends with a row of the
/// finest mesh.
TableRows validation_table(const std::vector<ValidationPoint>& points, const TetrahedraResults& tetrahedra);

/// Formats rows as a table of Markdown; aligned: with spaces, for a terminal.
std::string table_text(const TableRows& rows, bool aligned);

/// Returns a document with its table of validation, that with the head `| test | across |...`, replaced.
/// Throws InputError if it has none.
std::string with_table(const std::filesystem::path& document, const TableRows& rows);

/// Plots |error| over the number of phyxels across, both logarithmic, as SVG: an area for each test, with
/// tetrahedra of as many unknowns.
std::string error_plot(const std::vector<ValidationPoint>& points, const TetrahedraResults& tetrahedra);

}  // namespace splitcubes::app
