#include <splitcubes/splitting/table.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <numeric>

namespace splitcubes::splitting {

namespace {

// Union-find over at most a few dozen elements.
template <std::size_t N>
struct SmallSets {
    std::array<std::uint8_t, N> parent;
    SmallSets() { std::iota(parent.begin(), parent.end(), std::uint8_t{0}); }
    std::uint8_t find(std::size_t i) const {
        while (parent[i] != i) i = parent[i];
        return static_cast<std::uint8_t>(i);
    }
    void join(std::size_t a, std::size_t b) {
        const std::uint8_t p = find(a), q = find(b);
        parent[std::max(p, q)] = std::min(p, q);
    }
};

// The two faces that share an edge, ordered so that the quad (edge vertex, face vertex, centre, face vertex)
// is counter-clockwise seen from the upper end.
struct EdgeFaces {
    int first, second;
};
EdgeFaces faces_of(int edge) {
    const int a = edge_axis(edge), u = (a + 1) % 3, v = (a + 2) % 3;
    const int bit_u = edge % 4 & 1, bit_v = edge % 4 >> 1;
    const int face_u = 2 * u + bit_u;  // its vertex lies off the edge along v
    const int face_v = 2 * v + bit_v;  // its vertex lies off the edge along u
    // Directions from the edge into the cell: du is +u if bit_u is 0, else -u; the same for v. (E, E + du, C,
    // E + dv) has its normal along du x dv.
    return bit_u == bit_v ? EdgeFaces{face_v, face_u} : EdgeFaces{face_u, face_v};
}

int ring_position(int face, int corner) {
    for (int k = 0; k < 4; ++k)
        if (face_corner(face, k) == corner) return k;
    assert(false);
    return -1;
}

// Shared side of two quads: a segment from a face vertex instance to the centre.
struct Segment {
    int face;
    int instance;
    bool operator==(const Segment&) const = default;
};
std::array<Segment, 2> segments_of(const TableQuad& q) {
    return {Segment{q.first_face, q.first_instance}, Segment{q.second_face, q.second_instance}};
}

}  // namespace

const Table& Table::get() {
    static const Table table;
    return table;
}

Table::Table() {
    make_faces();
    cells_.resize(mask_count);
    for (int mask = 0; mask < mask_count; ++mask) make_cell(static_cast<CellMask>(mask));
}

void Table::make_faces() {
    for (unsigned mask = 0; mask < 16; ++mask) {
        FaceConfiguration& face = faces_[mask];
        const int count = std::popcount(mask);
        face.cut_count = static_cast<std::uint8_t>(count);
        const bool opposite = mask == 0b0101 || mask == 0b1010;
        static constexpr FaceKind kinds[] = {FaceKind::A, FaceKind::B, FaceKind::C, FaceKind::E, FaceKind::F};
        face.kind = opposite ? FaceKind::D : kinds[count];
        SmallSets<4> sets;
        for (std::size_t k = 0; k < 4; ++k)
            if (!(mask >> k & 1)) sets.join(k, (k + 1) % 4);
        for (std::size_t k = 0; k < 4; ++k) face.instance[k] = sets.find(k);
        // Ring edges 0 and 1 run with their axes, 2 and 3 against them. The chosen side of the sheet is the
        // one of the first cut edge's first ring corner.
        face.side = {0, 0, 0, 0};
        if (count != 2) continue;
        const std::uint8_t home = face.instance[static_cast<std::size_t>(std::countr_zero(mask))];
        for (std::size_t k = 0; k < 4; ++k) {
            if (!(mask >> k & 1)) continue;
            const bool leaves_forward = face.instance[k] == home;  // home is at ring corner k
            const int along = k < 2 ? 1 : -1;
            face.side[k] = static_cast<std::int8_t>(leaves_forward ? along : -along);
        }
    }
}

void Table::make_cell(CellMask mask) {
    CellConfiguration& cell = cells_[mask];
    cell.first_quad = static_cast<std::uint32_t>(quads_.size());

    SmallSets<corner_count> corners;
    for (int e = 0; e < edge_count; ++e)
        if (!(mask >> e & 1))
            corners.join(static_cast<std::size_t>(edge_corner(e, 0)),
                         static_cast<std::size_t>(edge_corner(e, 1)));
    cell.component_count = 0;
    for (std::size_t c = 0; c < corner_count; ++c) {
        cell.component[c] = corners.find(c);
        cell.component_count = static_cast<std::uint8_t>(cell.component_count + (cell.component[c] == c));
    }

    std::vector<TableQuad> quads;
    for (int corner = 0; corner < corner_count; ++corner) {
        cell.corner_quads[static_cast<std::size_t>(corner)] = static_cast<std::uint8_t>(quads.size());
        for (int e = 0; e < edge_count; ++e) {
            if (!(mask >> e & 1)) continue;
            const bool lower = edge_corner(e, 0) == corner;
            if (!lower && edge_corner(e, 1) != corner) continue;
            EdgeFaces faces = faces_of(e);
            if (!lower) std::swap(faces.first, faces.second);
            const auto instance_on = [&](int f) {
                return faces_[face_mask(mask, f)]
                    .instance[static_cast<std::size_t>(ring_position(f, corner))];
            };
            quads.push_back({static_cast<std::uint8_t>(corner), static_cast<std::uint8_t>(e),
                             static_cast<std::uint8_t>(faces.first), static_cast<std::uint8_t>(faces.second),
                             instance_on(faces.first), instance_on(faces.second), 0});
        }
    }
    cell.corner_quads[corner_count] = static_cast<std::uint8_t>(quads.size());

    // Fans: quads linked through shared face-centre segments. Groups: cut edges linked through fans, that is,
    // quads linked through segments or as the two sides of one edge.
    SmallSets<24> fans, groups;
    for (std::size_t i = 0; i < quads.size(); ++i) {
        for (std::size_t j = i + 1; j < quads.size(); ++j) {
            bool linked = false;
            for (const Segment& s : segments_of(quads[i]))
                for (const Segment& t : segments_of(quads[j])) linked = linked || s == t;
            if (linked) fans.join(i, j);
            if (linked || quads[i].edge == quads[j].edge) groups.join(i, j);
        }
    }
    cell.fan_count = cell.group_count = 0;
    cell.edge_group.fill(255);
    cell.edge_side.fill(0);
    cell.group_oriented.fill(true);
    std::array<std::uint8_t, 24> fan_index{}, group_index{};
    for (std::size_t i = 0; i < quads.size(); ++i) {
        if (groups.find(i) == i) group_index[i] = cell.group_count++;
        if (fans.find(i) == i) {
            fan_index[i] = cell.fan_count;
            cell.fan_corner[cell.fan_count] = quads[i].corner;
            cell.fan_group[cell.fan_count] = group_index[groups.find(i)];
            ++cell.fan_count;
        }
        quads[i].fan = fan_index[fans.find(i)];
        cell.edge_group[quads[i].edge] = group_index[groups.find(i)];
    }
    cell.fan_corners.fill(0);
    cell.group_faces.fill(0);
    for (std::size_t fan = 0; fan < cell.fan_count; ++fan)
        for (std::size_t c = 0; c < corner_count; ++c)
            if (cell.component[c] == cell.component[cell.fan_corner[fan]])
                cell.fan_corners[fan] = static_cast<std::uint8_t>(cell.fan_corners[fan] | 1U << c);
    for (const TableQuad& q : quads) {
        std::uint8_t& faces = cell.group_faces[cell.edge_group[q.edge]];
        faces = static_cast<std::uint8_t>(faces | 1U << q.first_face | 1U << q.second_face);
    }

    // Finds a consistent side for each sheet: adjacent quads of a fan on different edges face out of the same
    // side. Repeats until nothing changes; a contradiction (three sheets that meet) leaves the group
    // unoriented.
    const auto outward = [](const TableQuad& q) { return edge_corner(q.edge, 0) == q.corner ? 1 : -1; };
    for (std::size_t seed = 0; seed < quads.size(); ++seed) {
        if (cell.edge_side[quads[seed].edge] != 0) continue;
        cell.edge_side[quads[seed].edge] = static_cast<std::int8_t>(outward(quads[seed]));
        for (bool changed = true; changed;) {
            changed = false;
            for (const TableQuad& p : quads) {
                for (const TableQuad& q : quads) {
                    if (p.edge == q.edge || p.fan != q.fan) continue;
                    bool linked = false;
                    for (const Segment& s : segments_of(p))
                        for (const Segment& t : segments_of(q)) linked = linked || s == t;
                    const int side_p = cell.edge_side[p.edge];
                    if (!linked || side_p == 0) continue;
                    const int side_q = side_p * outward(p) * outward(q);
                    std::int8_t& known = cell.edge_side[q.edge];
                    if (known == 0) {
                        known = static_cast<std::int8_t>(side_q);
                        changed = true;
                    } else if (known != side_q) {
                        cell.group_oriented[cell.edge_group[q.edge]] = false;
                    }
                }
            }
        }
    }
    quads_.insert(quads_.end(), quads.begin(), quads.end());
}

}  // namespace splitcubes::splitting
