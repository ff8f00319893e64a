#include "weights.h"

#include "weight_field.h"

#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/render/image.h>
#endif

#include <cmath>

namespace splitcubes::app::figures {

namespace {

constexpr double half_width = 3.4;  // of the view, spacings

std::vector<CutScene> cuts() {
    std::vector<CutScene> out;
    out.push_back(make_cut("partial", {{-far_away, 0.6}}));
    out.push_back(make_cut("complete", {{-far_away, far_away}}));
    out.push_back(make_cut("gap", {{-far_away, -0.35}, {0.35, far_away}}));
    return out;
}

// Returns the weights at the centres of side x side squares, row by row from the top.
std::vector<double> weights(const CutScene& scene, occlusion::CriterionKind kind, int side,
                            std::vector<Vec3>& points) {
    points.clear();
    for (int row = 0; row < side; ++row)
        for (int column = 0; column < side; ++column)
            points.emplace_back(half_width * ((2 * column + 1.0) / side - 1),
                                half_width * (1 - (2 * row + 1.0) / side), 0);
    std::vector<double> out = factors(scene, kind, points);
    for (std::size_t k = 0; k < out.size(); ++k) out[k] *= kernel_weight(points[k].norm());
    return out;
}

}  // namespace

void write_weights(const std::filesystem::path& csv) {
    io::AtomicFile file(csv);
    file.stream() << "cut,criterion,x,y,weight\n";
    std::vector<Vec3> points;
    for (const CutScene& scene : cuts())
        for (std::size_t k = 0; k < occlusion::criterion_names.size(); ++k) {
            const auto values = weights(scene, static_cast<occlusion::CriterionKind>(k), 61, points);
            for (std::size_t p = 0; p < points.size(); ++p)
                file.stream() << scene.name << ',' << occlusion::criterion_names[k] << ',' << points[p][0]
                              << ',' << points[p][1] << ',' << values[p] << '\n';
        }
    file.commit();
}

#ifdef SPLITCUBES_WITH_RENDER

namespace {

constexpr int panel = 240, margin = 8;  // pixels

// Isolines at tenths, and a bold one at the weight of the nearest phyxels without a cut.
bool on_isoline(double value, double right, double below, double level) {
    return (value < level) != (right < level) || (value < level) != (below < level);
}

Vec3 colour(double weight) {
    const Vec3 low(0.97, 0.98, 1.0), middle(0.42, 0.68, 0.84), high(0.03, 0.19, 0.42);
    return weight < 0.5 ? Vec3(low + 2 * weight * (middle - low))
                        : Vec3(middle + (2 * weight - 1) * (high - middle));
}

struct Canvas {
    render::Picture picture;

    void set(int column, int row, const Vec3& sRGB) {
        if (column < 0 || row < 0 || column >= picture.width || row >= picture.height) return;
        auto* pixel = picture.rgb.data() + 3 * (row * picture.width + column);
        for (int k = 0; k < 3; ++k) pixel[k] = static_cast<std::uint8_t>(std::lround(255 * sRGB[k]));
    }
};

void draw_field(Canvas& canvas, int left, int top, const CutScene& scene, const std::vector<double>& values) {
    const auto at = [&](int column, int row) {
        return values[static_cast<std::size_t>(std::min(row, panel - 1) * panel +
                                               std::min(column, panel - 1))];
    };
    for (int row = 0; row < panel; ++row)
        for (int column = 0; column < panel; ++column) {
            const double here = at(column, row), right = at(column + 1, row), below = at(column, row + 1);
            Vec3 c = colour(here);
            for (int k = 1; k < 10; ++k)
                if (on_isoline(here, right, below, 0.1 * k)) c = Vec3(0.45, 0.5, 0.55);
            canvas.set(left + column, top + row, c);
        }
    const double next = kernel_weight(1);
    for (int row = 0; row < panel; ++row)
        for (int column = 0; column < panel; ++column)
            if (on_isoline(at(column, row), at(column + 1, row), at(column, row + 1), next))
                for (int d = 0; d < 4; ++d)
                    if (column + d % 2 < panel && row + d / 2 < panel)
                        canvas.set(left + column + d % 2, top + row + d / 2, Vec3(0.95, 0.6, 0.1));
    const double pixels = panel / (2 * half_width);  // per spacing
    for (const auto& [from, until] : scene.cut)
        for (int row = 0; row < panel; ++row) {
            const double y = half_width - (row + 0.5) / pixels;
            if (y < from || y > until) continue;
            const int column = static_cast<int>(std::lround((half_width + 0.5) * pixels));
            for (int d = -1; d < 1; ++d) canvas.set(left + column + d, top + row, Vec3(0.8, 0.1, 0.1));
        }
    for (int y = -3; y <= 3; ++y)
        for (int x = -3; x <= 3; ++x)
            if (x * x + y * y <= 10)
                canvas.set(left + panel / 2 + x, top + panel / 2 + y,
                           x * x + y * y <= 5 ? Vec3(1, 1, 1) : Vec3(0, 0, 0));
}

}  // namespace

void draw_weights(const std::filesystem::path& picture) {
    const auto scenes = cuts();
    const auto columns = static_cast<int>(scenes.size()),
               rows = static_cast<int>(occlusion::criterion_names.size());
    Canvas canvas;
    canvas.picture.width = columns * panel + (columns + 1) * margin;
    canvas.picture.height = rows * panel + (rows + 1) * margin;
    canvas.picture.rgb.assign(static_cast<std::size_t>(3 * canvas.picture.width * canvas.picture.height),
                              255);
    std::vector<Vec3> points;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const CutScene& scene = scenes[static_cast<std::size_t>(column)];
            const auto values = weights(scene, static_cast<occlusion::CriterionKind>(row), panel, points);
            draw_field(canvas, margin + column * (panel + margin), margin + row * (panel + margin), scene,
                       values);
        }
    render::write_png(picture, canvas.picture);
}

#else

void draw_weights(const std::filesystem::path&) {
    throw JobError("figure weights: this program was built without pictures (SPLITCUBES_BUILD_RENDER)");
}

#endif

}  // namespace splitcubes::app::figures
