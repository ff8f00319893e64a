// A loop as of a program with a hand-held blade: poses come faster than steps, forces go back to the hand.
#include <splitcubes/api/simulation.h>

#include <array>
#include <cmath>
#include <iostream>

using namespace splitcubes;

int main(int argc, char** argv) {
    const std::string meshes = argc > 1 ? argv[1] : "scenes/meshes";
    try {
        Simulation simulation({.ground = Ground{.offset = -0.06}});
        BodySettings tissue{.name = "liver", .cells = 40, .phyxel_count = 400};
        tissue.material = {.youngs_modulus = 2e4, .mass_damping = 2, .cutting_resistance = 50};
        const BodyId liver = simulation.add_body(meshes + "/liver.obj", tissue);

        const std::array<Vector3, 2> edge{Vector3{0, -0.2, 0}, Vector3{0, 0.2, 0}};
        const Pose above{{0, 0, 0.12}, {}};
        const ToolId knife = simulation.add_tool({edge}, {.name = "knife", .pose = above});
        simulation.lower_tool(knife);

        double largest = 0, work = 0;
        for (int frame = 0; frame < 60; ++frame) {
            const double now = simulation.time(), dt = simulation.time_step();
            for (int sample = 1; sample <= 16; ++sample) {  // the hand, at about 1 kHz
                const double time = now + dt * sample / 16;
                const Pose hand{{0.02 * std::sin(4 * time), 0, 0.12 - 0.2 * time}, {}};
                simulation.add_tool_pose(knife, time, hand);
            }
            const StepResult result = simulation.step();
            for (const CutBegan& cut : result.cuts_began)
                std::cout << "at " << result.time << " s the knife meets body " << cut.body.index << '\n';
            for (const PieceSeparated& event : result.pieces_separated)
                std::cout << "at " << result.time << " s piece " << event.piece << " comes off\n";
            const Vector3 force = result.tools[0].force;  // for the hand's motors
            largest = std::max(largest, std::hypot(force.x, force.y, force.z));
            work += result.tools[0].cut_work;
        }
        simulation.raise_tool(knife);
        std::cout << "largest force " << largest << " N, work " << work << " J, "
                  << simulation.piece_count(liver) << " pieces\n";
        simulation.undo();  // to before the knife was lowered
        std::cout << "undone: " << simulation.piece_count(liver) << " piece\n";
        return largest > 0 && simulation.piece_count(liver) == 1 ? 0 : 1;
    } catch (const Error& error) {
        std::cerr << error.what() << '\n';
        return 2;
    }
}
