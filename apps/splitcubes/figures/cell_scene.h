// A cell with cut edges, all corners inside, and its surface.
#pragma once

#include "drawing.h"

#include <splitcubes/splitting/table.h>

#include <array>
#include <vector>

namespace splitcubes::app::figures {

/// A quad of the cell in the drawing.
struct DrawnQuad {
    splitting::TableQuad table;
    std::array<Vec3, 4> corners;  // edge vertex, face vertex, centre, face vertex
};

/// Returns the quads of the cell with these edges cut in the middle at right angles, all by one cut;
/// positions are those of the Surface.
std::vector<DrawnQuad> quads_of_cell(splitting::CellMask mask);

/// Draws quads from back to front, each in its colour.
void draw_quads(Svg& svg, const CellView& view, std::vector<DrawnQuad> quads,
                const std::vector<std::size_t>& colour_of_fan, double opacity);

/// Marks the cut edges of a mask.
void draw_crossings(Svg& svg, const CellView& view, splitting::CellMask mask);

}  // namespace splitcubes::app::figures
