// What `cut` cuts with: sheets and closed meshes, blades on paths, planes.
#pragma once

#include "mesh_scale.h"
#include "report.h"

#include <splitcubes/cutting/blade.h>
#include <splitcubes/geometry/plane.h>

#include <optional>
#include <string>
#include <vector>

namespace splitcubes::app {

/// As the command line says it.
struct CutterOption {
    enum class Kind { mesh, path, plane };
    Kind kind;
    std::string text;  // a file, or a plane
    geometry::CuttingPlane plane = {};
};

/// Adds --with, --path and --plane, which cut in the order in which they are given.
void add_cutter_options(Command& command, std::vector<CutterOption>& options);

/// One thing to cut with: a sheet or a blade on its path.
struct Cutter {
    std::string file;  // or the plane, as it was given
    geometry::TriangleMesh sheet;
    std::optional<cutting::Blade> blade;
    bool is_plane = false;
    std::optional<geometry::CuttingPlane> plane = {};  // m
    std::size_t cut_edges = 0;
    bool encloses = false;         // a piece lies inside
    std::string idle_reason = {};  // of one that cut nothing: why

    std::string what() const { return blade ? file + ": blade '" + blade->name() + "'" : file; }
};

/// In metres. closed: they are to have an inside, which is in front of a plane. body: the box of what is
/// cut. Throws InputError.
std::vector<Cutter> read_cutters(const std::vector<CutterOption>& options, const MeshScale& scale,
                                 bool closed, const geometry::Box& body);

/// The report's array `cutters`.
Json cutters_report(const std::vector<Cutter>& cutters);

/// "0,0,1,0.05" or "z=0.05". Throws InputError.
geometry::CuttingPlane parse_plane(const std::string& text);

}  // namespace splitcubes::app
