// The surface that the cut edges of a NodeGrid make: a closed, oriented
// 2-manifold, whatever is cut, kept up to date cell by cell.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/affine_displacement.h>
#include <splitcubes/splitting/node_grid.h>
#include <splitcubes/splitting/table.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

/// What a vertex depends on and stands for.
enum class VertexKind : std::uint8_t { edge = 0, face = 1, centre = 2 };

/// A vertex of the surface. Never renumbered; a centre whose fan has merged with
/// another goes out of use.
struct SurfaceVertex {
    Vec3 rest;             // m, rest space
    Vec3f normal;          // unit, outward, rest space: mean over its quads
    Vec3i place;           // lower node of the edge, face or cell
    std::uint32_t cell;    // one that it lies in or on, whose corners carry it
    std::uint8_t corners;  // bit c: corner c of that cell carries it; 0: out of use
    VertexKind kind;
    std::uint8_t instance;  // edge: end; face: ring corner; centre: 16 * corner + edge of its first quad
    std::uint8_t axis;      // of the edge or of the face's normal; 0 for a centre

    bool alive() const { return corners != 0; }
};

/// The nodes that carry a vertex, with their trilinear weights, which sum to one.
struct Influences {
    std::array<std::uint32_t, 8> nodes;  // indices into Surface::nodes()
    std::array<double, 8> weights;
    std::size_t count = 0;  // 1..8
};

/// A quad (edge vertex, face vertex, centre, face vertex), counter-clockwise from
/// outside. Triangles: (v0, v1, v2) and (v0, v2, v3): always along the diagonal
/// from the edge vertex to the centre.
struct SurfaceQuad {
    std::array<std::uint32_t, 4> vertices;
    std::int32_t crossing;  // slot of the cut edge it belongs to
};

struct SurfaceCell {
    Vec3i place;  // lower corner's node
    CellMask mask = 0;
    std::uint8_t inside = 0;  // bit c: corner c is inside
    std::uint8_t quad_count = 0;
    std::uint8_t quad_capacity = 0;
    std::uint8_t fan_count = 0;
    std::uint32_t first_quad = 0;
    std::array<std::uint8_t, 8> fan_name;  // instance of each fan's centre vertex
    std::array<std::int32_t, 8> centre;    // vertex of each fan; -1: fan outside
    std::array<std::int32_t, 6> face;      // numbers of the faces that sheets cross; -1: none
    std::array<std::int32_t, 8> node;  // index into Surface::nodes() of each corner that carries; -1: none
};

/// Cells, faces, vertices and quads of a grid's surface.
class Surface {
  public:
    /// Builds from nothing: all cut edges that the grid has.
    explicit Surface(const NodeGrid& grid);
    /// The same; throws Cancelled where the monitor that watches `parallel` says so.
    Surface(const NodeGrid& grid, const Parallel& parallel);

    /// Takes in edges that were cut since: the cells around them are done again,
    /// nothing else is touched. Slots are of `grid`, which must be the same grid.
    /// Returns the cells (indices into cells()) that changed, in order of first touch.
    const std::vector<std::uint32_t>& retessellate(const NodeGrid& grid,
                                                   std::span<const std::int32_t> new_slots);

    const std::vector<SurfaceCell>& cells() const { return cells_; }
    const std::vector<SurfaceVertex>& vertices() const { return vertices_; }
    std::span<const SurfaceQuad> quads(const SurfaceCell& cell) const {
        return {quads_.data() + cell.first_quad, cell.quad_count};
    }
    /// Inside nodes that carry a vertex, in order of first use.
    const std::vector<Vec3i>& nodes() const { return nodes_; }
    Influences influences(const RestGrid& rest, const SurfaceVertex& vertex) const;
    /// Calls use(node, weight) for each node that carries a vertex, in the order of `carriers`, with
    /// weights that sum to what it returns.
    template <class Use>
    double visit_influences(const RestGrid& rest, const SurfaceVertex& vertex, const Use& use) const;
    /// One of the nodes that carry a vertex.
    const Vec3i& influence(const SurfaceVertex& vertex) const;
    std::size_t quad_count() const { return quad_count_; }
    std::size_t triangle_count() const { return 2 * quad_count_; }
    std::size_t vertex_count() const { return alive_count_; }
    std::size_t bytes() const;

    /// Counts the changes: whoever keeps something derived from the quads compares.
    std::uint64_t revision() const { return revision_; }

  private:
    struct Face {
        Vec2 position = Vec2::Zero();                        // by its own crossings; in the face, cells
        std::array<std::int32_t, 4> vertex{-1, -1, -1, -1};  // per instance
        std::uint8_t mask = 0;
        bool smooth = true;  // see FacePlacement
    };
    struct CellContext;

    Surface(const NodeGrid& grid, const Parallel* watched);
    void take_in(const NodeGrid& grid, std::span<const std::int32_t> new_slots, const Parallel* watched);
    std::uint32_t cell_at(const Vec3i& place);
    std::int32_t face_at(const Vec3i& place, int axis);
    void touch_cells_around(const NodeGrid& grid, const GridEdge& edge);
    std::uint32_t new_vertex(VertexKind kind, const Vec3i& place, int axis, int instance);
    void carry(SurfaceVertex& vertex, std::uint32_t cell, unsigned corners);

    void update_cell(const NodeGrid& grid, std::uint32_t cell);
    void update_face(const NodeGrid& grid, int face, const CellContext& context);
    void update_face_vertices(const NodeGrid& grid, int face, Face& record, const CellContext& context,
                              const std::array<const Crossing*, 4>& crossings);
    Vec3 place_group(const NodeGrid& grid, unsigned group, const CellContext& context) const;
    void update_fans(const NodeGrid& grid, const CellContext& context);
    void update_quads(const NodeGrid& grid, const CellContext& context);
    std::uint32_t edge_vertex(const NodeGrid& grid, std::int32_t slot, int corner, int end,
                              const CellContext& context);
    void reserve_quads(SurfaceCell& cell, std::size_t count);
    bool centre_of_face(const SurfaceCell& cell, int face, Vec3& centre) const;
    void settle_faces(const NodeGrid& grid, std::uint32_t cell);

    enum Channel { face_x = 0, face_y = 1, face_z = 2, cell_channel = 3, node_channel = 4 };
    SlotMap<5> slots_;
    std::vector<SurfaceCell> cells_;
    std::vector<Face> faces_;
    std::vector<std::array<std::int32_t, 2>> edge_vertices_;  // per crossing slot and end; -1: none
    std::vector<SurfaceVertex> vertices_;
    std::vector<SurfaceQuad> quads_;
    std::array<std::vector<std::uint32_t>, 25> free_quads_;  // per capacity: freed first quads
    std::vector<Vec3i> nodes_;
    std::vector<std::uint32_t> free_vertices_;
    std::vector<std::uint32_t> touched_;     // scratch of retessellate
    std::vector<std::uint64_t> cell_stamp_;  // per cell: last revision that touched it
    std::size_t quad_count_ = 0;
    std::size_t alive_count_ = 0;
    std::uint64_t revision_ = 0;
};

template <class Use>
double Surface::visit_influences(const RestGrid& rest, const SurfaceVertex& vertex, const Use& use) const {
    // Weights are taken a little inside the cell, so that a vertex at or beyond a corner still
    // has a weight for each node it depends on.
    constexpr double inset = 0.01;
    const SurfaceCell& cell = cells_[vertex.cell];
    const auto node = [&](int corner) {
        return static_cast<std::uint32_t>(cell.node[static_cast<std::size_t>(corner)]);
    };
    if (vertex.corners != 0 && (vertex.corners & (vertex.corners - 1U)) == 0) {
        use(node(std::countr_zero(vertex.corners)), 1.0);
        return 1;
    }
    // By numbers: vectors of three would be written and read again in parts of another size, and wait for
    // that.
    const auto along = [&](int axis) {
        const double at = (vertex.rest[axis] - rest.origin[axis]) / rest.cell_size - cell.place[axis];
        return std::min(std::max(at, inset), 1 - inset);
    };
    const double x = along(0), y = along(1), z = along(2);
    const double xy[4] = {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y};
    double total = 0;
    for (unsigned rest_of = vertex.corners; rest_of != 0; rest_of &= rest_of - 1) {
        const int c = std::countr_zero(rest_of);
        const double w = xy[c & 3] * (corner_bit(c, 2) ? z : 1 - z);
        use(node(c), w);
        total += w;
    }
    return total;
}

/// Moves the vertices: x(p) = sum_j a_j (x_j + J_j (p - b_j)) over the nodes b_j
/// that carry each. Both outputs are resized to vertices(); world frame; normals by the cofactor
/// of the mean Jacobian. motion: how each of surface.nodes() carries its surroundings.
void deform(const Surface& surface, const RestGrid& rest,
            std::span<const geometry::AffineDisplacement> motion, std::vector<Vec3>& positions,
            std::vector<Vec3>& normals, const Parallel& parallel);
/// The same by the frames of the nodes.
void deform(const Surface& surface, const RestGrid& rest, std::span<const geometry::Frame> frames,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel);

}  // namespace splitcubes::splitting
