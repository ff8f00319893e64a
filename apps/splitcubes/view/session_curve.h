// Rate and size over a session, as the paper's figure 8 has them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::view {

/// A step of a session.
struct CurvePoint {
    std::int64_t step = 0;
    double time = 0;            // s, simulated
    double step_ms = 0;         // publishing included
    std::size_t triangles = 0;  // of all bodies
    std::size_t pieces = 0;     // of all bodies
    std::size_t cut_edges = 0;  // of the grids, in this step
};

/// A long session is kept by every second step, every fourth and so on, so that its size is bounded.
class SessionCurve {
  public:
    static constexpr std::size_t max_points = 20000;
    void add(const CurvePoint& point);
    void clear();
    /// Nothing is left of steps after this one.
    void go_back(std::int64_t step);
    const std::vector<CurvePoint>& points() const { return points_; }

  private:
    std::vector<CurvePoint> points_;
    std::int64_t every_ = 1;
};

/// Writes CSV or, for the ending .svg, a diagram: steps a second (median of 15) and number of triangles over
/// the steps, the ones of which cut being marked. Throws InputError for another ending and where there is no
/// step.
void write_curve(const std::filesystem::path& file, const std::string& title,
                 const std::vector<CurvePoint>& points);

}  // namespace splitcubes::view
