// Keeps a copy of a surface, as a vertex buffer on a GPU is one, by patching what each step changed.
#include <splitcubes/api/simulation.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <vector>

using namespace splitcubes;

namespace {

// In a program: a buffer of the graphics interface, written by glBufferSubData or the like.
struct Buffers {
    std::vector<float> positions;          // rewritten each frame: everything moves
    std::vector<std::uint32_t> triangles;  // patched
    std::uint64_t revision = 0;
    std::size_t written = 0;  // triangles

    void update(const SurfaceView& surface) {
        positions.assign(surface.positions.begin(), surface.positions.end());
        if (surface.revision == revision) return;
        triangles.resize(surface.triangles.size());  // grows at times: a new buffer then, the old one copied
        if (surface.revision == revision + 1) {
            for (const Range& range : surface.changed_triangles) copy(surface, range);
        } else {  // the first time, or a change was missed
            copy(surface, {0, static_cast<std::uint32_t>(surface.triangle_slots())});
        }
        revision = surface.revision;
    }
    void copy(const SurfaceView& surface, const Range& range) {
        std::copy_n(surface.triangles.begin() + 3 * std::ptrdiff_t{range.first}, 3 * std::size_t{range.count},
                    triangles.begin() + 3 * std::ptrdiff_t{range.first});
        written += range.count;
    }
};

}  // namespace

int main(int argc, char** argv) {
    const std::string meshes = argc > 1 ? argv[1] : "scenes/meshes";
    try {
        Simulation simulation({.gravity = {0, 0, 0}});
        const BodyId pear = simulation.add_body(meshes + "/pear.obj", {.name = "pear", .cells = 48});
        const std::array<Vector3, 2> edge{Vector3{0, -1, 0}, Vector3{0, 1, 0}};
        const ToolId knife = simulation.add_tool({edge}, {.pose = {{0.3, 0, 0}, {}}});
        simulation.lower_tool(knife);

        Buffers buffers;
        buffers.update(simulation.surface(pear));
        const std::size_t at_start = buffers.written;
        for (int frame = 1; frame <= 60; ++frame) {
            const double time = simulation.time() + simulation.time_step();
            simulation.add_tool_pose(knife, time, {{0.3 - 0.01 * frame, 0, 0}, {}});
            simulation.step();
            buffers.update(simulation.surface(pear));
        }

        const SurfaceView whole = simulation.surface(pear);
        const bool equal = std::ranges::equal(buffers.triangles, whole.triangles) &&
                           std::ranges::equal(buffers.positions, whole.positions);
        std::cout << simulation.piece_count(pear) << " pieces, " << whole.triangle_slots()
                  << " triangle slots; " << buffers.written - at_start
                  << " triangles patched in 60 frames; the copy is " << (equal ? "equal" : "NOT equal")
                  << '\n';
        return equal && simulation.piece_count(pear) > 1 ? 0 : 1;
    } catch (const Error& error) {
        std::cerr << error.what() << '\n';
        return 2;
    }
}
