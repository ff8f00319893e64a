#include "svg.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace splitcubes::app::figures {

namespace {

std::string number(double value) {
    const double hundredths = std::round(value * 100) + 0.0;  // no -0
    char text[32];
    std::snprintf(text, sizeof text, "%.2f", hundredths / 100);
    std::string out = text;
    while (out.back() == '0') out.pop_back();
    if (out.back() == '.') out.pop_back();
    return out;
}

std::string escaped(const std::string& words) {
    std::string out;
    for (const char c : words) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else
            out += c;
    }
    return out;
}

std::string attributes(const Style& style) {
    std::string out = " fill=\"" + style.fill + "\"";
    if (style.fill_opacity < 1) out += " fill-opacity=\"" + number(style.fill_opacity) + "\"";
    if (style.stroke != "none")
        out += " stroke=\"" + style.stroke + "\" stroke-width=\"" + number(style.width) + "\"";
    if (!style.dashes.empty()) out += " stroke-dasharray=\"" + style.dashes + "\"";
    return out;
}

}  // namespace

Svg::Svg(double width, double height) : width_(width), height_(height) {}

void Svg::shape(const char* element, std::span<const Vec2> points, const Style& style) {
    body_ += std::string("  <") + element + " points=\"";
    for (const Vec2& p : points)
        body_ += (&p == points.data() ? "" : " ") + number(p[0]) + "," + number(p[1]);
    body_ += "\"" + attributes(style) + " stroke-linejoin=\"round\" stroke-linecap=\"round\"/>\n";
}

void Svg::line(const Vec2& from, const Vec2& to, const Style& style) {
    const std::array<Vec2, 2> points{from, to};
    polyline(points, style);
}

void Svg::polyline(std::span<const Vec2> points, const Style& style) {
    shape("polyline", points, style);
}

void Svg::polygon(std::span<const Vec2> points, const Style& style) {
    shape("polygon", points, style);
}

void Svg::circle(const Vec2& centre, double radius, const Style& style) {
    body_ += "  <circle cx=\"" + number(centre[0]) + "\" cy=\"" + number(centre[1]) + "\" r=\"" +
             number(radius) + "\"" + attributes(style) + "/>\n";
}

void Svg::arrow(const Vec2& from, const Vec2& to, const Style& style) {
    const Vec2 along = (to - from).normalized(), across(-along[1], along[0]);
    const std::array<Vec2, 3> head{to, to - 8 * along + 3.5 * across, to - 8 * along - 3.5 * across};
    line(from, to - 6 * along, style);
    polygon(head, {.fill = style.stroke});
}

void Svg::text(const Vec2& at, const std::string& words, Anchor anchor, double size,
               const std::string& colour, bool bold) {
    static constexpr std::array<const char*, 3> anchors{"start", "middle", "end"};
    body_ += "  <text x=\"" + number(at[0]) + "\" y=\"" + number(at[1] + 0.35 * size) + "\" font-size=\"" +
             number(size) + "\" fill=\"" + colour + "\" text-anchor=\"" +
             anchors[static_cast<std::size_t>(anchor)] + "\"" + (bold ? " font-weight=\"bold\"" : "") + ">" +
             escaped(words) + "</text>\n";
}

std::string Svg::document() const {
    const std::string size = number(width_) + " " + number(height_);
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(width_) + "\" height=\"" +
           number(height_) + "\" viewBox=\"0 0 " + size +
           "\" font-family=\"Helvetica, Arial, sans-serif\">\n"
           "  <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n" +
           body_ + "</svg>\n";
}

}  // namespace splitcubes::app::figures
