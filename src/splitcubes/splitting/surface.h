// The surface of a NodeGrid's cut edges: a closed, oriented 2-manifold for any set of cut edges, updated cell
// by cell.
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
#include <unordered_map>
#include <vector>

namespace splitcubes::splitting {

struct CellCrossing;

/// Grid element that a vertex belongs to.
enum class VertexKind : std::uint8_t { edge = 0, face = 1, centre = 2 };

/// A vertex of the surface. Vertices are never renumbered; a centre vertex whose fan has merged with another
/// becomes unused.
struct SurfaceVertex {
    Vec3 rest;             // m, rest space
    Vec3f normal;          // unit, outward, rest space: mean over its quads
    Vec3i lowest_node;     // lower node of the edge, face or cell
    std::uint32_t cell;    // a cell that it lies in or on; its corners move the vertex
    std::uint8_t corners;  // bit c: corner c of that cell moves it; 0: unused
    VertexKind kind;
    std::uint8_t instance;  // edge: end; face: ring corner; centre: 16 * corner + edge of its first quad
    std::uint8_t axis;      // of the edge or of the face's normal; 0 for a centre vertex

    bool alive() const { return corners != 0; }
};

/// The nodes that move a vertex, with their trilinear weights, which sum to one.
struct Influences {
    std::array<std::uint32_t, 8> nodes;  // indices into Surface::nodes()
    std::array<double, 8> weights;
    std::size_t count = 0;  // 1..8
};

/// A quad (edge vertex, face vertex, centre, face vertex), counter-clockwise from outside. Its triangles are
/// (v0, v1, v2) and (v0, v2, v3), always split along the diagonal from the edge vertex to the centre.
struct SurfaceQuad {
    std::array<std::uint32_t, 4> vertices;
    std::int32_t crossing;  // slot of its cut edge
};

struct SurfaceCell {
    Vec3i lowest_node;  // lowest corner's node
    CellMask mask = 0;
    std::uint8_t inside = 0;  // bit c: corner c is inside
    std::uint8_t quad_count = 0;
    std::uint8_t quad_capacity = 0;
    std::uint8_t fan_count = 0;
    std::uint32_t first_quad = 0;
    std::array<std::uint8_t, 8> fan_name;  // instance of each fan's centre vertex
    std::array<std::int32_t, 8> centre;    // vertex of each fan; -1: fan outside
    std::array<std::int32_t, 6> face;      // indices of the faces that sheets cross; -1: none
    std::array<std::int32_t, 8>
        node;  // index into Surface::nodes() of each corner that moves a vertex; -1: none
};

/// Cells, faces, vertices and quads of a grid's surface.
class Surface {
  public:
    /// Builds the surface of all cut edges of the grid.
    explicit Surface(const NodeGrid& grid);
    /// The same; throws Cancelled where the monitor that watches `parallel` says so.
    Surface(const NodeGrid& grid, const Parallel& parallel);

    /// Adds edges that were cut since the last update, and moves fronts of earlier cuts: rebuilds the cells
    /// around them and touches nothing else. Both are of `grid`, which must be the same grid. Returns the
    /// changed cells (indices into cells()), in order of first touch.
    const std::vector<std::uint32_t>& retessellate(const NodeGrid& grid,
                                                   std::span<const std::int32_t> new_slots,
                                                   std::span<const CutFront> moved_fronts = {});

    /// Returns the result of the last retessellate.
    const std::vector<std::uint32_t>& changed_cells() const { return touched_; }
    /// Returns the number of quad slots, used or not; SurfaceCell::first_quad and its quads lie below it.
    std::size_t quad_slot_count() const { return quads_.size(); }

    const std::vector<SurfaceCell>& cells() const { return cells_; }
    /// Returns the index of the cell with this lowest node, which is in the grid; -1 if it has no surface.
    std::int32_t find_cell(const Vec3i& lowest_node) const { return slots_.get(lowest_node, cell_channel); }
    const std::vector<SurfaceVertex>& vertices() const { return vertices_; }
    std::span<const SurfaceQuad> quads(const SurfaceCell& cell) const {
        return {quads_.data() + cell.first_quad, cell.quad_count};
    }
    /// Returns the inside nodes that move a vertex, in order of first use.
    const std::vector<Vec3i>& nodes() const { return nodes_; }
    Influences influences(const RestGrid& rest, const SurfaceVertex& vertex) const;
    /// Calls use(node, weight) for each node that moves a vertex, in the order of `influences`. Returns the
    /// sum of the weights.
    template <class Use>
    double visit_influences(const RestGrid& rest, const SurfaceVertex& vertex, const Use& use) const;
    /// Returns one of the nodes that move a vertex.
    const Vec3i& influence(const SurfaceVertex& vertex) const;
    std::size_t quad_count() const { return quad_count_; }
    std::size_t triangle_count() const { return 2 * quad_count_; }
    std::size_t vertex_count() const { return alive_count_; }
    std::size_t bytes() const;

    /// Returns the number of changes so far; caches of data derived from the quads compare it.
    std::uint64_t revision() const { return revision_; }

  private:
    struct Face {
        Vec2 position = Vec2::Zero();                        // from its own crossings; in the face, cells
        std::array<std::int32_t, 4> vertex{-1, -1, -1, -1};  // per instance
        std::uint8_t mask = 0;
        std::uint8_t front = 0;  // of its only crossing; 0: not known, or there are more
        bool smooth = true;      // see FacePlacement
    };
    struct CellContext;
    struct Choice;
    struct Cone {
        double least = 0, settled = 0;
    };

    Surface(const NodeGrid& grid, const Parallel* watched);
    void take_in(const NodeGrid& grid, std::span<const std::int32_t> new_slots,
                 std::span<const CutFront> moved_fronts, const Parallel* watched);
    std::uint32_t cell_at(const Vec3i& node);
    std::int32_t face_at(const Vec3i& node, int axis);
    void touch_cells_around(const NodeGrid& grid, const GridEdge& edge);
    void touch_cells_beside(const NodeGrid& grid, const GridFace& face);
    std::uint32_t new_vertex(VertexKind kind, const Vec3i& node, int axis, int instance);
    void set_nodes(SurfaceVertex& vertex, std::uint32_t cell, unsigned corners);

    void update_cell(const NodeGrid& grid, std::uint32_t cell);
    void update_face(const NodeGrid& grid, int face, const CellContext& context);
    void move_face(const NodeGrid& grid, const GridFace& face, const Face& record);
    void update_face_vertices(const NodeGrid& grid, int face, Face& record, const CellContext& context,
                              const std::array<const Crossing*, 4>& crossings);
    unsigned faces_that_place(const CellContext& context, unsigned faces,
                              std::span<const CellCrossing> crossings) const;
    Vec3 place_group(const NodeGrid& grid, unsigned group, const CellContext& context) const;
    static Vec3 within_boundary(const NodeGrid& grid, const Vec3i& origin, Vec3i low, Vec3i high,
                                const Vec3& point, const Vec3& inner, bool is_rim);
    void update_fans(const NodeGrid& grid, const CellContext& context);
    void update_quads(const NodeGrid& grid, const CellContext& context);
    std::uint32_t edge_vertex(const NodeGrid& grid, std::int32_t slot, int corner, int end,
                              const CellContext& context);
    void reserve_quads(SurfaceCell& cell, std::size_t count);
    bool centre_of_face(const SurfaceCell& cell, int face, Vec3& centre) const;
    void settle_faces(const NodeGrid& grid, std::uint32_t cell);
    void touch(std::uint32_t cell);

    Vec3 wanted_rest(std::int32_t vertex) const;
    void place(std::int32_t vertex, const Vec3& rest);
    Choice face_choice(const RestGrid& rest, const SurfaceCell& cell, int face) const;
    Choice centre_choice(const RestGrid& rest, const SurfaceCell& cell, int fan) const;
    bool others_are_weak(const SurfaceCell& cell, unsigned corners, const std::vector<Vec3i>& own) const;
    Cone cone(const NodeGrid& grid, const Vec3i& lowest, int corner, int axis, double share, bool all_move,
              const std::vector<Vec3i>& own) const;
    bool stays_positive(const NodeGrid& grid, const std::vector<Vec3i>& nodes, double share,
                        bool all_move) const;
    bool settle(const RestGrid& rest, const SurfaceCell& cell, std::int32_t vertex, double share,
                const Choice& choice);
    void settle_cell(const NodeGrid& grid, std::uint32_t cell);
    void set_piece_state(const NodeGrid& grid, const std::vector<Vec3i>& nodes, std::uint8_t state,
                         std::uint64_t stamp, std::vector<std::uint32_t>& cells);
    void settle_small_pieces(const NodeGrid& grid);

    enum Channel { face_x = 0, face_y = 1, face_z = 2, cell_channel = 3, node_channel = 4 };
    SlotMap<5> slots_;
    std::vector<SurfaceCell> cells_;
    std::vector<Face> faces_;
    std::vector<std::array<std::int32_t, 2>> edge_vertices_;  // per crossing slot and end; -1: none
    std::vector<SurfaceVertex> vertices_;
    std::vector<SurfaceQuad> quads_;
    std::array<std::vector<std::uint32_t>, 25> free_quads_;  // per capacity: first quads of freed ranges
    std::vector<Vec3i> nodes_;
    std::vector<std::uint32_t> free_vertices_;
    std::vector<std::uint32_t> touched_;             // scratch of retessellate
    std::vector<std::uint64_t> cell_stamp_;          // per cell: last revision that touched it
    std::unordered_map<std::int32_t, Vec3> wanted_;  // of moved vertices: where they would lie, m
    std::vector<std::uint8_t> piece_state_;          // per node: state of its piece
    std::vector<std::uint64_t> piece_stamp_;         // scratch of settle_small_pieces, per node
    std::size_t quad_count_ = 0;
    std::size_t alive_count_ = 0;
    std::uint64_t revision_ = 0;
};

template <class Use>
double Surface::visit_influences(const RestGrid& rest, const SurfaceVertex& vertex, const Use& use) const {
    // Weights are taken slightly inside the cell, so that a vertex at or beyond a corner still has a weight
    // for each node that moves it.
    constexpr double inset = 0.01;
    const SurfaceCell& cell = cells_[vertex.cell];
    const auto node = [&](int corner) {
        return static_cast<std::uint32_t>(cell.node[static_cast<std::size_t>(corner)]);
    };
    if (vertex.corners != 0 && (vertex.corners & (vertex.corners - 1U)) == 0) {
        use(node(std::countr_zero(vertex.corners)), 1.0);
        return 1;
    }
    // Scalars instead of vectors: storing and reloading a vector of three in parts of another size stalls.
    const auto along = [&](int axis) {
        const double at = (vertex.rest[axis] - rest.origin[axis]) / rest.cell_size - cell.lowest_node[axis];
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

/// Moves the vertices: x(p) = sum_j a_j (x_j + J_j (p - b_j)) over the nodes b_j of each. Both outputs are
/// resized to vertices(); world frame; normals are transformed by the cofactor of the mean Jacobian. motion:
/// affine motion of each of surface.nodes().
void deform(const Surface& surface, const RestGrid& rest,
            std::span<const geometry::AffineDisplacement> motion, std::vector<Vec3>& positions,
            std::vector<Vec3>& normals, const Parallel& parallel);
/// Does the same with the frames of the nodes.
void deform(const Surface& surface, const RestGrid& rest, std::span<const geometry::Frame> frames,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel);

}  // namespace splitcubes::splitting
