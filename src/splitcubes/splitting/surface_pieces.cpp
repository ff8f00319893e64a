// Positions of the vertices of small pieces. Where sheets meet, vertices may lie outside their face or cell,
// and a piece of a few nodes may turn inside out. Such a piece has all its vertices moved towards positions
// within their faces and cells, where its volume is positive, as far as that needs.
//
// The volume of a piece is a sum over its nodes n, the edges e at n, whole or cut, and the cells c around e.
// Each term is the cone from n to the part of the edge's dual face in c: t / 3 times the area of that part,
// projected along e. t is the distance from n to the vertex on e, or half of a whole edge. The parts of a
// dual face fit together at points that both ends share, so the terms add up to the volume. With vertices in
// their faces and cells no term is negative. A term is linear in each vertex, so of all positions on the ways
// of its vertices it is smallest at an end of each. The sum of these smallest terms is a lower bound.
//
// A piece is weak if its volume may not be positive for some positions of all its vertices on their ways. It
// moves its vertices so far that its volume is positive wherever other weak pieces move those that they
// share. Both depend on the piece and its neighbours alone, so the order of cuts does not matter.
#include <splitcubes/splitting/small_piece.h>
#include <splitcubes/splitting/surface.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::splitting {

namespace {

// State of the piece of a node: whether it is weak, and how far its vertices are moved, in levels.
constexpr std::uint8_t is_weak = 128, level_bits = 127;
constexpr int max_level = 21;

// Returns the share of the way that vertices are moved: 0, then 2^-20 to 1.
double share_of(int level) {
    return level == 0 ? 0 : std::ldexp(1.0, level - max_level);
}

double cross(const Vec2& a, const Vec2& b) {
    return a[0] * b[1] - a[1] * b[0];
}

unsigned face_corners_of(int face) {
    unsigned out = 0;
    for (int k = 0; k < 4; ++k) out |= 1U << face_corner(face, k);
    return out;
}

Vec3 into_cell(const Vec3& in_cell) {
    constexpr double inset = tuning::placement::settled_inset;
    return in_cell.cwiseMax(inset).cwiseMin(1 - inset);
}

int ring_corner(int face, int corner) {
    for (int k = 0; k < 4; ++k)
        if (face_corner(face, k) == corner) return k;
    return -1;
}

// Returns the fan that touches the vertex of a face by which `corner` is bounded; -1 if the face is whole.
int fan_at(CellMask mask, int face, int corner) {
    const Table& table = Table::get();
    const unsigned ring = face_mask(mask, face);
    if (ring == 0) return -1;
    const std::uint8_t instance =
        table.face(ring).instance[static_cast<std::size_t>(ring_corner(face, corner))];
    for (const TableQuad& quad : table.quads(mask))
        if ((quad.first_face == face && quad.first_instance == instance) ||
            (quad.second_face == face && quad.second_instance == instance))
            return quad.fan;
    return -1;
}

}  // namespace

// A vertex, relative to its cell's lowest corner, in cells: where it is wanted, and the end of its way, in
// its face or cell.
struct Surface::Choice {
    Vec3 wanted = Vec3::Constant(0.5);
    Vec3 settled = Vec3::Constant(0.5);

    /// Returns a point on the way between both; at 0 the wanted one, to the last bit.
    Vec3 at(double share) const {
        return share == 0 ? wanted : share == 1 ? settled : Vec3(wanted + share * (settled - wanted));
    }
};

Vec3 Surface::wanted_rest(std::int32_t vertex) const {
    const auto moved = wanted_.find(vertex);
    return moved != wanted_.end() ? moved->second : vertices_[static_cast<std::size_t>(vertex)].rest;
}

void Surface::place(std::int32_t vertex, const Vec3& rest) {
    wanted_.erase(vertex);
    vertices_[static_cast<std::size_t>(vertex)].rest = rest;
}

Surface::Choice Surface::face_choice(const RestGrid& rest, const SurfaceCell& cell, int face) const {
    Choice out;
    const int axis = face_axis(face), u = (axis + 1) % 3, v = (axis + 2) % 3;
    out.wanted[axis] = out.settled[axis] = face & 1;
    const std::int32_t index = cell.face[static_cast<std::size_t>(face)];
    if (index < 0 || face_mask(cell.mask, face) == 0) return out;
    const Face& record = faces_[static_cast<std::size_t>(index)];
    const Vec3 own = into_cell(Vec3(0.5, record.position[0], record.position[1]));
    out.settled[u] = own[1];
    out.settled[v] = own[2];
    const auto vertex =
        std::find_if(record.vertex.begin(), record.vertex.end(), [](std::int32_t k) { return k >= 0; });
    out.wanted = vertex == record.vertex.end()
                     ? out.settled
                     : Vec3(rest.to_grid(wanted_rest(*vertex)) - cell.lowest_node.cast<double>());
    return out;
}

Surface::Choice Surface::centre_choice(const RestGrid& rest, const SurfaceCell& cell, int fan) const {
    Choice out;
    if (fan < 0) return out;
    const std::int32_t vertex = cell.centre[static_cast<std::size_t>(fan)];
    if (vertex < 0) return out;
    out.wanted = rest.to_grid(wanted_rest(vertex)) - cell.lowest_node.cast<double>();
    // Several sheets in a cell have one common point inside every dual face: the middle of the cell.
    if (Table::get().cell(cell.mask).group_count == 1) out.settled = into_cell(out.wanted);
    return out;
}

namespace {

// A vertex as an edge sees it, along the edge and with the node as origin.
struct Projected {
    Vec2 own;      // where its piece moves it
    Vec2 settled;  // the end of its way
    Vec2 other;    // the end of its way if others may move it, else as `own`
};

// Part of a dual face between a face (k = 0, 1 in the order around the edge) and the middle of the cell.
double part_area(int k, const Vec2& face, const Vec2& centre) {
    const Vec2 middle(0.5, 0.5);
    return k == 0 ? cross(face, centre) + cross(centre, middle) : cross(centre, face) + cross(middle, centre);
}

double least_part_area(int k, const Projected& face, const Vec2& centre) {
    return std::min(part_area(k, face.own, centre), part_area(k, face.other, centre));
}

}  // namespace

// Returns whether a corner of the cell belongs to a weak piece other than that of the nodes `own`.
bool Surface::others_are_weak(const SurfaceCell& cell, unsigned corners,
                              const std::vector<Vec3i>& own) const {
    for (; corners != 0; corners &= corners - 1) {
        const int corner = std::countr_zero(corners);
        const std::int32_t node = cell.node[static_cast<std::size_t>(corner)];
        if (node < 0 || !(piece_state_[static_cast<std::size_t>(node)] & is_weak)) continue;
        if (std::find(own.begin(), own.end(), corner_node(cell.lowest_node, corner)) == own.end())
            return true;
    }
    return false;
}

// Returns the terms of the edge along `axis` at a corner of a cell, whose node belongs to the piece `own`;
// cells^3. share: of the way that the piece moves its vertices; all_move: others may move all of them.
Surface::Cone Surface::cone(const NodeGrid& grid, const Vec3i& lowest, int corner, int axis, double share,
                            bool all_move, const std::vector<Vec3i>& own) const {
    const std::int32_t slot = slots_.get(lowest, cell_channel);
    const SurfaceCell none{};
    const SurfaceCell& cell = slot < 0 ? none : cells_[static_cast<std::size_t>(slot)];
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    GridEdge edge{corner_node(lowest, corner), axis};
    const bool from_upper = corner_bit(corner, axis);
    if (from_upper) --edge.node[axis];
    double t = 0.5;
    if (const std::int32_t crossing = grid.slot(edge); crossing >= 0) {
        t = grid.crossing(crossing).parameter;
        if (from_upper) t = 1 - t;
    }
    // Along the edge, with the corner as origin, cells lie in the first quadrant.
    const auto project = [&](const Vec3& p) {
        return Vec2(corner_bit(corner, u) ? 1 - p[u] : p[u], corner_bit(corner, v) ? 1 - p[v] : p[v]);
    };
    const auto projected = [&](const Choice& c, unsigned corners) {
        const bool moves = all_move || (slot >= 0 && others_are_weak(cell, corners, own));
        const Vec2 own_position = project(c.at(share));
        return Projected{own_position, project(c.settled), moves ? project(c.settled) : own_position};
    };
    // The face beside the edge in direction u is normal to v.
    const int faces[2] = {2 * v + corner_bit(corner, v), 2 * u + corner_bit(corner, u)};
    int fans[2];
    Projected face[2], centre[2];
    Cone out;
    for (int k = 0; k < 2; ++k) {
        fans[k] = slot < 0 ? -1 : fan_at(cell.mask, faces[k], corner);
        face[k] = projected(face_choice(grid.rest(), cell, faces[k]), face_corners_of(faces[k]));
        centre[k] = projected(centre_choice(grid.rest(), cell, fans[k]), 0xff);
        out.settled += t / 6 * part_area(k, face[k].settled, centre[k].settled);
    }
    const auto least = [&](int k, const Vec2& at) { return least_part_area(k, face[k], at); };
    const double sum = fans[0] == fans[1] ? std::min(least(0, centre[0].own) + least(1, centre[0].own),
                                                     least(0, centre[0].other) + least(1, centre[0].other))
                                          : std::min(least(0, centre[0].own), least(0, centre[0].other)) +
                                                std::min(least(1, centre[1].own), least(1, centre[1].other));
    out.least = t / 6 * sum;
    return out;
}

// Returns whether the volume of a piece that moves its vertices by a share of their ways is positive, however
// far others move those that they may move.
bool Surface::stays_positive(const NodeGrid& grid, const std::vector<Vec3i>& nodes, double share,
                             bool all_move) const {
    Cone sum;
    for (const Vec3i& node : nodes)
        for (int corner = 0; corner < corner_count; ++corner) {
            const Vec3i lowest = 2 * node - corner_node(node, corner);
            if (!grid.has_cell(lowest)) continue;
            for (int axis = 0; axis < 3; ++axis) {
                const Cone one = cone(grid, lowest, corner, axis, share, all_move, nodes);
                sum.least += one.least;
                sum.settled += one.settled;
            }
        }
    return sum.least > tuning::placement::least_share * sum.settled;
}

// Places a vertex where it is wanted, or moves it from there. Returns whether its position changed.
bool Surface::settle(const RestGrid& rest, const SurfaceCell& cell, std::int32_t vertex, double share,
                     const Choice& choice) {
    const Vec3 wanted = wanted_rest(vertex);
    SurfaceVertex& v = vertices_[static_cast<std::size_t>(vertex)];
    const Vec3 before = v.rest;
    place(vertex, wanted);
    if (share > 0) {
        // The same from both cells of a face, to the last bit.
        const Vec3 settled =
            rest.origin + rest.cell_size * (cell.lowest_node.cast<double>() + choice.settled);
        v.rest = share == 1 ? settled : Vec3(wanted + share * (settled - wanted));
        wanted_.emplace(vertex, wanted);
    }
    return v.rest != before;
}

// Moves the vertices of a cell as far as the pieces of the corners around them need, and back otherwise.
void Surface::settle_cell(const NodeGrid& grid, std::uint32_t index) {
    const SurfaceCell& cell = cells_[index];
    const auto share = [&](unsigned corners) {
        int level = 0;
        for (; corners != 0; corners &= corners - 1) {
            const std::int32_t node = cell.node[static_cast<std::size_t>(std::countr_zero(corners))];
            if (node >= 0) level = std::max(level, piece_state_[static_cast<std::size_t>(node)] & level_bits);
        }
        return share_of(level);
    };
    const double cell_share = share(0xff);
    if (cell_share == 0 && wanted_.empty()) return;
    for (std::size_t fan = 0; fan < cell.fan_count; ++fan)
        if (cell.centre[fan] >= 0 && settle(grid.rest(), cell, cell.centre[fan], cell_share,
                                            centre_choice(grid.rest(), cell, static_cast<int>(fan))))
            touch(index);
    for (int face = 0; face < face_count; ++face) {
        const std::int32_t slot = cell.face[static_cast<std::size_t>(face)];
        if (slot < 0) continue;
        const double face_share = share(face_corners_of(face));
        const Choice choice = face_choice(grid.rest(), cell, face);
        bool moved = false;
        for (const std::int32_t vertex : faces_[static_cast<std::size_t>(slot)].vertex)
            if (vertex >= 0) moved = settle(grid.rest(), cell, vertex, face_share, choice) || moved;
        if (!moved) continue;
        touch(index);
        Vec3i other = cell.lowest_node;
        other[face_axis(face)] += face & 1 ? 1 : -1;
        if (!grid.has_cell(other)) continue;
        if (const std::int32_t beside = slots_.get(other, cell_channel); beside >= 0)
            touch(static_cast<std::uint32_t>(beside));
    }
}

void Surface::touch(std::uint32_t cell) {
    if (cell_stamp_[cell] == revision_) return;
    cell_stamp_[cell] = revision_;
    touched_.push_back(cell);
}

// Sets the state of a piece's nodes and appends the cells around those that it changes.
void Surface::set_piece_state(const NodeGrid& grid, const std::vector<Vec3i>& nodes, std::uint8_t state,
                              std::uint64_t stamp, std::vector<std::uint32_t>& cells) {
    for (const Vec3i& node : nodes) {
        const std::int32_t k = slots_.get(node, node_channel);
        if (k < 0) continue;
        piece_stamp_[static_cast<std::size_t>(k)] = stamp;
        std::uint8_t& known = piece_state_[static_cast<std::size_t>(k)];
        if (known == state) continue;
        known = state;
        for (int corner = 0; corner < corner_count; ++corner) {
            const Vec3i lowest = 2 * node - corner_node(node, corner);
            if (!grid.has_cell(lowest)) continue;
            const std::int32_t slot = slots_.get(lowest, cell_channel);
            if (slot < 0) continue;
            touch(static_cast<std::uint32_t>(slot));
            cells.push_back(static_cast<std::uint32_t>(slot));
        }
    }
}

void Surface::settle_small_pieces(const NodeGrid& grid) {
    piece_stamp_.resize(nodes_.size(), 0);
    piece_state_.resize(nodes_.size(), 0);
    const std::uint64_t small_stamp = 4 * revision_, large_stamp = small_stamp + 1,
                        done_stamp = small_stamp + 2;
    const auto is_large = [&](const Vec3i& node) {
        const std::int32_t k = slots_.get(node, node_channel);
        return k >= 0 && piece_stamp_[static_cast<std::size_t>(k)] == large_stamp;
    };
    constexpr std::size_t limit = tuning::placement::small_piece_nodes;
    std::vector<Vec3i> nodes;
    std::vector<std::uint32_t> cells = touched_;
    for (std::size_t i = 0, count = cells.size(); i < count; ++i)
        for (const std::int32_t start : std::array(cells_[cells[i]].node)) {
            if (start < 0 || piece_stamp_[static_cast<std::size_t>(start)] >= small_stamp) continue;
            const bool small =
                collect_small_piece(grid, nodes_[static_cast<std::size_t>(start)], limit, is_large, nodes);
            const bool weak = small && !stays_positive(grid, nodes, 0, true);
            set_piece_state(grid, nodes, weak ? is_weak : 0, small ? small_stamp : large_stamp, cells);
        }
    for (std::size_t i = 0, count = cells.size(); i < count; ++i)
        for (const std::int32_t start : std::array(cells_[cells[i]].node)) {
            if (start < 0 || piece_stamp_[static_cast<std::size_t>(start)] == done_stamp ||
                !(piece_state_[static_cast<std::size_t>(start)] & is_weak))
                continue;
            collect_small_piece(grid, nodes_[static_cast<std::size_t>(start)], limit, is_large, nodes);
            int level = 0;
            while (level < max_level && !stays_positive(grid, nodes, share_of(level), false)) ++level;
            set_piece_state(grid, nodes, static_cast<std::uint8_t>(is_weak | level), done_stamp, cells);
        }
    for (const std::uint32_t cell : cells) settle_cell(grid, cell);
}

}  // namespace splitcubes::splitting
