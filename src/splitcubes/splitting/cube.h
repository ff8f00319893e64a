// The numbering of a cube's corners, edges and faces (drawn in docs/conventions.md). All of it is derived
// from bits.
//
//   corner c   at (c & 1, c >> 1 & 1, c >> 2 & 1)
//   edge e     along axis a = e / 4; k = e % 4 gives its position on the other
//              axes u = (a+1)%3 and v = (a+2)%3: u bit k & 1, v bit k >> 1
//   face f     normal to axis a = f / 2, at coordinate f % 2
//   face ring  corners in the order (u,v) = (0,0) (1,0) (1,1) (0,1), the same for
//              both faces of an axis; ring edge k joins ring corners k and k+1
#pragma once

#include <array>
#include <cstdint>

namespace splitcubes::splitting {

inline constexpr int corner_count = 8;
inline constexpr int edge_count = 12;
inline constexpr int face_count = 6;
inline constexpr int mask_count = 1 << edge_count;

using CellMask = std::uint16_t;  // bit e set: edge e of the cell is cut

constexpr int corner_bit(int corner, int axis) {
    return (corner >> axis) & 1;
}
constexpr int edge_axis(int edge) {
    return edge / 4;
}
constexpr int face_axis(int face) {
    return face / 2;
}

/// Returns a corner of an edge: end 0 the lower one, end 1 the upper one.
constexpr int edge_corner(int edge, int end) {
    const int a = edge_axis(edge), u = (a + 1) % 3, v = (a + 2) % 3, k = edge % 4;
    return (end << a) | ((k & 1) << u) | ((k >> 1) << v);
}

/// Returns corner k of a face's ring.
constexpr int face_corner(int face, int k) {
    const int a = face_axis(face), u = (a + 1) % 3, v = (a + 2) % 3;
    const int bu = (k == 1 || k == 2) ? 1 : 0, bv = (k >= 2) ? 1 : 0;
    return ((face & 1) << a) | (bu << u) | (bv << v);
}

/// Returns the edge that joins two corners, or -1.
constexpr int edge_between(int a, int b) {
    for (int e = 0; e < edge_count; ++e)
        if ((edge_corner(e, 0) == a && edge_corner(e, 1) == b) ||
            (edge_corner(e, 0) == b && edge_corner(e, 1) == a))
            return e;
    return -1;
}

/// Returns edge k of a face's ring, between ring corners k and k+1.
constexpr int face_edge(int face, int k) {
    return edge_between(face_corner(face, k), face_corner(face, (k + 1) % 4));
}

namespace detail {
constexpr auto make_face_edges() {
    std::array<std::array<std::int8_t, 4>, face_count> out{};
    for (int f = 0; f < face_count; ++f)
        for (int k = 0; k < 4; ++k)
            out[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] =
                static_cast<std::int8_t>(face_edge(f, k));
    return out;
}
constexpr auto make_edge_corners() {
    std::array<std::array<std::int8_t, 2>, edge_count> out{};
    for (int e = 0; e < edge_count; ++e)
        for (int k = 0; k < 2; ++k)
            out[static_cast<std::size_t>(e)][static_cast<std::size_t>(k)] =
                static_cast<std::int8_t>(edge_corner(e, k));
    return out;
}
}  // namespace detail

inline constexpr auto face_edges = detail::make_face_edges();      // [face][ring position]
inline constexpr auto edge_corners = detail::make_edge_corners();  // [edge][end]

/// Returns the four edge bits of a face in ring order.
constexpr unsigned face_mask(CellMask mask, int face) {
    unsigned out = 0;
    for (int k = 0; k < 4; ++k)
        out |= ((mask >> face_edges[static_cast<std::size_t>(face)][static_cast<std::size_t>(k)]) & 1U) << k;
    return out;
}

}  // namespace splitcubes::splitting
