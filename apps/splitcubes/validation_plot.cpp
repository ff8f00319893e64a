#include "validation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

namespace splitcubes::app {

namespace {

// A grid of areas, one a test, in picture units.
constexpr double wide = 176, high = 132;             // of an area's axes
constexpr double pitch_x = 230, pitch_y = 196;       // from area to area
constexpr double margin_left = 52, margin_top = 34;  // of the first one
constexpr std::size_t columns = 4;

constexpr const char* mesh_free = "#c0392b";
constexpr const char* linear = "#2471a3";
constexpr const char* quadratic = "#229954";

// 2 to 16 phyxels and 0.1 to 1000 %, logarithmic; what is beyond lies on the border.
double x_of(double across) {
    return wide * std::log2(across / 2) / 3;
}
double y_of(double off) {
    return high * (1 - (std::log10(std::clamp(off, 1e-3, 10.0)) + 3) / 4);
}

void begin_area(std::ostream& svg, std::size_t index) {
    svg << "<g transform=\"translate(" << margin_left + pitch_x * static_cast<double>(index % columns) << ' '
        << margin_top + pitch_y * static_cast<double>(index / columns) << ")\">\n";
}

void draw_axes(std::ostream& svg, const std::string& title) {
    svg << "<g stroke=\"#ccc\" fill=\"none\"><path d=\"";
    for (const double e : {1e-3, 1e-2, 1e-1, 1.0, 10.0}) svg << "M0 " << y_of(e) << 'h' << wide;
    for (const int n : {2, 3, 4, 6, 8, 12, 16}) svg << 'M' << x_of(n) << " 0v" << high;
    svg << "\"/></g>\n<text x=\"" << wide / 2 << "\" y=\"-8\" text-anchor=\"middle\" font-size=\"13\">"
        << title << "</text>\n<g fill=\"#333\" text-anchor=\"end\">";
    for (const double e : {1e-3, 1e-2, 1e-1, 1.0, 10.0})
        svg << "<text x=\"-5\" y=\"" << y_of(e) + 4 << "\">" << 100 * e << " %</text>";
    svg << "</g>\n<g fill=\"#333\" text-anchor=\"middle\">";
    for (const int n : {2, 3, 4, 6, 8, 12, 16})
        svg << "<text x=\"" << x_of(n) << "\" y=\"" << high + 15 << "\">" << n << "</text>";
    svg << "</g>\n";
}

struct Marker {
    double x = 0, y = 0;
    bool is_above = true;  // the reference
};

// Filled: more than the reference, hollow: less.
void draw_line(std::ostream& svg, const char* colour, const std::vector<Marker>& markers) {
    if (markers.empty()) return;
    svg << "<g stroke=\"" << colour << "\" stroke-width=\"2\" fill=\"none\"><path d=\"";
    for (std::size_t k = 0; k < markers.size(); ++k)
        svg << (k == 0 ? 'M' : 'L') << markers[k].x << ' ' << markers[k].y;
    svg << "\"/>";
    for (const Marker& m : markers)
        svg << "<circle cx=\"" << m.x << "\" cy=\"" << m.y << "\" r=\"3\" fill=\""
            << (m.is_above ? colour : "white") << "\"/>";
    svg << "</g>\n";
}

void draw_theory(std::ostream& svg, double y, double length = wide) {
    svg << "<path d=\"M0 " << y << 'h' << length << "\" stroke=\"#555\" stroke-dasharray=\"5 4\"/>\n";
}

void draw_test(std::ostream& svg, const std::vector<ValidationPoint>& points,
               const TetrahedraResults& tetrahedra) {
    draw_axes(svg, points.front().test);
    const std::string& test = points.front().test;
    const auto marker = [&](int across, double error) {
        const double ratio = tetrahedra.ratio_to_finest(test, error);
        return Marker{x_of(across), y_of(deviation(ratio)), ratio > 1};
    };
    if (tetrahedra.fine.contains(test)) draw_theory(svg, marker(2, 0).y);
    std::vector<Marker> own, coarse, curved;
    for (const ValidationPoint& p : points) {
        own.push_back(marker(p.across, p.error()));
        const auto beside = tetrahedra.points.find({test, p.across});
        if (beside == tetrahedra.points.end()) continue;
        coarse.push_back(marker(p.across, beside->second.linear.error));
        curved.push_back(marker(p.across, beside->second.quadratic.error));
    }
    draw_line(svg, linear, coarse);
    draw_line(svg, quadratic, curved);
    draw_line(svg, mesh_free, own);
}

void draw_legend(std::ostream& svg, bool compares) {
    double y = 12;
    const auto entry = [&](const char* text, const std::function<void()>& draw) {
        draw();
        svg << "<text x=\"34\" y=\"" << y + 4 << "\">" << text << "</text>\n";
        y += 22;
    };
    const auto line = [&](const char* text, const char* colour) {
        entry(text, [&] { draw_line(svg, colour, {{0, y}, {24, y}}); });
    };
    line("phyxels", mesh_free);
    if (compares) {
        line("linear tetrahedra", linear);
        line("quadratic tetrahedra", quadratic);
        entry("theory", [&] { draw_theory(svg, y, 24); });
    }
    const std::string reference = compares ? "the finest mesh" : "theory";
    for (const std::string& text :
         {"deviation from " + reference + ",", std::string("over phyxels across (crack: along"),
          std::string("half its length); filled: more than"), reference + ", hollow: less"}) {
        svg << "<text y=\"" << y + 4 << "\">" << text << "</text>\n";
        y += 16;
    }
}

}  // namespace

std::string error_plot(const std::vector<ValidationPoint>& points, const TetrahedraResults& tetrahedra) {
    std::ostringstream areas;
    areas.imbue(std::locale::classic());
    std::size_t area = 0;
    for (std::size_t begin = 0, end = 0; begin < points.size(); begin = end, ++area) {
        while (end < points.size() && points[end].test == points[begin].test) ++end;
        begin_area(areas, area);
        draw_test(areas,
                  {points.begin() + static_cast<std::ptrdiff_t>(begin),
                   points.begin() + static_cast<std::ptrdiff_t>(end)},
                  tetrahedra);
        areas << "</g>\n";
    }
    begin_area(areas, area);
    draw_legend(areas, !tetrahedra.points.empty());
    areas << "</g>\n";
    const double height = margin_top + pitch_y * static_cast<double>(area / columns + 1);
    std::ostringstream svg;
    svg.imbue(std::locale::classic());
    svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 960 " << height
        << "\" font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"960\" height=\"" << height
        << "\" fill=\"white\"/>\n"
        << areas.str() << "</svg>\n";
    return svg.str();
}

}  // namespace splitcubes::app
