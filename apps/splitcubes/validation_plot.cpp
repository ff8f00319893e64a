#include "validation.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

namespace splitcubes::app {

namespace {

constexpr double left = 70, top = 20, wide = 480, high = 320;  // of the axes, in picture units

// 2 to 16 phyxels and 0.1 to 1000 %, logarithmic.
double x_of(double across) {
    return left + wide * std::log2(across / 2) / 3;
}
double y_of(double error) {
    return top + high * (1 - (std::log10(std::max(std::abs(error), 1e-3)) + 3) / 4);
}

void draw_axes(std::ostream& svg) {
    svg << "<rect width=\"760\" height=\"400\" fill=\"white\"/>\n<g stroke=\"#ccc\">\n";
    for (const double e : {1e-3, 1e-2, 1e-1, 1.0, 10.0})
        svg << "<path d=\"M" << left << ' ' << y_of(e) << 'h' << wide << "\"/>\n";
    for (const int n : {2, 3, 4, 6, 8, 12, 16})
        svg << "<path d=\"M" << x_of(n) << ' ' << top << 'v' << high << "\"/>\n";
    svg << "</g>\n<g fill=\"#333\" text-anchor=\"end\">\n";
    for (const double e : {1e-3, 1e-2, 1e-1, 1.0, 10.0})
        svg << "<text x=\"" << left - 6 << "\" y=\"" << y_of(e) + 4 << "\">" << 100 * e << " %</text>\n";
    svg << "</g>\n<g fill=\"#333\" text-anchor=\"middle\">\n";
    for (const int n : {2, 3, 4, 6, 8, 12, 16})
        svg << "<text x=\"" << x_of(n) << "\" y=\"" << top + high + 18 << "\">" << n << "</text>\n";
    svg << "<text x=\"" << left + wide / 2 << "\" y=\"" << top + high + 40
        << "\">phyxels across (crack: along half its length)</text>\n</g>\n";
}

}  // namespace

std::string error_plot(const std::vector<ValidationPoint>& points) {
    static constexpr const char* colours[] = {"#c0392b", "#2471a3", "#229954",
                                              "#8e44ad", "#d68910", "#117a65"};
    std::ostringstream svg;
    svg.imbue(std::locale::classic());
    svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 400\" font-family=\"sans-serif\" "
           "font-size=\"13\">\n";
    draw_axes(svg);
    std::size_t line = 0;
    for (std::size_t begin = 0, end = 0; begin < points.size(); begin = end, ++line) {
        const char* colour = colours[line % std::size(colours)];
        // Colours repeat with dashes.
        const char* dashes = line < std::size(colours) ? "" : " stroke-dasharray=\"6 4\"";
        svg << "<g stroke=\"" << colour << "\" fill=\"none\" stroke-width=\"2\"" << dashes << "><path d=\"";
        for (; end < points.size() && points[end].test == points[begin].test; ++end)
            svg << (end == begin ? 'M' : 'L') << x_of(points[end].across) << ' ' << y_of(points[end].error());
        svg << "\"/>\n";
        for (std::size_t k = begin; k < end; ++k)
            svg << "<circle cx=\"" << x_of(points[k].across) << "\" cy=\"" << y_of(points[k].error())
                << "\" r=\"3\" fill=\"" << colour << "\"/>\n";
        const double y = top + 20 + 22 * static_cast<double>(line);
        svg << "<path d=\"M" << left + wide + 16 << ' ' << y << "h22\"/></g>\n<text x=\"" << left + wide + 44
            << "\" y=\"" << y + 4 << "\">" << points[begin].test << "</text>\n";
    }
    svg << "</svg>\n";
    return svg.str();
}

}  // namespace splitcubes::app
