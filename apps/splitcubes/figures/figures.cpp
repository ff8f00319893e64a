#include "figures.h"

#include <array>

namespace splitcubes::app::figures {

std::span<const Figure> all_figures() {
    static constexpr std::array<Figure, 7> figures{{
        {"faces", "the six kinds of a face, at rest and deformed", draw_faces},
        {"quads", "the quads that one node of a cell contributes", draw_quads},
        {"fans", "centre vertices with more than one fan, and their split", draw_fans},
        {"placement", "where face and centre vertices are placed", draw_placement},
        {"boundary", "a cut that meets the boundary of a body", draw_boundary},
        {"disk", "an occlusion disk, its cones and its texels", draw_disk},
        {"front", "the weight of a pair as fronts of cuts pass, by criterion", draw_front},
    }};
    return figures;
}

}  // namespace splitcubes::app::figures
