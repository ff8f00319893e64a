// Reports of commands about the surface they made, as JSON with stable keys (docs/reports.md lists them).
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/splitting/solidify.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>

namespace splitcubes::splitting {
class Pieces;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::app {

using Json = nlohmann::ordered_json;

/// Returns the keys nodes_inside .. gap_edges of a grid and its extracted surface.
Json surface_report(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                    const splitting::Pieces& pieces, const splitting::SolidifyReport& solid,
                    const geometry::SurfaceMesh& mesh);

/// Formats JSON; indent -1: on one line. File names may contain invalid UTF-8, which becomes U+FFFD.
std::string json_text(const Json& json, int indent = -1);

/// Writes JSON atomically; does nothing for an empty path.
void write_json(const std::filesystem::path& path, const Json& json);

/// Returns a file's name in a report: relative to the report's folder if the file is below it, otherwise
/// without its folders, which would only reveal the machine's layout.
std::string name_for_report(const std::filesystem::path& file, const std::filesystem::path& report);

/// Prints the notes of a report to standard error, one line each with `name`.
void print_notes(const std::string& name, const std::vector<std::string>& notes);

/// Reads a mesh and prints the reader's notes.
geometry::TriangleMesh read_noted(const std::string& name);

/// Reads a mesh with its texture coordinates, colours and materials and prints the reader's notes.
io::Model read_model_noted(const std::string& name, const std::filesystem::path& out = {});

/// Gives a surface at rest, to be written to `out`, the attributes of the mesh that it was made from. Without
/// any, the surface also loses its rest positions, which equal its positions at rest. Pictures embedded in
/// the mesh's file are written beside `out` if its format cannot embed them.
void transfer_attributes(const io::Model& from, double cell_size, const std::filesystem::path& out,
                         const Parallel& parallel, geometry::SurfaceMesh& surface);

/// Returns the cell size in metres for the options --cells and --cell-size (in the unit; 0: not given; both
/// 0: 48 cells). Throws InputError for more cells along an axis than a grid can have.
double chosen_cell_size(const geometry::Box& box, int cells, double cell_size,
                        const geometry::LengthUnit& unit);

/// Calls splitting::solidify, prints its notes and adds the file's name to its errors.
splitting::NodeGrid solid_of(const std::string& name, const geometry::TriangleMesh& mesh,
                             const geometry::RestGrid& rest, splitting::SolidifyReport& report,
                             const Parallel& parallel);

}  // namespace splitcubes::app
