// Content of a picture: plain triangles and lines, without a notion of bodies.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/finish.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>
#include <splitcubes/render/live_surface.h>
#include <splitcubes/render/picture.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace splitcubes::render {

/// An sRGB colour, each channel in [0, 1].
using Color = Vec3;

/// Hatched regions of a surface.
enum RegionMark : std::int8_t { pulled_region = -1, no_region = 0, held_region = 1 };

/// Triangles with a normal at each corner and a colour each. Both sides are drawn; if a front and a back face
/// coincide, the front face is visible.
struct ShadedMesh {
    std::vector<Vec3> positions;                // m, world
    std::vector<geometry::Triangle> triangles;  // into positions, counter-clockwise from outside
    std::vector<Vec3> corner_normals;           // unit, world; 3 per triangle, in corner order
    std::vector<Color> triangle_colors;         // one per triangle
    std::vector<Color> corner_colors =
        {};                  // replaces triangle_colors unless empty: 3 per triangle, in corner order
    double roughness = 0.5;  // of the gloss: 0 mirror .. 1 chalk
    bool recessed = false;   // hidden by another mesh at equal depth
    /// Replaces colours and roughness unless null.
    std::shared_ptr<const geometry::Finish> finish = {};
    std::vector<Vec3> rest = {};    // one per position, m: where finishes are evaluated; empty: the positions
    std::vector<float> depth = {};  // one per position, m, below the surface of the uncut body; empty: zero
    std::vector<std::int8_t> mark = {};           // one per position, see RegionMark; empty: none
    std::shared_ptr<const Picture> picture = {};  // multiplies the colours, by texture coordinates
    std::vector<geometry::Uv> corner_uvs = {};    // 3 per triangle, in corner order; empty: no picture
};

/// Straight opaque lines of a constant width in the picture, with round ends, hidden by objects in front of
/// them.
struct LineSet {
    std::vector<Vec3> points;                            // m, world
    std::vector<std::array<std::uint32_t, 2>> segments;  // into points
    Color color = Color(0.1, 0.1, 0.1);
    double width = 2.0;       // pixels of a picture 720 high; scales with the height, at least 1
    double depth_offset = 0;  // m towards the eye, so that lines on a surface are visible
    bool in_bounds = true;    // whether the picture's depth range and lights take them into account
};

struct DrawList {
    std::vector<ShadedMesh> meshes;
    std::vector<LineSet> lines;
    std::vector<const LiveSurface*> surfaces = {};  // of the same context; must outlive the drawing
    std::vector<PointSet> points = {};
    ClipPlane clip = {};      // of surfaces and points
    double hatch_period = 0;  // m, between the lines of marked regions; 0: not hatched
    /// Draws surfaces where they hide points, too: for points inside of them.
    bool points_on_top = false;

    /// Returns the bounds of the meshes', surfaces' and lines' points.
    geometry::Box bounds() const;
};

/// Colours of a body's surface.
struct SurfacePalette {
    Color boundary = Color(0.90, 0.74, 0.62);  // boundary faces of piece 0
    Color cut = Color(0.84, 0.20, 0.13);       // cut faces
    Color line = Color(0.36, 0.10, 0.08);      // rim of a cut
    double line_width = 1.6;                   // as LineSet::width; 0 draws no rim
    double piece_hue_step = 14.0;              // degrees, maximum hue difference of a piece
    double crease_degrees = 35.0;              // sharper edges are shaded sharp
};

/// Looks of a surface's materials.
struct SurfaceLooks {
    /// By material; null and beyond the end: as the material says.
    std::vector<std::shared_ptr<const geometry::Finish>> finishes = {};
    std::vector<std::shared_ptr<const Picture>> pictures = {};  // by material; null and beyond the end: none
    std::vector<float> depth = {};                              // as ShadedMesh, of the surface's vertices
    std::vector<std::int8_t> mark = {};                         // as ShadedMesh, of the surface's vertices
};

/// Appends a surface. Boundary faces have the colours of their vertices and materials; if they have none, or
/// a texture without a picture in `looks`, they have the palette's colour, with a slightly different hue for
/// each piece. Cut faces have the palette's colour for them. Finishes in `looks` replace all these. The edges
/// between boundary and cut are drawn as thin lines. Normals are computed from the given positions. Empty
/// attribute arrays mean piece 0 and boundary. Throws InputError if an array has the wrong length or an index
/// is out of range.
void add_surface(DrawList& list, const geometry::SurfaceMesh& surface, const SurfacePalette& palette = {},
                 const SurfaceLooks& looks = {});

/// Appends a line through the points in sequence, e.g. a blade. Requires two points.
void add_polyline(DrawList& list, std::span<const Vec3> points, const Color& color, double width);

/// Appends a mesh in one colour with creased normals.
void add_mesh(DrawList& list, const geometry::TriangleMesh& mesh, const Color& color,
              double crease_degrees = 35.0);
/// The same with a finish; rest: the mesh in the frame of the finish's solid textures, one per position.
void add_mesh(DrawList& list, const geometry::TriangleMesh& mesh, const geometry::Finish& finish,
              std::vector<Vec3> rest, double crease_degrees = 35.0);

/// Returns unit normals, 3 per triangle: at each corner the area-weighted mean over the triangles of the same
/// group around the vertex whose normals are within the crease angle of the corner's own. `group` is empty or
/// has one value per triangle.
std::vector<Vec3> creased_corner_normals(const geometry::TriangleMesh& mesh,
                                         std::span<const std::uint8_t> group, double crease_degrees);

}  // namespace splitcubes::render
