// Where face and centre vertices lie, as pure functions of the crossings that
// the face or cell has now: the same cuts give the same surface in any order.
// Follows Pietroni et al. 2007, section 6.1 and figure 5, with the quadratic
// Bezier curve replaced by a cubic Hermite arc and the pairwise intersections by
// least squares (docs/replication.md says why). Unit: cells, from the lowest corner.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstdint>
#include <span>

namespace splitcubes::splitting {

/// Two crossings are sharp when their normals differ by more than acos(0.9), about 26 degrees.
inline constexpr double sharp_cosine = 0.9;

/// A crossing as its face sees it. Coordinates u, v of the face.
struct FaceCrossing {
    Vec2 point = Vec2::Zero();   // on ring edge k
    Vec2 normal = Vec2::Zero();  // unit, in the face plane; see face_crossing
    std::int32_t cut = -1;       // which cut made it; -1 for the boundary
};

/// The crossing of ring edge k of a face at `parameter` along the edge's axis,
/// the sheet's normal having the components normal_u, normal_v in the face.
/// A sheet (nearly) parallel to the face is taken to meet the edge squarely.
FaceCrossing face_crossing(int ring_edge, double parameter, double normal_u, double normal_v,
                           std::int32_t cut = -1);

struct FacePlacement {
    Vec2 point = Vec2(0.5, 0.5);
    /// One smooth sheet, which the face's own crossings fix to second order. Where
    /// sheets meet they do not (the face may be nearly parallel to the crease, or the
    /// crease pass beside it): see place_between_centres.
    bool smooth = true;
};

/// Position of the face vertex, within the face square widened by 0.25 where the
/// sheet is sharp, within the square itself where it is smooth. ring_mask: bit k
/// set for each cut ring edge; crossings of uncut edges are not read. Where sheets
/// of different cuts meet, within the square widened by 0.5: at their intersection
/// or, where that is further away, on the first sheet (the boundary before cuts, a
/// lower number before a higher) on the way there, so that the first does not move.
FacePlacement place_face_vertex(unsigned ring_mask, const std::array<FaceCrossing, 4>& crossings);

/// Final position of the vertex of a face where sheets meet: on the line between the
/// centre vertices of the two cells that share the face, which lie on the crease;
/// where the line crosses the face, but within its middle half. low, high: centres of
/// the lower and the upper cell along the face's axis; face_level: the face's
/// coordinate along it. Any one unit and origin.
Vec3 place_between_centres(int face_axis, double face_level, const Vec3& low, const Vec3& high);

/// A crossing as its cell sees it.
struct CellCrossing {
    Vec3 point;
    Vec3 normal;            // unit; turned to one side of the sheet where `oriented` is given
    bool grazing;           // the sheet runs along the edge: the normal's sign says nothing
    std::int32_t cut = -1;  // which cut made it; -1 for the boundary
};

/// Position of the centre vertex of a group of linked crossings. oriented: the
/// normals' signs are consistent over the group. Sheets of different cuts as in
/// place_face_vertex. mean: of the face vertices of the
/// faces that the group crosses. Within the cell where the sheet is smooth, within the
/// cell widened by 0.5 on a crease and by 1 at a corner of three planes.
Vec3 place_centre(std::span<const CellCrossing> crossings, bool oriented, const Vec3& mean);

}  // namespace splitcubes::splitting
