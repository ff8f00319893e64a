// Conversion of a draw list to vertex arrays for the driver.
#pragma once

#include <splitcubes/render/draw_list.h>
#include <splitcubes/render/packed_finishes.h>

#include <cstddef>
#include <memory>
#include <vector>

namespace splitcubes::render {

/// Vertex arrays. Positions are relative to the origin given to pack(), colours are linear.
struct PackedScene {
    struct Vertex {
        float position[3];  // m
        float normal[3];    // unit
        float color[3];     // linear
        float rest[4];      // m; the last one: depth below the uncut surface
        float extra[3];     // texture coordinates, mark
    };
    struct Segment {
        float from[3];   // m
        float to[3];     // m
        float color[3];  // linear
        float shape[2];  // half width in pixels, m towards the eye
    };
    struct Range {
        std::size_t first;  // vertex
        std::size_t count;  // vertices
        float roughness;
        bool recessed;
        int finish;  // -1: the colours of the vertices
        std::shared_ptr<const Picture> picture;
    };
    std::vector<Vertex> vertices;  // 3 per triangle
    std::vector<Range> ranges;     // one per mesh
    std::vector<Segment> segments;
    PackedFinishes finishes;
};

/// Converts one sRGB channel to linear (IEC 61966-2-1).
double linear_from_srgb(double value);
Vec3 linear(const Color& color);

/// Packs a draw list. Throws InputError if arrays do not match, an index is out of range or a position is not
/// finite. pixel_scale: pixels of this picture per unit of line width.
PackedScene pack(const DrawList& list, const Vec3& origin, double pixel_scale);

}  // namespace splitcubes::render
