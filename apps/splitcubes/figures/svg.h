// SVG drawings: lines, outlines, dots and text on a white background.
#pragma once

#include <splitcubes/math/types.h>

#include <span>
#include <string>

namespace splitcubes::app::figures {

/// Drawing style. Colours in SVG syntax; lengths in pixels.
struct Style {
    std::string fill = "none";
    std::string stroke = "none";
    double width = 1.5;
    double fill_opacity = 1;
    std::string dashes = "";  // "4 3"; empty: solid line
};

enum class Anchor { start, middle, end };

/// An SVG document in pixels from the upper left corner, y downward. Numbers have two decimals, so that the
/// text does not depend on the last digits of a maths library.
class Svg {
  public:
    Svg(double width, double height);

    void line(const Vec2& from, const Vec2& to, const Style& style);
    void polyline(std::span<const Vec2> points, const Style& style);
    void polygon(std::span<const Vec2> points, const Style& style);
    void circle(const Vec2& centre, double radius, const Style& style);
    /// Draws a line with an arrow head at its end.
    void arrow(const Vec2& from, const Vec2& to, const Style& style);
    /// at: vertical middle of the text.
    void text(const Vec2& at, const std::string& words, Anchor anchor = Anchor::middle, double size = 13,
              const std::string& colour = "#222222", bool bold = false);

    /// Returns the whole document.
    std::string document() const;

  private:
    void shape(const char* element, std::span<const Vec2> points, const Style& style);

    double width_, height_;
    std::string body_;
};

}  // namespace splitcubes::app::figures
