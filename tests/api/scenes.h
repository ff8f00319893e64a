// Things to simulate through the public interface.
#pragma once

#include <splitcubes/api/simulation.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::api_tests {

/// A box about the origin as plain arrays.
struct BoxMesh {
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles;

    explicit BoxMesh(double x, double y, double z) {
        for (int c = 0; c < 8; ++c)
            for (int axis = 0; axis < 3; ++axis)
                positions.push_back((c >> axis & 1 ? 0.5 : -0.5) *
                                    std::array{x, y, z}[static_cast<std::size_t>(axis)]);
        triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                     2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    }
    MeshView view() const { return {positions, triangles}; }
};

/// The square of half the side `half` in the plane x = 0.
struct SheetMesh {
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles = {0, 1, 2, 0, 2, 3};

    explicit SheetMesh(double half, double x = 0)
        : positions({x, -half, -half, x, half, -half, x, half, half, x, -half, half}) {}
    MeshView view() const { return {positions, triangles}; }
};

inline BodySettings soft_block() {
    BodySettings out;
    out.name = "block";
    out.cell_size = 0.02;
    out.phyxel_count = 100;
    out.material.youngs_modulus = 2e4;
    out.material.cutting_resistance = 20;
    return out;
}

inline SimulationSettings in_free_space() {
    SimulationSettings out;
    out.gravity = {};
    out.thread_count = 2;
    return out;
}

/// An edge along y, 0.6 m long.
inline const std::array<Vector3, 2> edge_along_y{Vector3{0, -0.3, 0}, Vector3{0, 0.3, 0}};

/// Goes down through a block about the origin, at `x`, within `steps` steps.
template <class EachStep>
void cut_through(Simulation& simulation, ToolId tool, double x, int steps, const EachStep& each_step) {
    for (int k = 1; k <= steps; ++k) {
        const double share = static_cast<double>(k) / steps;
        simulation.add_tool_pose(tool, simulation.time() + simulation.time_step(),
                                 {{x, 0, 0.2 - 0.4 * share}, {}});
        each_step(simulation.step());
    }
    each_step(simulation.step());  // the mark of the last interval
}
inline void cut_through(Simulation& simulation, ToolId tool, double x, int steps) {
    cut_through(simulation, tool, x, steps, [](const StepResult&) {});
}

/// A kind of error, or that there was none.
template <class Call>
int kind_of_error(const Call& call) {
    try {
        call();
    } catch (const Error& error) {
        return static_cast<int>(error.kind());
    }
    return -1;
}

}  // namespace splitcubes::api_tests
