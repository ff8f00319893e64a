// A draw list as the vertex arrays that the driver takes.
#pragma once

#include <splitcubes/render/draw_list.h>

#include <cstddef>
#include <vector>

namespace splitcubes::render {

/// Positions are relative to the origin given to pack(), colours linear.
struct PackedScene {
    struct Vertex {
        float position[3];  // m
        float normal[3];    // unit
        float color[3];     // linear
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
    };
    std::vector<Vertex> vertices;  // 3 a triangle
    std::vector<Range> ranges;     // one a mesh
    std::vector<Segment> segments;
};

/// sRGB to linear, a channel at a time (IEC 61966-2-1).
double linear_from_srgb(double value);
Vec3 linear(const Color& color);

/// Throws InputError when arrays do not fit together, an index is out of range or
/// a position is not finite. pixel_scale: pixels of this picture a line-width unit.
PackedScene pack(const DrawList& list, const Vec3& origin, double pixel_scale);

}  // namespace splitcubes::render
