// Positions of face and centre vertices, as pure functions of the current crossings of the face or cell: the
// same cuts give the same surface in any order. Follows Pietroni et al. 2007, section 6.1 and figure 5, with
// a cubic Hermite arc in place of the quadratic Bezier curve and least squares in place of the pairwise
// intersections (docs/replication.md gives the reasons). Unit: cells, from the lowest corner.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstdint>
#include <span>

namespace splitcubes::splitting {

/// A crossing in the coordinates u, v of its face.
struct FaceCrossing {
    Vec2 point = Vec2::Zero();   // on ring edge k
    Vec2 normal = Vec2::Zero();  // unit, in the face plane; see face_crossing
    std::int32_t cut = -1;       // index of the cut; -1 for the boundary
    double front = 0.5;  // share of its way through the face that the sheet has come, if it ends in it
};

/// The way of a sheet through a face: from its crossing to where the tangent leaves the face.
struct FrontRay {
    Vec2 start, way;
};
FrontRay front_ray(int ring_edge, const FaceCrossing& crossing);

/// Returns the crossing of ring edge k of a face at `parameter` along the edge's axis; normal_u and normal_v
/// are the sheet normal's components in the face. A sheet (nearly) parallel to the face is treated as
/// perpendicular to the edge.
FaceCrossing face_crossing(int ring_edge, double parameter, double normal_u, double normal_v,
                           std::int32_t cut = -1);

struct FacePlacement {
    Vec2 point = Vec2(0.5, 0.5);
    /// True for one smooth sheet, which the face's own crossings determine to second order. Where sheets meet
    /// they do not (the face may be nearly parallel to the crease, or the crease may pass beside it); see
    /// place_between_centres.
    bool smooth = true;
};

/// Returns the position of the face vertex: within the face square if the sheet is smooth, within the square
/// widened by 0.25 if it is sharp. ring_mask: bit k is set for each cut ring edge; crossings of uncut edges
/// are not read. If sheets of different cuts meet, the position is within the square widened by 0.5: at their
/// intersection or, if that lies further away, on the first sheet towards it (the boundary comes before cuts,
/// a lower cut index before a higher), so that the first sheet does not move.
FacePlacement place_face_vertex(unsigned ring_mask, const std::array<FaceCrossing, 4>& crossings);

/// Returns the final position of the vertex of a face where sheets meet: on the line between the centre
/// vertices of the two cells that share the face, which lie on the crease, at the line's intersection with
/// the face, clamped to the line's middle half. low, high: centre vertices of the lower and the upper cell
/// along the face's axis; face_level: the face's coordinate along it. Any common unit and origin.
Vec3 place_between_centres(int face_axis, double face_level, const Vec3& low, const Vec3& high);

/// A crossing in the coordinates of its cell.
struct CellCrossing {
    Vec3 point;
    Vec3 normal;            // unit; oriented to one side of the sheet if `oriented` is given
    bool grazing;           // the sheet is nearly parallel to the edge: the normal's sign is meaningless
    std::int32_t cut = -1;  // index of the cut; -1 for the boundary
};

/// Returns the position of the centre vertex of a group of linked crossings. oriented: the normals' signs are
/// consistent over the group. mean: of the face vertices of the faces that the group crosses. The
/// position is within the cell if the sheet is smooth, within the cell widened by 0.5 on a crease and by 1 at
/// a corner of three planes. Sheets of different cuts are treated as in place_face_vertex.
Vec3 place_centre(std::span<const CellCrossing> crossings, bool oriented, const Vec3& mean);

}  // namespace splitcubes::splitting
