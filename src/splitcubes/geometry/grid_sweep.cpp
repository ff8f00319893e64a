#include <splitcubes/geometry/grid_sweep.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace splitcubes::geometry {

namespace {

using Int = std::int64_t;
__extension__ using Wide = __int128;
using Lattice = Eigen::Matrix<Int, 3, 1>;

constexpr int lattice_bits = 20;
constexpr Int steps_per_cell = Int{1} << lattice_bits;
// Bound of lattice coordinates: products of three differences must fit in 127 bits.
constexpr double max_lattice = 0x1.0p38;

int sign_of(Wide value) {
    return value > 0 ? 1 : value < 0 ? -1 : 0;
}

// Returns the sign of `value` after the grid is shifted by (e1, e2, e3); `slope` is the
// derivative of the value along x, y and z.
int perturbed_sign(Wide value, const Wide (&slope)[3]) {
    if (value != 0) return sign_of(value);
    for (const Wide s : slope)
        if (s != 0) return sign_of(s);
    return 0;
}

// Returns on which side of the line from q to r, projected along `axis`, the point
// (pu, pv) lies: +1 left, -1 right; 0 only if q and r coincide there.
int edge_side(const Lattice& q, const Lattice& r, Int pu, Int pv, int axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const Wide du = r[u] - q[u];
    const Wide dv = r[v] - q[v];
    Wide slope[3] = {0, 0, 0};
    slope[u] = -dv;
    slope[v] = du;
    return perturbed_sign(du * (pv - q[v]) - dv * (pu - q[u]), slope);
}

struct Plane {
    Wide normal[3];
    Lattice point;

    Plane(const Lattice& a, const Lattice& b, const Lattice& c) : point(a) {
        const Lattice ab = b - a;
        const Lattice ac = c - a;
        for (int axis = 0; axis < 3; ++axis) {
            const int u = (axis + 1) % 3;
            const int v = (axis + 2) % 3;
            normal[axis] = Wide{ab[u]} * ac[v] - Wide{ab[v]} * ac[u];
        }
    }
    Wide at(const Lattice& p) const {
        return normal[0] * (p[0] - point[0]) + normal[1] * (p[1] - point[1]) + normal[2] * (p[2] - point[2]);
    }
    int side(const Lattice& p) const { return perturbed_sign(at(p), normal); }
};

Int lattice_of_node(int node) {
    return Int{node} << lattice_bits;
}

int first_node_at_or_after(Int lattice) {
    return static_cast<int>((lattice + steps_per_cell - 1) >> lattice_bits);
}

class Sweeper {
  public:
    Sweeper(const RestGrid& grid, GridCrossings& out) : grid_(grid), out_(out) {}

    void add_triangle(const Lattice (&corner)[3], std::uint32_t triangle) {
        const Plane plane(corner[0], corner[1], corner[2]);
        const Lattice low = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]);
        const Lattice high = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]);
        for (int axis = 0; axis < 3; ++axis) {
            const int direction = sign_of(plane.normal[axis]);
            if (direction != 0) add_lines(corner, plane, low, high, axis, direction, triangle);
        }
    }

  private:
    // Adds the lines of one family that cross the triangle. A line shifted by an
    // infinitesimal may meet a triangle that ends exactly at it, so the range is closed at
    // both ends and edge_side decides.
    void add_lines(const Lattice (&corner)[3], const Plane& plane, const Lattice& low, const Lattice& high,
                   int axis, int direction, std::uint32_t triangle) {
        const int u = (axis + 1) % 3;
        const int v = (axis + 2) % 3;
        const auto range = [&](int k) {
            const Int last = (high[k] >> lattice_bits);
            return std::pair<int, int>{std::max(0, first_node_at_or_after(std::max<Int>(low[k], 0))),
                                       static_cast<int>(std::min<Int>(last, grid_.node_count[k] - 1))};
        };
        const auto [u0, u1] = range(u);
        const auto [v0, v1] = range(v);
        for (int j = v0; j <= v1; ++j) {
            for (int i = u0; i <= u1; ++i) {
                const Int pu = lattice_of_node(i);
                const Int pv = lattice_of_node(j);
                bool inside = true;
                for (int k = 0; k < 3 && inside; ++k)
                    inside = edge_side(corner[k], corner[(k + 1) % 3], pu, pv, axis) == direction;
                if (inside) add_crossing(plane, axis, direction, i, j, triangle);
            }
        }
    }

    // Finds the edge of the line that the plane crosses: an estimate in double precision,
    // corrected by exact comparisons.
    void add_crossing(const Plane& plane, int axis, int direction, int i, int j, std::uint32_t triangle) {
        Lattice at;
        at[(axis + 1) % 3] = lattice_of_node(i);
        at[(axis + 2) % 3] = lattice_of_node(j);
        at[axis] = 0;
        const Wide base = plane.at(at);
        const Wide step = plane.normal[axis] << lattice_bits;
        const int last = grid_.node_count[axis] - 1;
        const double estimate = std::floor(-static_cast<double>(base) / static_cast<double>(step));
        int node = static_cast<int>(std::clamp(estimate, -1.0, static_cast<double>(last)));
        const auto beyond = [&](int k) {  // is node k past the crossing?
            at[axis] = lattice_of_node(k);
            return plane.side(at) == direction;
        };
        while (node >= 0 && beyond(node)) --node;
        while (node < last && !beyond(node + 1)) ++node;
        if (node < 0 || node >= last) {
            ++out_.beyond_grid;
            return;
        }
        EdgeCrossing crossing;
        crossing.node[axis] = node;
        crossing.node[(axis + 1) % 3] = i;
        crossing.node[(axis + 2) % 3] = j;
        crossing.axis = static_cast<std::int8_t>(axis);
        crossing.direction = static_cast<std::int8_t>(direction);
        const Wide at_node = base + step * node;
        crossing.parameter = std::clamp(-static_cast<double>(at_node) / static_cast<double>(step), 0.0, 1.0);
        crossing.triangle = triangle;
        out_.crossings.push_back(crossing);
    }

    const RestGrid& grid_;
    GridCrossings& out_;
};

// Clips a polygon (grid coordinates, in lattice steps) to the half space side * x_axis <=
// bound. The point where an edge is cut is computed from its ends in a fixed order, so
// that two triangles that share the edge share the point.
void clip_axis(std::vector<Vec3>& polygon, int axis, double bound, double side) {
    std::vector<Vec3> kept;
    const auto excess = [&](const Vec3& p) { return side * p[axis] - bound; };
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vec3& a = polygon[k];
        const Vec3& b = polygon[(k + 1) % polygon.size()];
        if (excess(a) <= 0) kept.push_back(a);
        if ((excess(a) <= 0) == (excess(b) <= 0)) continue;
        const bool ordered = std::tie(a[0], a[1], a[2]) < std::tie(b[0], b[1], b[2]);
        const Vec3& p = ordered ? a : b;
        const Vec3& q = ordered ? b : a;
        Vec3 cut = p + (q - p) * (excess(p) / (excess(p) - excess(q)));
        cut[axis] = side * bound;
        kept.push_back(cut);
    }
    polygon.swap(kept);
}

Lattice snap(const Vec3& steps) {
    return {static_cast<Int>(std::llround(steps[0])), static_cast<Int>(std::llround(steps[1])),
            static_cast<Int>(std::llround(steps[2]))};
}

void sweep_triangle(const RestGrid& grid, const TriangleMesh& mesh, std::uint32_t t, Sweeper& sweeper) {
    const double steps = static_cast<double>(steps_per_cell);
    Vec3 corner[3];
    double reach = 0;
    for (int k = 0; k < 3; ++k) {
        corner[k] = grid.to_grid(mesh.positions[mesh.triangles[t][static_cast<std::size_t>(k)]]) * steps;
        reach = std::max(reach, corner[k].cwiseAbs().maxCoeff());
    }
    if (reach <= max_lattice) {
        const Lattice snapped[3] = {snap(corner[0]), snap(corner[1]), snap(corner[2])};
        sweeper.add_triangle(snapped, t);
        return;
    }
    std::vector<Vec3> polygon(corner, corner + 3);
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) clip_axis(polygon, axis, max_lattice, side);
    for (std::size_t k = 2; k < polygon.size(); ++k) {
        const Lattice snapped[3] = {snap(polygon[0]), snap(polygon[k - 1]), snap(polygon[k])};
        sweeper.add_triangle(snapped, t);
    }
}

// Sorts by line with one counting pass, then each line separately.
void sort_by_line(const RestGrid& grid, const std::vector<GridCrossings>& parts, GridCrossings& out,
                  const Parallel& parallel) {
    const Vec3i n = grid.node_count;
    const auto lines_along = [&](int axis) {
        return static_cast<std::size_t>(n[(axis + 1) % 3]) * static_cast<std::size_t>(n[(axis + 2) % 3]);
    };
    const std::size_t first_line[4] = {0, lines_along(0), lines_along(0) + lines_along(1),
                                       lines_along(0) + lines_along(1) + lines_along(2)};
    const auto line_of = [&](const EdgeCrossing& c) {
        const int u = (c.axis + 1) % 3, v = (c.axis + 2) % 3;
        return first_line[c.axis] + static_cast<std::size_t>(c.node[v]) * static_cast<std::size_t>(n[u]) +
               static_cast<std::size_t>(c.node[u]);
    };
    std::vector<std::uint32_t> begin(first_line[3] + 1, 0);
    for (const GridCrossings& part : parts) {
        out.beyond_grid += part.beyond_grid;
        for (const EdgeCrossing& c : part.crossings) ++begin[line_of(c) + 1];
    }
    for (std::size_t line = 0; line < first_line[3]; ++line) begin[line + 1] += begin[line];
    out.crossings.resize(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (const GridCrossings& part : parts)
        for (const EdgeCrossing& c : part.crossings) out.crossings[next[line_of(c)]++] = c;
    parallel.for_each(first_line[3], 1024, [&](std::size_t line) {
        if (begin[line + 1] - begin[line] < 2) return;
        std::sort(out.crossings.begin() + begin[line], out.crossings.begin() + begin[line + 1],
                  [](const EdgeCrossing& a, const EdgeCrossing& b) {
                      return std::make_tuple(a.node[a.axis], a.parameter, a.triangle) <
                             std::make_tuple(b.node[b.axis], b.parameter, b.triangle);
                  });
    });
    for (std::size_t axis = 0; axis <= 3; ++axis) out.axis_begin[axis] = begin[first_line[axis]];
}

// Sorts few crossings without a pass over all lines of a large grid.
void sort_few(std::vector<GridCrossings>& parts, GridCrossings& out) {
    for (GridCrossings& part : parts) {
        out.beyond_grid += part.beyond_grid;
        out.crossings.insert(out.crossings.end(), part.crossings.begin(), part.crossings.end());
    }
    std::sort(out.crossings.begin(), out.crossings.end(), [](const EdgeCrossing& a, const EdgeCrossing& b) {
        const int u = (a.axis + 1) % 3, v = (a.axis + 2) % 3;
        if (a.axis != b.axis) return a.axis < b.axis;
        return std::make_tuple(a.node[v], a.node[u], a.node[a.axis], a.parameter, a.triangle) <
               std::make_tuple(b.node[v], b.node[u], b.node[b.axis], b.parameter, b.triangle);
    });
    for (int axis = 0; axis <= 3; ++axis)
        out.axis_begin[axis] = static_cast<std::size_t>(
            std::partition_point(out.crossings.begin(), out.crossings.end(),
                                 [axis](const EdgeCrossing& c) { return c.axis < axis; }) -
            out.crossings.begin());
}

}  // namespace

GridCrossings sweep_grid(const RestGrid& grid, const TriangleMesh& mesh, const Parallel& parallel) {
    constexpr std::size_t grain = 4096;
    std::vector<GridCrossings> parts((mesh.triangles.size() + grain - 1) / grain);
    parallel.for_chunks(mesh.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
        Sweeper sweeper(grid, parts[begin / grain]);
        for (std::size_t t = begin; t < end; ++t)
            sweep_triangle(grid, mesh, static_cast<std::uint32_t>(t), sweeper);
    });
    std::size_t count = 0;
    for (const GridCrossings& part : parts) count += part.crossings.size();
    GridCrossings out;
    const Vec3i n = grid.node_count;
    const std::size_t line_count = static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) +
                                   static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]) +
                                   static_cast<std::size_t>(n[2]) * static_cast<std::size_t>(n[0]);
    if (count < line_count / 4)
        sort_few(parts, out);
    else
        sort_by_line(grid, parts, out, parallel);
    return out;
}

Vec3 triangle_normal(const TriangleMesh& mesh, std::uint32_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    // Scales by the longest side first, so that the square of a tiny length does not
    // underflow.
    Vec3 ab = mesh.positions[t[1]] - mesh.positions[t[0]];
    Vec3 ac = mesh.positions[t[2]] - mesh.positions[t[0]];
    const double scale = std::max(ab.cwiseAbs().maxCoeff(), ac.cwiseAbs().maxCoeff());
    if (!(scale > 0)) return Vec3::Zero();
    ab /= scale;
    ac /= scale;
    const Vec3 normal = ab.cross(ac);
    const double length = normal.norm();
    return length > 0 ? Vec3(normal / length) : Vec3::Zero();
}

}  // namespace splitcubes::geometry
