// Shared parts of the figures: colours, a panel with its scale, a view of a cell, grids and patches.
#pragma once

#include "svg.h"

#include <splitcubes/splitting/surface.h>

#include <string>
#include <vector>

namespace splitcubes::app::figures {

inline const std::string ink = "#222222", soft = "#9aa3ad", faint = "#d5dae0", red = "#c8281e";

/// Fill and outline of the k-th piece, component or fan.
struct PieceColours {
    std::string fill, line;
};
const PieceColours& colours_of(std::size_t k);

/// A panel of the drawing with its own coordinates, y upward.
struct Panel {
    Vec2 origin;   // pixels, of (0, 0)
    double scale;  // pixels per unit

    Vec2 at(const Vec2& p) const { return {origin[0] + scale * p[0], origin[1] - scale * p[1]}; }
};

/// Symbols, the same in every figure and its legend.
void draw_node(Svg& svg, const Vec2& at, const std::string& colour = ink);
void draw_crossing(Svg& svg, const Vec2& at);
void draw_edge_vertex(Svg& svg, const Vec2& at, const std::string& colour);
void draw_face_vertex(Svg& svg, const Vec2& at, const std::string& colour);
void draw_centre_vertex(Svg& svg, const Vec2& at, const std::string& colour);

/// Oblique view of a cell without perspective. Corner 0 is in front, lower left.
struct CellView {
    Panel panel;

    Vec2 at(const Vec3& p) const;
    double depth(const Vec3& p) const;  // larger: farther away
    /// Draws the edges of the cube from `low` to `high`; those at the hidden corner are dashed.
    void draw_cube(Svg& svg, const Vec3& low, const Vec3& high, const Style& style) const;
};

/// Returns a grid whose nodes are all inside; cell size 1, node (0, 0, 0) at the origin.
splitting::NodeGrid solid_grid(const Vec3i& node_count);

/// Part of a face of the layer z = level that belongs to one node component. Its outline runs from the face
/// vertex over an edge vertex and nodes to an edge vertex and back. Uncut faces have nodes only.
struct Patch {
    struct Point {
        Vec3i node;
        std::int32_t vertex = -1;  // of the surface; -1: the node itself
    };
    Vec3i face;
    std::vector<Point> outline;
    bool whole = true;
};
std::vector<Patch> patches_of_layer(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                    int level);

}  // namespace splitcubes::app::figures
