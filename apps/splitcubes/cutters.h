// Cutters of `cut`: sheets and closed meshes, blades on paths, planes.
#pragma once

#include "mesh_scale.h"
#include "report.h"

#include <splitcubes/cutting/blade.h>
#include <splitcubes/geometry/plane.h>

#include <optional>
#include <string>
#include <vector>

namespace splitcubes::app {

/// A cutter as given on the command line.
struct CutterOption {
    enum class Kind { mesh, path, plane };
    Kind kind;
    std::string text;  // a file, or a plane
    geometry::CuttingPlane plane = {};
};

/// Adds --with, --path and --plane; cutters are applied in the order in which they are given.
void add_cutter_options(Command& command, std::vector<CutterOption>& options);

/// A cutter: a sheet or a blade on its path.
struct Cutter {
    std::string file;  // or the plane, as given
    geometry::TriangleMesh sheet;
    std::optional<cutting::Blade> blade;
    bool is_plane = false;
    std::optional<geometry::CuttingPlane> plane = {};  // m
    std::size_t cut_edges = 0;
    bool encloses = false;         // a piece lies inside
    std::string idle_reason = {};  // why it cut nothing; else empty

    std::string what() const { return blade ? file + ": blade '" + blade->name() + "'" : file; }
};

/// Reads the cutters, lengths in metres. closed: they need an inside; that of a plane is in front of it.
/// body: bounding box of the solid. Throws InputError.
std::vector<Cutter> read_cutters(const std::vector<CutterOption>& options, const MeshScale& scale,
                                 bool closed, const geometry::Box& body);

/// Returns the report's array `cutters`.
Json cutters_report(const std::vector<Cutter>& cutters);

/// Parses "0,0,1,0.05" or "z=0.05". Throws InputError.
geometry::CuttingPlane parse_plane(const std::string& text);

}  // namespace splitcubes::app
