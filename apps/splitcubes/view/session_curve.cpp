#include "session_curve.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace splitcubes::view {

namespace {

std::string csv_of(const std::vector<CurvePoint>& points) {
    std::string out = "step,time_s,step_ms,steps_per_second,triangles,pieces,cut_edges\n";
    for (const CurvePoint& p : points)
        out += std::to_string(p.step) + ',' + plain_number(p.time, 9) + ',' + plain_number(p.step_ms, 6) +
               ',' + plain_number(1e3 / std::max(p.step_ms, 1e-6), 6) + ',' + std::to_string(p.triangles) +
               ',' + std::to_string(p.pieces) + ',' + std::to_string(p.cut_edges) + '\n';
    return out;
}

// The next of 1, 2, 5, 10, ... that is not below.
double axis_end(double value) {
    const double power = std::pow(10.0, std::floor(std::log10(std::max(value, 1e-9))));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= value) return factor * power;
    return 10 * power;
}

std::vector<double> medians(const std::vector<CurvePoint>& points) {
    constexpr std::size_t reach = 7;
    std::vector<double> out;
    for (std::size_t k = 0; k < points.size(); ++k) {
        const std::size_t first = k - std::min(k, reach), last = std::min(points.size(), k + reach + 1);
        std::vector<double> around;
        for (std::size_t i = first; i < last; ++i) around.push_back(1e3 / std::max(points[i].step_ms, 1e-6));
        std::nth_element(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2),
                         around.end());
        out.push_back(around[around.size() / 2]);
    }
    return out;
}

/// A diagram with an axis at either side.
class Diagram {
  public:
    static constexpr double width = 720, height = 340, left = 70, right = 80, top = 44, bottom = 48;

    Diagram(const std::string& title, double steps) : steps_(std::max(steps, 1.0)) {
        out_ =
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"720\" height=\"340\" "
            "viewBox=\"0 0 720 340\" font-family=\"sans-serif\" font-size=\"12\">\n"
            "<rect width=\"720\" height=\"340\" fill=\"white\"/>\n";
        text(width / 2, 20, "middle", "#222222", title);
        text((left + width - right) / 2, height - 10, "middle", "#222222", "step");
    }
    double x(double step) const { return left + (width - left - right) * step / steps_; }
    static double y(double share) { return height - bottom - (height - top - bottom) * share; }

    void text(double x, double y, const char* anchor, const char* colour, const std::string& content) {
        std::string escaped;
        for (const char c : content)
            escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
        out_ += "<text x=\"" + plain_number(x, 5) + "\" y=\"" + plain_number(y, 5) + "\" text-anchor=\"" +
                anchor + "\" fill=\"" + colour + "\">" + escaped + "</text>\n";
    }
    void line(double x0, double y0, double x1, double y1, const char* colour, double line_width) {
        out_ += "<path d=\"M" + plain_number(x0, 5) + ' ' + plain_number(y0, 5) + 'L' + plain_number(x1, 5) +
                ' ' + plain_number(y1, 5) + "\" stroke=\"" + colour + "\" stroke-width=\"" +
                plain_number(line_width, 3) + "\" fill=\"none\"/>\n";
    }
    void axis(double high, bool on_the_right, const char* colour, const std::string& label) {
        const double at = on_the_right ? width - right : left;
        for (int k = 0; k <= 5; ++k) {
            const double height_there = y(k / 5.0);
            if (!on_the_right) line(left, height_there, width - right, height_there, "#e4e7eb", 1);
            text(on_the_right ? at + 6 : at - 6, height_there + 4, on_the_right ? "start" : "end", colour,
                 plain_number(high * k / 5, 4));
        }
        text(on_the_right ? width - 4 : 4, top - 10, on_the_right ? "end" : "start", colour, label);
    }
    void curve(const std::vector<CurvePoint>& points, double high, const char* colour,
               const std::function<double(std::size_t)>& value) {
        out_ += "<path d=\"";
        // A column of pixels takes a few points.
        const std::size_t every = points.size() / 2000 + 1;
        for (std::size_t k = 0; k < points.size(); k += every)
            out_ += (k == 0 ? "M" : "L") + plain_number(x(static_cast<double>(points[k].step)), 5) + ' ' +
                    plain_number(y(std::min(1.0, value(k) / high)), 5);
        out_ += std::string("\" stroke=\"") + colour + "\" stroke-width=\"1.6\" fill=\"none\"/>\n";
    }
    std::string finish() { return out_ + "</svg>\n"; }

  private:
    double steps_;
    std::string out_;
};

std::string svg_of(const std::string& title, const std::vector<CurvePoint>& points) {
    constexpr const char *blue = "#1f5fa8", *red = "#c8281e";
    const std::vector<double> rates = medians(points);
    double top_triangles = 0, top_rate = 0;
    for (const CurvePoint& p : points)
        top_triangles = std::max(top_triangles, static_cast<double>(p.triangles));
    for (const double rate : rates) top_rate = std::max(top_rate, rate);
    top_triangles = axis_end(top_triangles);
    top_rate = axis_end(top_rate);
    Diagram out(title, static_cast<double>(points.back().step));
    out.axis(top_rate, false, blue, "steps a second");
    out.axis(top_triangles, true, red, "triangles");
    const auto last = static_cast<double>(points.back().step);
    for (double step = 0, apart = std::max(1.0, axis_end(last / 8)); step <= last; step += apart) {
        out.text(out.x(step), Diagram::height - Diagram::bottom + 18, "middle", "#222222",
                 plain_number(step, 7));
    }
    for (const CurvePoint& p : points)
        if (p.cut_edges > 0) {
            const double at = out.x(static_cast<double>(p.step));
            out.line(at, Diagram::y(0), at, Diagram::y(-0.025), "#222222", 0.8);
        }
    out.curve(points, top_triangles, red,
              [&](std::size_t k) { return static_cast<double>(points[k].triangles); });
    out.curve(points, top_rate, blue, [&](std::size_t k) { return rates[k]; });
    out.text(Diagram::left, Diagram::height - 10, "start", "#222222", "ticks: steps that cut");
    return out.finish();
}

}  // namespace

void SessionCurve::add(const CurvePoint& point) {
    go_back(point.step - 1);
    // A step that cuts is not lost among those that do not.
    if (point.step % every_ != 0 && point.cut_edges == 0) return;
    points_.push_back(point);
    if (points_.size() <= max_points) return;
    every_ *= 2;
    std::vector<CurvePoint> kept;
    for (std::size_t k = 0; k < points_.size(); k += 2) kept.push_back(points_[k]);
    points_ = std::move(kept);
}

void SessionCurve::clear() {
    points_.clear();
    every_ = 1;
}

void SessionCurve::go_back(std::int64_t step) {
    while (!points_.empty() && points_.back().step > step) points_.pop_back();
}

void write_curve(const std::filesystem::path& file, const std::string& title,
                 const std::vector<CurvePoint>& points) {
    const std::string ending = file.extension().string();
    if (ending != ".svg" && ending != ".csv")
        throw InputError(file.string(), "has an unknown ending", "give FILE.svg or FILE.csv");
    if (points.empty()) throw InputError("rate and triangles", "there is no step yet", "play first");
    write_file(file, ending == ".svg" ? svg_of(title, points) : csv_of(points));
}

}  // namespace splitcubes::view
