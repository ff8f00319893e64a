// Written from the README alone: opens a mesh, drives a blade, streams what changed, reads the force, saves,
// undoes the cut. Its exit code says whether all of it worked.
#include <splitcubes/api/simulation.h>

#include <array>
#include <cmath>
#include <iostream>

using namespace splitcubes;

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    try {
        Simulation simulation({.gravity = {}});
        const BodyId pear =
            simulation.add_body(argv[1], {.cells = 24, .material = {.cutting_resistance = 40}});
        const std::array<Vector3, 2> edge{Vector3{0, -1, 0}, Vector3{0, 1, 0}};
        const ToolId knife = simulation.add_tool({edge}, {.pose = {{0.004, 0, 1}, {}}});
        simulation.lower_tool(knife);
        std::size_t streamed = 0;
        double force = 0;
        for (int frame = 1; frame <= 40; ++frame) {
            const double z = 1 - 0.05 * frame;
            simulation.add_tool_pose(knife, simulation.time() + simulation.time_step(), {{0.004, 0, z}, {}});
            const StepResult result = simulation.step();
            force = std::max(force, std::abs(result.tools[0].force.z));
            for (const Range& range : simulation.surface(pear).changed_vertices) streamed += range.count;
        }
        simulation.raise_tool(knife);
        const std::size_t cut = simulation.piece_count(pear);
        simulation.save(argv[2]);
        simulation.undo();
        const std::size_t undone = simulation.piece_count(pear);
        simulation.load(argv[2]);
        std::cout << "pieces " << cut << ", undone " << undone << ", loaded " << simulation.piece_count(pear)
                  << "; largest force " << force << " N; " << streamed << " vertices streamed\n";
        return cut >= 2 && undone == 1 && simulation.piece_count(pear) == cut && force > 0 && streamed > 0
                   ? 0
                   : 1;
    } catch (const Error& error) {
        std::cerr << error.what() << '\n';
        return 2;
    }
}
