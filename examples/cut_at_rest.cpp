// Cuts a pear at rest with a sheet and with a wire, and writes a closed mesh of each piece.
#include <splitcubes/api/simulation.h>

#include <array>
#include <iostream>

using namespace splitcubes;

int main(int argc, char** argv) {
    const std::string meshes = argc > 1 ? argv[1] : "scenes/meshes";
    try {
        Simulation simulation;
        const BodyId pear = simulation.add_body(meshes + "/pear.obj", {.name = "pear", .cells = 32});

        // A sheet: any triangles, here the plane x = 0.01 as two of them.
        const std::array<double, 12> corners{0.01, -1, -1, 0.01, 1, -1, 0.01, 1, 1, 0.01, -1, 1};
        const std::array<std::uint32_t, 6> triangles{0, 1, 2, 0, 2, 3};
        std::cout << simulation.cut_with_sheet(pear, {corners, triangles}) << " edges cut by the sheet\n";

        // A wire along x that is drawn along y, in rest coordinates.
        const std::array<Vector3, 2> wire{Vector3{-1, 0, 0}, Vector3{1, 0, 0}};
        const std::array<TimedPose, 2> path{TimedPose{0, {{0, -1, 0}, {}}}, TimedPose{1, {{0, 1, 0.02}, {}}}};
        std::cout << simulation.cut_with_blade(pear, {wire}, path) << " edges cut by the wire\n";

        const int pieces = static_cast<int>(simulation.piece_count(pear));
        for (int k = 0; k < pieces; ++k)
            simulation.write_surface(pear, "piece-" + std::to_string(k) + ".ply", k);
        std::cout << pieces << " pieces written\n";
        return pieces >= 4 ? 0 : 1;
    } catch (const Error& error) {
        std::cerr << error.what() << '\n';
        return 2;
    }
}
