// Draws how continuous each criterion is: the factor of a pair's weight as a cut's front passes between the
// two phyxels, and as two fronts meet there.
#include "figures.h"
#include "weight_field.h"

#include <algorithm>
#include <cstdio>

namespace splitcubes::app::figures {

namespace {

constexpr double wide = 300, high = 220, top = 40;  // of the axes, pixels
constexpr int steps = 400;
constexpr const char* colours[] = {"#08519c", "#c0392b", "#229954", "#d68910"};

struct FrontPanel {
    double left;
    const char* title;
    const char* words;   // axis label
    double first, last;  // range of the axis
    CutScene (*cut)(double at);
};

CutScene one_front(double y) {
    return make_cut("front", {{-far_away, y}});
}
CutScene two_fronts(double gap) {
    if (!(gap > 0)) return make_cut("closed", {{-far_away, far_away}});
    return make_cut("gap", {{-far_away, 0.02 - gap / 2}, {0.02 + gap / 2, far_away}});
}

void draw_front_axes(Svg& svg, const FrontPanel& panel) {
    const Style grid{"none", "#cccccc", 1, 1, ""};
    for (int k = 0; k <= 4; ++k) {
        const double y = top + high * (1 - 0.25 * k), x = panel.left + wide * 0.25 * k;
        svg.line({panel.left, y}, {panel.left + wide, y}, grid);
        svg.line({x, top}, {x, top + high}, grid);
        char words[16];
        std::snprintf(words, sizeof words, "%.2g", 0.25 * k);
        svg.text({panel.left - 8, y}, words, Anchor::end, 12);
        std::snprintf(words, sizeof words, "%.2g", panel.first + (panel.last - panel.first) * 0.25 * k);
        svg.text({x, top + high + 14}, words, Anchor::middle, 12);
    }
    svg.text({panel.left + wide / 2, 18}, panel.title, Anchor::middle, 13, "#222222", true);
    svg.text({panel.left + wide / 2, top + high + 34}, panel.words, Anchor::middle, 12);
}

// Returns the largest change between neighbouring positions.
double draw_curve(Svg& svg, const FrontPanel& panel, std::size_t kind) {
    std::vector<Vec2> line;
    double last = 0, jump = 0;
    for (int k = 0; k <= steps; ++k) {
        const double at = panel.first + (panel.last - panel.first) * k / steps;
        const double factor =
            factors(panel.cut(at), static_cast<occlusion::CriterionKind>(kind), {Vec3(1, 0, 0)})[0];
        if (k > 0) jump = std::max(jump, std::abs(factor - last));
        last = factor;
        // Offsets curves that coincide.
        line.emplace_back(panel.left + wide * k / steps,
                          top + high * (1 - factor) + 1.2 * (static_cast<double>(kind) - 1.5));
    }
    svg.polyline(line, {"none", colours[kind], 2, 1, ""});
    return jump;
}

}  // namespace

Svg draw_front() {
    Svg svg(820, 400);
    const FrontPanel panels[] = {
        {60, "a front passes between the two", "y of the front, in distances of the two", -1, 1, one_front},
        {470, "two fronts meet between the two", "gap between the fronts", 1, 0, two_fronts}};
    for (std::size_t p = 0; p < 2; ++p) {
        draw_front_axes(svg, panels[p]);
        for (std::size_t kind = 0; kind < 4; ++kind) {
            const double jump = draw_curve(svg, panels[p], kind);
            const double y = 332 + 18 * static_cast<double>(kind);
            if (p == 0) {
                svg.line({60, y}, {84, y}, {"none", colours[kind], 3, 1, ""});
                svg.text({92, y}, occlusion::criterion_names[kind], Anchor::start, 12);
            }
            char words[16];
            std::snprintf(words, sizeof words, "%.2f", jump);
            svg.text({panels[p].left + wide, y}, words, Anchor::end, 12);
        }
    }
    return svg;
}

}  // namespace splitcubes::app::figures
