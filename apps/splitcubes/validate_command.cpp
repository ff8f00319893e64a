#include "command_line.h"
#include "commands.h"
#include "mesh_scale.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/mesh_format.h>
#include <splitcubes/io/read_mesh.h>

#include <iostream>
#include <memory>
#include <optional>

namespace splitcubes::app {

namespace {

struct ValidateOptions {
    std::vector<std::string> files;
    MeshScale scale;
    bool all_parts = false;
};

// Collects reasons; counts of zero are skipped.
class Reasons {
  public:
    void add(std::size_t count, const char* one, const char* many) {
        if (count == 0) return;
        text_ += (text_.empty() ? "" : ", ") + std::to_string(count) + " " + (count == 1 ? one : many);
    }
    std::string line(const char* property, bool holds) const {
        return std::string("  ") + property + (holds ? " yes" : " no: " + text_) + "\n";
    }

  private:
    std::string text_;
};

std::string properties(const geometry::MeshCheck& check) {
    Reasons open, turned, branching;
    open.add(check.triangles == 0, "mesh without triangles", "");
    open.add(check.boundary_edges, "edge has one triangle only", "edges have one triangle only");
    if (check.boundary_edges == 0)
        open.add(check.unbalanced_edges, "edge is used more often in one direction than in the other",
                 "edges are used more often in one direction than in the other");
    open.add(check.degenerate_triangles, "triangle has a vertex twice", "triangles have a vertex twice");
    open.add(check.non_finite_vertices, "vertex is not finite", "vertices are not finite");
    const bool closed = check.closed() && check.boundary_edges == 0 && check.non_finite_vertices == 0;
    turned.add(check.misoriented_edges, "edge has the same direction in both triangles",
               "edges have the same direction in both triangles");
    turned.add(check.non_manifold_edges, "edge has more than two triangles",
               "edges have more than two triangles");
    branching.add(check.non_manifold_edges, "edge has more than two triangles",
                  "edges have more than two triangles");
    branching.add(check.non_manifold_vertices, "vertex joins several fans of triangles",
                  "vertices join several fans of triangles");
    return open.line("closed", closed) + turned.line("oriented", check.oriented()) +
           branching.line("manifold", check.manifold());
}

std::string part_line(const std::string& name, std::size_t triangles, double volume, const MeshScale& scale) {
    return "  " + name + ": " + std::to_string(triangles) + (triangles == 1 ? " triangle" : " triangles") +
           ", volume " + scale.volume_text(volume) + "\n";
}

// Lists the largest parts and counts the rest.
std::string parts_text(const geometry::MeshCheck& check, const ValidateOptions& options) {
    if (check.parts.size() < 2) return "";
    const std::size_t listed = options.all_parts ? check.parts.size() : 20;
    std::string out;
    std::size_t left_out = 0, triangles = 0;
    double volume = 0;
    for (std::size_t k = 0; k < check.parts.size(); ++k) {
        const geometry::MeshPart& part = check.parts[k];
        if (k < listed) {
            out += part_line("part " + std::to_string(k), part.triangles, part.volume, options.scale);
            continue;
        }
        ++left_out;
        triangles += part.triangles;
        volume += part.volume;
    }
    if (left_out > 0)
        out += part_line(std::to_string(left_out) + " smaller parts, listed by --all-parts", triangles,
                         volume, options.scale);
    return out;
}

bool validate_file(const std::string& file, const ValidateOptions& options) {
    geometry::TriangleMesh mesh = io::read_mesh(file);
    options.scale.apply(mesh, file);
    // glTF splits vertices at seams and materials, so connectivity is determined by position.
    if (io::format_of_extension(file) == io::MeshFormat::gltf) mesh = geometry::weld_equal_vertices(mesh);
    const geometry::MeshCheck check = geometry::check_mesh(mesh);
    std::cout << file << ": " << (check.valid() ? "valid" : "NOT valid") << "\n  vertices " << check.vertices
              << ", triangles " << check.triangles << ", parts " << check.parts.size() << '\n'
              << properties(check) << "  volume " << options.scale.volume_text(check.volume) << ", area "
              << options.scale.area_text(check.area) << '\n'
              << parts_text(check, options) << std::flush;
    return check.valid();
}

// All files are checked, whatever the result for the others.
int validate(const ValidateOptions& options) {
    std::size_t invalid = 0, unreadable = 0;
    for (const std::string& file : options.files) {
        try {
            invalid += !validate_file(file, options);
        } catch (const InputError& error) {
            std::cerr << "splitcubes: " << error.what() << '\n';
            ++unreadable;
        }
    }
    if (options.files.size() > 1)
        std::cout << options.files.size() << " files: " << options.files.size() - invalid - unreadable
                  << " valid, " << invalid << " not valid, " << unreadable << " not read\n";
    return unreadable > 0 ? 2 : invalid > 0 ? 1 : 0;
}

}  // namespace

void add_validate_command(CommandLine& line) {
    const auto options = std::make_shared<ValidateOptions>();
    Command& command = line.add("validate", "Checks meshes: closed, oriented, 2-manifold");
    command.add_list("MESH", "", options->files, "Meshes: .obj .ply .stl .gltf .glb")
        .required()
        .completes(meshes_in());
    command.add_flag("--all-parts", options->all_parts, "Lists all parts, not the 20 largest alone");
    add_unit_option(
        command, options->scale.unit_name,
        "Unit of the files' numbers, also for printed volumes and areas: m (default), mm, cm or inch");
    command.details =
        "All files are checked before it ends. Exit code: 0 all are valid, 1 one is not, 2 one cannot be "
        "read.";
    command.example("splitcubes validate cut.ply pieces/*.ply");
    command.run = [options] { return validate(*options); };
}

}  // namespace splitcubes::app
