// The drawings of docs/algorithms. Each chooses the crossings; the library computes all positions that follow
// from them.
#pragma once

#include "svg.h"

#include <span>

namespace splitcubes::app::figures {

Svg draw_faces();
Svg draw_quads();
Svg draw_fans();
Svg draw_placement();
Svg draw_boundary();
Svg draw_disk();
Svg draw_front();

struct Figure {
    const char* name;
    const char* shows;
    Svg (*draw)();
};

/// Returns all figures, in the order of the document.
std::span<const Figure> all_figures();

}  // namespace splitcubes::app::figures
