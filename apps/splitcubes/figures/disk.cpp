// Draws an occlusion disk with its two cones and a cut, and its texels as seen from either phyxel.
#include "figures.h"

#include <splitcubes/occlusion/disk.h>

#include <cmath>
#include <numbers>
#include <string>

namespace splitcubes::app::figures {

namespace {

using DiskCorners = std::array<Vec3, 3>;

// Returns waves across the cones, up to a slanted front. Coordinates of the disk: the first phyxel at the
// origin, the second at depth 2.
std::vector<DiskCorners> cut_surface() {
    constexpr int n = 12;
    const auto at = [](int i, int j) {
        const double v = -1.15 + 2.3 * j / n, u = -1.15 + (1.3 + 0.35 * v) * i / n;
        return Vec3(u, v, 0.95 + 0.5 * u + 0.13 * std::sin(3.5 * v));
    };
    std::vector<DiskCorners> out;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            out.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            out.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return out;
}

bool obscured(const std::vector<DiskCorners>& surface, double x, double y, int apex) {
    for (DiskCorners corners : surface) {
        if (apex == 1)
            for (Vec3& p : corners) p[2] = 2 - p[2];
        if (geometry::segment_meets_triangle(occlusion::near_depth * Vec3(x, y, 1),
                                             occlusion::far_depth * Vec3(x, y, 1), corners))
            return true;
    }
    return false;
}

Vec2 projected(const Vec3& p) {
    constexpr double scale = 105;
    return {150 + scale * (p[2] - 1) * 1.15 + 0.35 * scale * p[0],
            180 - scale * p[1] * 0.95 + 0.3 * scale * p[0]};
}

std::vector<Vec2> rim() {
    std::vector<Vec2> out;
    for (int k = 0; k < 60; ++k)
        out.push_back(
            projected({std::cos(k * std::numbers::pi / 30), std::sin(k * std::numbers::pi / 30), 1}));
    return out;
}

void draw_cones(Svg& svg, const std::vector<DiskCorners>& surface, const occlusion::DiskRaster& raster) {
    const Vec3 apex[] = {{0, 0, 0}, {0, 0, 2}};
    svg.polygon(rim(), {"#eaf1f8", "#08519c", 1.5, 1, ""});
    for (const Vec3& from : apex)
        for (int k = 0; k < 12; ++k) {
            const double angle = k * std::numbers::pi / 6;
            svg.line(projected(from), projected({std::cos(angle), std::sin(angle), 1}),
                     {"none", "#9db8d2", 0.8, 1, ""});
        }
    for (const DiskCorners& corners : surface) {
        const Vec2 points[] = {projected(corners[0]), projected(corners[1]), projected(corners[2])};
        svg.polygon(points, {"#d6442a", "#b03a2e", 0.3, 0.22, ""});
    }
    for (int row = 0; row < raster.size; ++row)
        for (int column = 0; column < raster.size; ++column) {
            const double x = raster.coordinate(column), y = raster.coordinate(row);
            if (x * x + y * y > 1) continue;
            const bool dark = obscured(surface, x, y, 0) || obscured(surface, x, y, 1);
            svg.circle(projected({x, y, 1}), 1.6, {dark ? "#08306b" : "#ffffff", "#08519c", 0.6, 1, ""});
        }
    svg.line(projected(apex[0]), projected(apex[1]), {"none", "#444444", 1, 1, "4 3"});
    const char* names[] = {"i", "j"};
    for (int k = 0; k < 2; ++k) {
        svg.circle(projected(apex[k]), 5, {"#222222", "none", 1, 1, ""});
        svg.text(projected(apex[k]) + Vec2(k == 0 ? -12 : 12, -10), names[k], Anchor::middle, 15);
    }
}

// Draws the samples; bit `which` is set for those occluded from that phyxel.
void draw_mask(Svg& svg, double left, int which, const std::string& title,
               const std::vector<DiskCorners>& surface, const occlusion::DiskRaster& raster) {
    constexpr double texel = 9.5, top = 95;
    int dark_count = 0;
    const auto fill_of = [&](int row, int column) {
        const double x = raster.coordinate(column), y = raster.coordinate(row);
        if (x * x + y * y > 1) return "#e4e4e4";
        for (int apex = 0; apex < 2; ++apex)
            if ((which >> apex & 1) != 0 && obscured(surface, x, y, apex)) return "#08306b";
        return "#ffffff";
    };
    for (int row = 0; row < raster.size; ++row)
        for (int column = 0, end = 0; column < raster.size; column = end) {
            const std::string fill = fill_of(row, column);
            while (end < raster.size && fill_of(row, end) == fill) ++end;
            if (fill == "#08306b") dark_count += end - column;
            const double y = top + (raster.size - 1 - row) * texel;
            const Vec2 points[] = {{left + column * texel, y},
                                   {left + end * texel, y},
                                   {left + end * texel, y + texel},
                                   {left + column * texel, y + texel}};
            svg.polygon(points, {fill, "#b9c7d5", 0.5, 1, ""});
        }
    const double middle = left + 0.5 * raster.size * texel;
    svg.text({middle, top - 16}, title, Anchor::middle, 13);
    svg.text({middle, top + raster.size * texel + 18},
             std::to_string(dark_count) + " of " + std::to_string(raster.sample_count) + " obscured",
             Anchor::middle, 12);
}

}  // namespace

Svg draw_disk() {
    Svg svg(860, 340);
    const std::vector<DiskCorners> surface = cut_surface();
    const occlusion::DiskRaster raster(16);
    draw_cones(svg, surface, raster);
    draw_mask(svg, 330, 1, "seen from i", surface, raster);
    draw_mask(svg, 508, 2, "seen from j, mirrored", surface, raster);
    draw_mask(svg, 686, 3, "either", surface, raster);
    return svg;
}

}  // namespace splitcubes::app::figures
