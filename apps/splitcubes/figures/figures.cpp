#include "figures.h"

#include <array>

namespace splitcubes::app::figures {

std::span<const Figure> all_figures() {
    static constexpr std::array<Figure, 5> figures{{
        {"faces", "the six kinds of a face, at rest and deformed", draw_faces},
        {"quads", "the quads that one node of a cell contributes", draw_quads},
        {"fans", "centre vertices with more than one fan, and their split", draw_fans},
        {"placement", "where face and centre vertices are placed", draw_placement},
        {"skin", "a cut that meets the skin of a body", draw_skin},
    }};
    return figures;
}

}  // namespace splitcubes::app::figures
