// Compares the mechanics with linear elasticity for several phyxel spacings.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/occlusion/criterion.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
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

/// The sag, m, that a cut from above adds to a bar under its weight, per share of the bar's height that is
/// cut. `across` phyxels across. Poisson's ratio is zero.
std::vector<ValidationPoint> notched_bars(std::span<const double> shares, int across,
                                          occlusion::CriterionKind criterion,
                                          const std::shared_ptr<const Parallel>& parallel);

/// The same cases on meshes of tetrahedra, as `bench_tetrahedra` writes them.
struct TetrahedraResults {
    struct Mesh {
        std::size_t free_nodes = 0;
        double error = 0;
    };
    struct Point {
        Mesh linear, quadratic;  // of about as many free nodes as phyxels
    };
    /// Returns measured / reference for an error against theory. The reference is the finest mesh, which
    /// knows the ends and edges that theory neglects; without such a mesh it is theory.
    double ratio_to_finest(const std::string& test, double error) const;

    std::map<std::pair<std::string, int>, Point> points;  // by test and phyxels across
    std::map<std::string, Mesh> fine;                     // by test: quadratic, finest mesh
};

/// Returns by how much the larger of two values exceeds the smaller, relative, from their ratio. Twice as
/// soft is then as far off as twice as stiff, whether stiffness, energy or displacement is measured.
double deviation(double ratio);

/// Throws InputError for a file of another content.
TetrahedraResults read_tetrahedra(const std::filesystem::path& path);

/// A row of cells, the first row being the head.
using TableRows = std::vector<std::vector<std::string>>;

/// The points, and tetrahedra beside them if there are any: with those, each test ends with a row of the
/// finest mesh. The rank is the position of the phyxels among phyxels, linear and quadratic tetrahedra by
/// their deviation from the finest mesh.
TableRows validation_table(const std::vector<ValidationPoint>& points, const TetrahedraResults& tetrahedra);

/// Formats rows as a table of Markdown; aligned: with spaces, for a terminal.
std::string table_text(const TableRows& rows, bool aligned);

/// Returns a document with its table of validation, that with the head `| test | across |...`, replaced.
/// Throws InputError if it has none.
std::string with_table(const std::filesystem::path& document, const TableRows& rows);

/// Plots the deviation from the finest mesh, or without one from theory, over the number of phyxels across,
/// both logarithmic, as SVG: an area for each test, with tetrahedra of as many unknowns.
std::string error_plot(const std::vector<ValidationPoint>& points, const TetrahedraResults& tetrahedra);

}  // namespace splitcubes::app
