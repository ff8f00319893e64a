// What a picture shows: plain triangles and lines, with no notion of bodies.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::render {

/// Colours are sRGB, each channel in [0, 1].
using Color = Vec3;

/// Triangles with a normal at each corner and a colour each. Both sides are
/// drawn; where a front and a back face coincide, the front one shows.
struct ShadedMesh {
    std::vector<Vec3> positions;                // m, world
    std::vector<geometry::Triangle> triangles;  // into positions, counter-clockwise from outside
    std::vector<Vec3> corner_normals;           // unit, world; 3 a triangle, in corner order
    std::vector<Color> triangle_colors;         // one a triangle
    std::vector<Color> corner_colors = {};      // instead: 3 a triangle, in corner order; may be empty
    double roughness = 0.5;                     // of the gloss: 0 mirror .. 1 chalk
    bool recessed = false;                      // loses against another mesh at equal depth
};

/// Straight opaque lines of a constant width on the picture, with round ends,
/// hidden by what is in front of them.
struct LineSet {
    std::vector<Vec3> points;                            // m, world
    std::vector<std::array<std::uint32_t, 2>> segments;  // into points
    Color color = Color(0.1, 0.1, 0.1);
    double width = 2.0;       // pixels of a picture 720 high; scales with the height, at least 1
    double depth_offset = 0;  // m towards the eye, so that lines on a surface show
};

struct DrawList {
    std::vector<ShadedMesh> meshes;
    std::vector<LineSet> lines;

    /// Of the meshes' and lines' points.
    geometry::Box bounds() const;
};

/// How a body's surface is coloured.
struct SurfacePalette {
    Color skin = Color(0.90, 0.74, 0.62);  // boundary faces of piece 0
    Color cut = Color(0.84, 0.20, 0.13);   // cut faces
    Color line = Color(0.36, 0.10, 0.08);  // rim of a cut
    double line_width = 1.6;               // as LineSet::width; 0 draws no rim
    double piece_hue_step = 14.0;          // degrees, the most that a piece's skin differs
    double crease_degrees = 35.0;          // sharper edges stay sharp
};

/// Appends a surface: boundary faces in the colours of their vertices and
/// materials, where they have none or a texture, which is not drawn, in skin colour
/// (a slightly different hue for each piece); cut faces in their own, and the edges between the two as thin
/// lines. Normals are those of the positions given. Attribute arrays that are
/// empty count as piece 0 and boundary. Throws InputError when an array has the
/// wrong length or an index is out of range.
void add_surface(DrawList& list, const geometry::SurfaceMesh& surface, const SurfacePalette& palette = {});

/// Appends a line through the points in turn, e.g. a blade. Needs two points.
void add_polyline(DrawList& list, std::span<const Vec3> points, const Color& color, double width);

/// Appends a mesh in one colour with creased normals.
void add_mesh(DrawList& list, const geometry::TriangleMesh& mesh, const Color& color,
              double crease_degrees = 35.0);

/// Unit normals, 3 a triangle: at each corner the area-weighted mean over the
/// triangles of the same group around the vertex whose normals are within the
/// crease angle of the corner's own. `group` is empty or one number a triangle.
std::vector<Vec3> creased_corner_normals(const geometry::TriangleMesh& mesh,
                                         std::span<const std::uint8_t> group, double crease_degrees);

}  // namespace splitcubes::render
