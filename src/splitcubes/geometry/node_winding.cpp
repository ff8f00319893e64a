#include <splitcubes/core/error.h>
#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/geometry/node_winding.h>
#include <splitcubes/geometry/winding_number.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace splitcubes::geometry {

namespace {

// Range in cells within which sweep_grid keeps triangles unclipped, less one.
constexpr double whole_reach = 0x1.0p18 - 1;

void check_mesh_is_sound(const TriangleMesh& mesh) {
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            if (v >= mesh.positions.size() || !mesh.positions[v].allFinite())
                throw InputError("closed mesh", "vertex " + std::to_string(v) + " is missing or not finite");
}

// Changes of the winding number along grid lines: the number at the next node is that of the last minus the
// directions of the crossings between.
class Steps {
  public:
    Steps(const RestGrid& grid, const TriangleMesh& mesh)
        : count_(grid.node_count), sweep_(sweep_grid(grid, mesh)) {
        columns_.assign(static_cast<std::size_t>(count_[1]) * static_cast<std::size_t>(count_[2]), 0);
        // Along z at x = y = 0, then along y from there at x = 0.
        std::vector<int> up(static_cast<std::size_t>(count_[2]), 0), over(columns_.size(), 0);
        for_axis(2, [&](const EdgeCrossing& c) {
            if (c.node[0] == 0 && c.node[1] == 0) up[static_cast<std::size_t>(c.node[2]) + 1] -= c.direction;
        });
        for_axis(1, [&](const EdgeCrossing& c) {
            if (c.node[0] == 0) over[index(c.node[1] + 1, c.node[2])] -= c.direction;
        });
        std::partial_sum(up.begin(), up.end(), up.begin());
        for (int z = 0; z < count_[2]; ++z) {
            int winding = up[static_cast<std::size_t>(z)];
            for (int y = 0; y < count_[1]; ++y) columns_[index(y, z)] = winding += over[index(y, z)];
        }
    }

    // Returns the winding number of node (0, y, z) less that of node (0, 0, 0).
    int at(int y, int z) const { return columns_[index(y, z)]; }

    // Returns the winding number of any node less that of node (0, 0, 0). Slow.
    int at(const Vec3i& node) const {
        int winding = at(node[1], node[2]);
        for_axis(0, [&](const EdgeCrossing& c) {
            if (c.node[1] == node[1] && c.node[2] == node[2] && c.node[0] < node[0]) winding -= c.direction;
        });
        return winding;
    }

    std::vector<WindingRun> runs(int at_first_node) const {
        std::vector<WindingRun> out;
        std::size_t k = sweep_.axis_begin[0];
        for (int z = 0; z < count_[2]; ++z)
            for (int y = 0; y < count_[1]; ++y) {
                int winding = at_first_node + at(y, z), first = 0;
                const auto end_run = [&](int last) {
                    if (winding != 0 && last > first) out.push_back({y, z, first, last, winding});
                    first = last;
                };
                for (; k < sweep_.axis_begin[1] && sweep_.crossings[k].node[1] == y &&
                       sweep_.crossings[k].node[2] == z;
                     ++k) {
                    end_run(sweep_.crossings[k].node[0] + 1);
                    winding -= sweep_.crossings[k].direction;
                }
                end_run(count_[0]);
            }
        return out;
    }

  private:
    std::size_t index(int y, int z) const {
        return static_cast<std::size_t>(y) +
               static_cast<std::size_t>(count_[1]) * static_cast<std::size_t>(z);
    }
    template <class Visit>
    void for_axis(std::size_t axis, const Visit& visit) const {
        for (std::size_t k = sweep_.axis_begin[axis]; k < sweep_.axis_begin[axis + 1]; ++k)
            visit(sweep_.crossings[k]);
    }

    Vec3i count_;
    GridCrossings sweep_;
    std::vector<int> columns_;
};

// Sums all crossings of the line along x from node (0, 0, 0) onward; beyond them the number is zero. Uses the
// origin and cells of the sweep of the whole grid, and so the same lattice.
int by_ray(const RestGrid& grid, const TriangleMesh& mesh) {
    RestGrid line = grid;
    const double reach = std::max(0.0, grid.to_grid(mesh.bounds().max)[0]);
    line.node_count = {static_cast<int>(reach) + 3, 1, 1};
    const GridCrossings sweep = sweep_grid(line, mesh);
    int winding = 0;
    for (std::size_t k = sweep.axis_begin[0]; k < sweep.axis_begin[1]; ++k)
        winding += sweep.crossings[k].direction;
    return winding;
}

// Uses the solid angles at the corner of the grid where they come closest to an integer: other corners may
// lie on the mesh.
int by_solid_angle(const RestGrid& grid, const TriangleMesh& mesh, const Steps& steps) {
    const WindingNumber winding(mesh);
    double min_deviation = 2;
    int out = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3i node = Vec3i::Zero();
        for (int axis = 0; axis < 3; ++axis)
            if (corner >> axis & 1) node[axis] = grid.node_count[axis] - 1;
        const double value = winding.exact_at(grid.node_position(node));
        const double deviation = std::abs(value - std::round(value));
        if (deviation >= min_deviation) continue;
        min_deviation = deviation;
        out = static_cast<int>(std::round(value)) - steps.at(node);
    }
    return out;
}

}  // namespace

std::vector<WindingRun> node_windings(const RestGrid& grid, const TriangleMesh& closed) {
    check_mesh_is_sound(closed);
    if (closed.triangles.empty()) return {};
    const Steps steps(grid, closed);
    const Box box = closed.bounds();
    const double reach =
        std::max(grid.to_grid(box.min).cwiseAbs().maxCoeff(), grid.to_grid(box.max).cwiseAbs().maxCoeff());
    return steps.runs(reach < whole_reach ? by_ray(grid, closed) : by_solid_angle(grid, closed, steps));
}

}  // namespace splitcubes::geometry
