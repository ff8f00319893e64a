#include "cutters.h"

#include "command_line.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/scaled_tool.h>

namespace splitcubes::app {

namespace {

void check_closed(const Cutter& cutter) {
    const geometry::MeshCheck check = geometry::check_mesh(cutter.sheet);
    if (!check.closed())
        throw InputError(cutter.file,
                         "is not closed (" + std::to_string(check.boundary_edges) + " boundary edges, " +
                             std::to_string(check.misoriented_edges) +
                             " between triangles of opposite orientation) and has no inside to remove",
                         "give a closed mesh, or --mode separate");
}

Cutter read_sheet(const std::string& file, const MeshScale& scale, bool closed) {
    Cutter out;
    out.file = file;
    out.sheet = read_noted(file);
    scale.apply(out.sheet, file);
    if (!closed) return out;
    out.sheet = geometry::weld_equal_vertices(out.sheet);
    check_closed(out);
    return out;
}

// Returns the plane in metres of the result.
geometry::CuttingPlane scaled(geometry::CuttingPlane plane, const MeshScale& scale) {
    plane.offset = scale.unit().to_metres(plane.offset * scale.scale);
    return plane;
}

Cutter make_plane(const CutterOption& option, const MeshScale& scale, bool closed,
                  const geometry::Box& body) {
    const geometry::CuttingPlane plane = scaled(option.plane, scale);
    // The grid extends past the body by some cells.
    const geometry::Box box = body.grown(body.size().norm());
    Cutter out;
    out.file = "plane " + option.text;
    out.is_plane = true;
    out.plane = plane;
    out.sheet = closed ? geometry::half_space_within(plane, box) : geometry::plane_sheet(plane, box);
    return out;
}

}  // namespace

geometry::CuttingPlane parse_plane(const std::string& text) {
    constexpr double large = 1e12;
    const Range range{-large, large};
    const std::string where = "--plane";
    const auto fail = [&](const std::string& problem) -> void {
        throw InputError(
            where, "'" + printable(text) + "' " + problem,
            "write nx,ny,nz,d for the points with nx x + ny y + nz z = d, or one of x=D, y=D, z=D");
    };
    geometry::CuttingPlane out;
    if (text.size() > 1 && text[1] == '=') {
        const int axis = text[0] - 'x';
        if (axis < 0 || axis > 2) fail("names no axis");
        out.normal = Vec3::Unit(axis);
        out.offset = read_number(std::string_view(text).substr(2), range, where);
        return out;
    }
    std::vector<double> numbers;
    for (std::size_t at = 0; at <= text.size() && numbers.size() < 5;) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string_view word = std::string_view(text).substr(at, end - at);
        if (text.find(',') == std::string::npos) break;
        numbers.push_back(read_number(word, range, where));
        at = end + 1;
    }
    if (numbers.size() != 4) fail("is not a plane");
    out.normal = {numbers[0], numbers[1], numbers[2]};
    out.offset = numbers[3];
    if (!(out.normal.stableNorm() > 1e-100)) fail("has a normal without a direction");
    return out;
}

void add_cutter_options(Command& command, std::vector<CutterOption>& options) {
    using Kind = CutterOption::Kind;
    const auto add = [&](const char* name, const char* value, Kind kind, const char* help) -> Argument& {
        return command.add({name, value, help, [&options, kind, name](const std::string& word) {
                                if (word.empty() && kind != Kind::plane)
                                    throw InputError(name, "names no file", "give a name");
                                options.push_back({kind, word});
                                if (kind == Kind::plane) options.back().plane = parse_plane(word);
                            }});
    };
    add("--with", "FILE", Kind::mesh, "Sheets or closed meshes, in the mesh's coordinates")
        .list()
        .completes(meshes_in());
    add("--path", "FILE", Kind::path,
        "Blades on their paths: JSON files, tools as in a scene, in the mesh's coordinates")
        .list()
        .completes(files({"json"}));
    add("--plane", "PLANE", Kind::plane,
        "Cuts along a plane, in the mesh's coordinates: nx,ny,nz,d for the points with nx x + ny y + nz z = "
        "d, "
        "or x=D, y=D, z=D. With --mode remove what lies in front, where the left side is larger, is taken "
        "away")
        .repeatable();
}

std::vector<Cutter> read_cutters(const std::vector<CutterOption>& options, const MeshScale& scale,
                                 bool closed, const geometry::Box& body) {
    std::vector<Cutter> out;
    for (const CutterOption& option : options) {
        switch (option.kind) {
            case CutterOption::Kind::mesh:
                out.push_back(read_sheet(option.text, scale, closed));
                break;
            case CutterOption::Kind::plane:
                out.push_back(make_plane(option, scale, closed, body));
                break;
            case CutterOption::Kind::path:
                for (const scene::ToolDescription& tool : scene::parse_path_file(option.text)) {
                    out.emplace_back();
                    out.back().file = option.text;
                    out.back().blade = scene::make_blade(scene::scaled(tool, scale.factor()));
                }
                break;
        }
    }
    return out;
}

Json cutters_report(const std::vector<Cutter>& cutters) {
    Json out = Json::array();
    for (const Cutter& cutter : cutters) {
        out.push_back({{cutter.is_plane ? "plane" : "file",
                        cutter.is_plane ? cutter.file.substr(std::string("plane ").size()) : cutter.file}});
        if (cutter.blade) out.back()["blade"] = cutter.blade->name();
        out.back()["cut_edges"] = cutter.cut_edges;
        if (!cutter.idle_reason.empty()) out.back()["idle"] = cutter.idle_reason;
    }
    return out;
}

}  // namespace splitcubes::app
