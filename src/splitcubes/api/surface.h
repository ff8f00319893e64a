// A body's surface as arrays that a vertex buffer takes as they are.
#pragma once

#include <splitcubes/api/types.h>

#include <cstdint>
#include <span>

namespace splitcubes {

/// Origin of a triangle.
enum class SurfaceOrigin : std::uint8_t {
    boundary = 0,  ///< the surface that the input had
    cut = 1,       ///< made by a cut or a tear
};

/// A surface in slots. A vertex and a triangle keep their slots as long as they are there. Slots that are
/// free hold triangles without extent (0, 0, 0), so all triangle slots can be drawn. Arrays only grow, but
/// for Simulation::undo, redo and load.
///
/// Positions and normals are new everywhere after each step. All else is changed only within the change
/// ranges, which list what the last step, cut at rest, undo, redo or load did to this body: patching a copy
/// in these ranges after each of them keeps it equal to the whole. A reader that has missed one sees it by
/// `revision`, which has then gone up by more than one, and copies everything. Ranges ascend and do not
/// overlap; they may take in a few slots that did not change. After undo, redo and load they are the whole,
/// which may be shorter or longer than the copy.
///
/// Spans are valid until the next call that is not const, or the end of the simulation.
struct SurfaceView {
    std::span<const float> positions;          ///< x, y, z a vertex slot, m, world
    std::span<const float> normals;            ///< x, y, z a vertex slot, unit, outward, world
    std::span<const float> rest_positions;     ///< x, y, z a vertex slot, m, rest space; for solid textures
    std::span<const std::int32_t> pieces;      ///< a vertex slot: number of its piece, -1: free
    std::span<const std::uint32_t> triangles;  ///< three vertex slots a triangle slot, counter-clockwise
    std::span<const SurfaceOrigin> origins;    ///< a triangle slot
    /// A triangle slot: index into Simulation::material_names.
    std::span<const std::int32_t> triangle_material;
    /// u, v of each corner, six a triangle slot; (0, 0) on cut faces; empty where the input has none.
    std::span<const float> corner_uv;
    /// A triangle slot: number of the cut that made it, of the tool's or the sheet's; -1: none did. All tears
    /// have one number, which no tool has.
    std::span<const std::int32_t> cuts;
    /// A triangle slot: number of the grid edge that it covers. Edges are numbered in the order in which they
    /// were cut, those of the boundary first: a triangle whose edge was not there after a step was made
    /// later.
    std::span<const std::int32_t> edges;

    std::span<const Range> changed_vertices;   ///< vertex slots whose piece or rest position changed
    std::span<const Range> changed_triangles;  ///< triangle slots that changed
    /// Vertex slots that stand for another vertex than before: their last position is not where they come
    /// from.
    std::span<const Range> new_vertices;
    /// Goes up by one with each change of the ranges' arrays, by more with undo, redo and load. Never 0, and
    /// never the same for two surfaces of a program.
    std::uint64_t revision = 0;

    std::size_t vertex_slots() const { return pieces.size(); }           ///< used or free
    std::size_t triangle_slots() const { return triangles.size() / 3; }  ///< used or free
};

}  // namespace splitcubes
