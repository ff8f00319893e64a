// Positions of the vertices of small pieces. Where sheets meet, vertices may lie outside their face or cell,
// and a piece of a few nodes may turn inside out. A piece for which this cannot be excluded has all its
// vertices moved into their faces and cells, where its volume is positive.
//
// The volume of a piece is a sum over its nodes n, the edges e at n, whole or cut, and the cells c around e.
// Each term is the cone from n to the part of the edge's dual face in c: t / 3 times the area of that part,
// projected along e. t is the distance from n to the vertex on e, or half of a whole edge. The parts of a dual
// face fit together at points that both ends share, so the terms add up to the volume. With vertices in their
// faces and cells no term is negative. A term is smallest for some choice between the wanted and the moved
// positions of its vertices. If the sum of these smallest terms is positive, so is the volume, whichever
// vertices the neighbours of the piece move.
#include <splitcubes/splitting/small_piece.h>
#include <splitcubes/splitting/surface.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::splitting {

namespace {

double cross(const Vec2& a, const Vec2& b) {
    return a[0] * b[1] - a[1] * b[0];
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

// A vertex, relative to its cell's lowest corner, in cells: where it is wanted, and moved into its face or
// cell.
struct Surface::Choice {
    Vec3 wanted = Vec3::Constant(0.5);
    Vec3 settled = Vec3::Constant(0.5);
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

// Returns the smallest term of the edge along `axis` at a corner of a cell, and the one with all vertices
// moved; cells^3.
Surface::Cone Surface::cone(const NodeGrid& grid, const Vec3i& lowest, int corner, int axis) const {
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
    struct Pair {
        Vec2 wanted, settled;
    };
    const auto pair = [&](const Choice& c) { return Pair{project(c.wanted), project(c.settled)}; };
    // The face beside the edge in direction u is normal to v.
    const int faces[2] = {2 * v + corner_bit(corner, v), 2 * u + corner_bit(corner, u)};
    const Vec2 middle(0.5, 0.5);
    Cone out;
    int fans[2];
    Pair face[2], centre[2];
    for (int k = 0; k < 2; ++k) {
        fans[k] = slot < 0 ? -1 : fan_at(cell.mask, faces[k], corner);
        face[k] = pair(face_choice(grid.rest(), cell, faces[k]));
        centre[k] = pair(centre_choice(grid.rest(), cell, fans[k]));
    }
    const auto side = [&](int k, const Vec2& f, const Vec2& c) { return k == 0 ? cross(f, c) : cross(c, f); };
    const auto least_side = [&](int k, const Vec2& c) {
        return std::min(side(k, face[k].wanted, c), side(k, face[k].settled, c));
    };
    double least = 0, settled = 0;
    for (int k = 0; k < 2; ++k) {
        settled += side(k, face[k].settled, centre[k].settled) +
                   side(k, centre[k].settled, middle);
        if (fans[0] != fans[1])
            least += std::min(least_side(k, centre[k].wanted) + side(k, centre[k].wanted, middle),
                              least_side(k, centre[k].settled) + side(k, centre[k].settled, middle));
    }
    if (fans[0] == fans[1])
        least = std::min(least_side(0, centre[0].wanted) + least_side(1, centre[0].wanted),
                         least_side(0, centre[0].settled) + least_side(1, centre[0].settled));
    out.least = t / 6 * least;
    out.settled = t / 6 * settled;
    return out;
}

bool Surface::stays_positive(const NodeGrid& grid, const std::vector<Vec3i>& nodes) const {
    double least = 0, settled = 0;
    for (const Vec3i& node : nodes)
        for (int corner = 0; corner < corner_count; ++corner) {
            const Vec3i lowest = 2 * node - corner_node(node, corner);
            if (!grid.has_cell(lowest)) continue;
            for (int axis = 0; axis < 3; ++axis) {
                const Cone one = cone(grid, lowest, corner, axis);
                least += one.least;
                settled += one.settled;
            }
        }
    return least > tuning::placement::least_share * settled;
}

// Moves the vertices of a cell into their faces and the cell if one of the cell's corners belongs to a piece
// that needs it, and back otherwise.
void Surface::settle_cell(const NodeGrid& grid, std::uint32_t index) {
    const SurfaceCell& cell = cells_[index];
    const auto moves = [&](unsigned corners) {
        for (; corners != 0; corners &= corners - 1) {
            const std::int32_t node = cell.node[static_cast<std::size_t>(std::countr_zero(corners))];
            if (node >= 0 && is_settled_[static_cast<std::size_t>(node)]) return true;
        }
        return false;
    };
    const auto settle = [&](std::int32_t vertex, bool move, const Choice& choice) {
        SurfaceVertex& v = vertices_[static_cast<std::size_t>(vertex)];
        const Vec3 wanted = wanted_rest(vertex), before = v.rest;
        place(vertex, wanted);
        if (move) {
            v.rest = grid.rest().origin +
                     grid.rest().cell_size * (cell.lowest_node.cast<double>() + choice.settled);
            wanted_.emplace(vertex, wanted);
        }
        return v.rest != before;
    };
    const bool centres_move = moves(0xff);
    if (!centres_move && wanted_.empty()) return;
    for (std::size_t fan = 0; fan < cell.fan_count; ++fan)
        if (cell.centre[fan] >= 0 &&
            settle(cell.centre[fan], centres_move,
                   centre_choice(grid.rest(), cell, static_cast<int>(fan))))
            touch(index);
    for (int face = 0; face < face_count; ++face) {
        const std::int32_t slot = cell.face[static_cast<std::size_t>(face)];
        if (slot < 0) continue;
        unsigned corners = 0;
        for (int k = 0; k < 4; ++k) corners |= 1U << face_corner(face, k);
        const bool move = moves(corners);
        const Choice choice = face_choice(grid.rest(), cell, face);
        bool moved = false;
        for (const std::int32_t vertex : faces_[static_cast<std::size_t>(slot)].vertex)
            if (vertex >= 0) moved = settle(vertex, move, choice) || moved;
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

void Surface::settle_small_pieces(const NodeGrid& grid) {
    piece_stamp_.resize(nodes_.size(), 0);
    is_settled_.resize(nodes_.size(), 0);
    const auto index_of = [&](const Vec3i& node) { return slots_.get(node, node_channel); };
    // Bit 0 of a stamp: the piece is large.
    const auto is_large = [&](const Vec3i& node) {
        const std::int32_t k = index_of(node);
        return k >= 0 && piece_stamp_[static_cast<std::size_t>(k)] == 2 * revision_ + 1;
    };
    std::vector<Vec3i> nodes;
    std::vector<std::uint32_t> cells = touched_;
    for (std::size_t i = 0, count = cells.size(); i < count; ++i)
        for (const std::int32_t start : std::array(cells_[cells[i]].node)) {
            if (start < 0 || piece_stamp_[static_cast<std::size_t>(start)] >= 2 * revision_) continue;
            const bool small = collect_small_piece(grid, nodes_[static_cast<std::size_t>(start)],
                                                   tuning::placement::small_piece_nodes, is_large, nodes);
            const bool settled = small && !stays_positive(grid, nodes);
            for (const Vec3i& node : nodes) {
                const std::int32_t k = index_of(node);
                if (k < 0) continue;
                piece_stamp_[static_cast<std::size_t>(k)] = 2 * revision_ + (small ? 0 : 1);
                std::uint8_t& known = is_settled_[static_cast<std::size_t>(k)];
                if (known == static_cast<std::uint8_t>(settled)) continue;
                known = settled;
                for (int corner = 0; corner < corner_count; ++corner) {
                    const Vec3i lowest = 2 * node - corner_node(node, corner);
                    if (!grid.has_cell(lowest)) continue;
                    if (const std::int32_t slot = slots_.get(lowest, cell_channel); slot >= 0)
                        cells.push_back(static_cast<std::uint32_t>(slot));
                }
            }
        }
    for (const std::uint32_t cell : cells) settle_cell(grid, cell);
}

}  // namespace splitcubes::splitting
