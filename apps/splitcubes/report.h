// What a command says about the surface it made, as JSON with stable keys
// (docs/reports.md lists them).
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/surface.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace splitcubes::app {

using Json = nlohmann::ordered_json;

/// Keys nodes_inside .. gap_edges of a grid and its extracted surface.
Json surface_report(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                    const splitting::Pieces& pieces, const splitting::SolidifyReport& solid,
                    const geometry::SurfaceMesh& mesh);

/// JSON as text; indent -1: on one line. Names of files need not be good UTF-8; what is not becomes U+FFFD.
std::string json_text(const Json& json, int indent = -1);

/// Writes JSON, whole or not at all; does nothing for an empty path.
void write_json(const std::filesystem::path& path, const Json& json);

/// The name that a report gives to a file: relative to the report's folder where the file is below that,
/// otherwise without its folders, which tell of the machine and of nothing else.
std::string name_for_report(const std::filesystem::path& file, const std::filesystem::path& report);

/// Prints the notes of a report to standard error, each as one line about `name`.
void print_notes(const std::string& name, const std::vector<std::string>& notes);

/// Reads a mesh and prints what the reader noted.
geometry::TriangleMesh read_noted(const std::string& name);

/// The same with the mesh's texture coordinates, colours and materials.
io::Model read_model_noted(const std::string& name, const std::filesystem::path& out = {});

/// Gives a surface at rest, to be written to `out`, the attributes of the mesh that
/// it was made of; a mesh without any leaves it without rest positions too, which at
/// rest say nothing new. Pictures that the mesh's file held are written beside `out`
/// where its format cannot hold them.
void carry_attributes(const io::Model& from, double cell_size, const std::filesystem::path& out,
                      const Parallel& parallel, geometry::SurfaceMesh& surface);

/// Cell size in metres from the options --cells and --cell-size, which is in the unit (0: not given; both 0:
/// 48 cells). Throws InputError for more cells along an axis than a grid can have.
double chosen_cell_size(const geometry::Box& box, int cells, double cell_size,
                        const geometry::LengthUnit& unit);

/// splitting::solidify with the notes printed, its errors saying the file's name.
splitting::NodeGrid solid_of(const std::string& name, const geometry::TriangleMesh& mesh,
                             const geometry::RestGrid& rest, splitting::SolidifyReport& report,
                             const Parallel& parallel);

}  // namespace splitcubes::app
