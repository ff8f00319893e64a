#include "commands.h"

#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/mesh_format.h>
#include <splitcubes/io/read_mesh.h>

#include <iostream>
#include <memory>

namespace splitcubes::app {

namespace {

int validate(const std::vector<std::string>& files) {
    bool all_valid = true;
    for (const std::string& file : files) {
        geometry::TriangleMesh mesh = io::read_mesh(file);
        const std::string ending = std::filesystem::path(file).extension().string();
        // glTF splits vertices at seams and materials, so only places can say what is joined.
        if (ending == ".glb" || ending == ".gltf") mesh = geometry::weld_equal_vertices(mesh);
        const geometry::MeshCheck check = geometry::check_mesh(mesh);
        const auto yes_no = [](bool value) { return value ? "yes" : "no"; };
        std::cout << file << ": " << (check.valid() ? "valid" : "NOT valid") << '\n'
                  << "  vertices " << check.vertices << ", triangles " << check.triangles << ", parts "
                  << check.parts.size() << '\n'
                  << "  closed " << yes_no(check.closed() && check.boundary_edges == 0) << " ("
                  << check.boundary_edges << " boundary edges, " << check.degenerate_triangles
                  << " degenerate triangles)\n"
                  << "  oriented " << yes_no(check.oriented()) << " (" << check.misoriented_edges
                  << " edges run the same way twice)\n"
                  << "  manifold " << yes_no(check.manifold()) << " (" << check.non_manifold_edges
                  << " edges, " << check.non_manifold_vertices << " vertices are not)\n"
                  << "  volume " << check.volume << " m^3, area " << check.area << " m^2\n";
        if (check.parts.size() > 1)
            for (std::size_t k = 0; k < check.parts.size() && k < 20; ++k)
                std::cout << "  part " << k << ": " << check.parts[k].triangles << " triangles, volume "
                          << check.parts[k].volume << " m^3\n";
        all_valid = all_valid && check.valid();
    }
    return all_valid ? 0 : 1;
}

}  // namespace

void add_validate_command(CLI::App& app, Run& run) {
    const auto files = std::make_shared<std::vector<std::string>>();
    CLI::App* command = app.add_subcommand(
        "validate", "Checks meshes: closed, oriented, 2-manifold; exit code 1 where one is not");
    command->add_option("mesh", *files, "Meshes: .obj .ply .stl .gltf .glb")->required();
    command->callback([files, &run] { run = [files] { return validate(*files); }; });
}

}  // namespace splitcubes::app
