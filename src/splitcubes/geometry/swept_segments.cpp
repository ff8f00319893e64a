#include <splitcubes/geometry/swept_segments.h>
#include <splitcubes/geometry/tuning.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace splitcubes::geometry {

namespace {

// Relative motion. Each vector changes linearly from its 0 to its 1; with s along the
// blade and r along the edge the points coincide where s u - r v = w.
struct Relative {
    Vec3 u0, u1;  // along the blade
    Vec3 v0, v1;  // along the edge
    Vec3 w0, w1;  // from the blade's a to the edge's a
};

// The coplanarity function det(u, v, w) as a cubic in Bernstein form. Unlike the power
// basis it has exact values at both ends.
struct Cubic {
    double k[4];

    double at(double t) const {
        const double s = 1 - t;
        return s * s * (s * k[0] + 3 * t * k[1]) + t * t * (3 * s * k[2] + t * k[3]);
    }
    double slope_at(double t) const {
        const double s = 1 - t;
        return 3 * (s * s * (k[1] - k[0]) + 2 * s * t * (k[2] - k[1]) + t * t * (k[3] - k[2]));
    }
};

Cubic coplanarity(const Relative& m) {
    const Vec3 uv00 = m.u0.cross(m.v0);
    const Vec3 uv11 = m.u1.cross(m.v1);
    const Vec3 mixed = m.u1.cross(m.v0) + m.u0.cross(m.v1);
    return {{uv00.dot(m.w0), (mixed.dot(m.w0) + uv00.dot(m.w1)) / 3, (mixed.dot(m.w1) + uv11.dot(m.w0)) / 3,
             uv11.dot(m.w1)}};
}

// Times in (0, 1), at most `capacity`.
struct Times {
    static constexpr std::size_t capacity = 64;
    std::array<double, capacity> time;
    std::size_t count = 0;

    void add(double t) {
        if (t > 0 && t < 1 && count < capacity) time[count++] = t;
    }
    double* begin() { return time.data(); }
    double* end() { return time.data() + count; }
};

// Adds the roots of the quadratic with Bernstein coefficients q0, q1, q2; none if all are zero.
void add_quadratic_roots(double q0, double q1, double q2, Times& times) {
    const double a = q0 - 2 * q1 + q2, half_b = q1 - q0, c = q0;
    const double discriminant = half_b * half_b - a * c;
    if (discriminant < 0) return;
    // Avoids the cancellation of the textbook formula.
    const double q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));
    if (a != 0) times.add(q / a);
    if (q != 0) times.add(c / q);
}

// Returns the root between two times where the cubic is monotone and changes sign, by
// Newton's method with bisection as a fallback.
double root_between(const Cubic& cubic, double low, double high, double low_value, double high_value) {
    double t = low + (high - low) * (low_value / (low_value - high_value));
    for (int iteration = 0; iteration < 60; ++iteration) {
        const double value = cubic.at(t);
        if (value == 0) return t;
        ((value < 0) == (low_value < 0) ? low : high) = t;
        double next = t - value / cubic.slope_at(t);
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (std::abs(next - t) <= 1e-16) return next;
        t = next;
    }
    return t;
}

// Adds the times at which the cubic vanishes or nearly does, in order.
void add_cubic_roots(const Cubic& cubic, double touch, Times& times) {
    const double* k = cubic.k;
    Times bends;
    add_quadratic_roots(k[1] - k[0], k[2] - k[1], k[3] - k[2], bends);
    if (bends.count == 2 && bends.time[0] > bends.time[1]) std::swap(bends.time[0], bends.time[1]);
    bends.time[bends.count++] = 1;
    double low = 0, low_value = k[0];
    for (const double high : bends) {
        const double high_value = high == 1 ? k[3] : cubic.at(high);
        if ((low_value < 0) != (high_value < 0) && low_value != 0 && high_value != 0)
            times.add(root_between(cubic, low, high, low_value, high_value));
        if (std::abs(high_value) <= touch) times.add(high);
        low = high;
        low_value = high_value;
    }
}

// Adds the times at which the point x, relative to the line's start, is on the line along d.
void add_point_on_line(const Vec3& x0, const Vec3& x1, const Vec3& d0, const Vec3& d1, Times& times) {
    const Vec3 q0 = x0.cross(d0), q2 = x1.cross(d1);
    const Vec3 q1 = 0.5 * (x0.cross(d1) + x1.cross(d0));
    for (int axis = 0; axis < 3; ++axis) {
        add_quadratic_roots(q0[axis], q1[axis], q2[axis], times);
        // Rounding can hide the double root of a grazing contact.
        times.add((q0[axis] - q1[axis]) / (q0[axis] - 2 * q1[axis] + q2[axis]));
    }
}

// Adds the time at which two points with the difference x are closest.
void add_nearest(const Vec3& x0, const Vec3& x1, Times& times) {
    const Vec3 dx = x1 - x0;
    times.add(-x0.dot(dx) / dx.squaredNorm());
}

// Adds the times at which an end of one segment reaches the other: segments that stay
// coplanar first touch at such a time.
void add_end_contacts(const Relative& m, Times& times) {
    const Vec3 wv0 = m.w0 + m.v0, wv1 = m.w1 + m.v1;
    const Vec3 wu0 = m.w0 - m.u0, wu1 = m.w1 - m.u1;
    add_point_on_line(m.w0, m.w1, m.u0, m.u1, times);
    add_point_on_line(wv0, wv1, m.u0, m.u1, times);
    add_point_on_line(m.w0, m.w1, m.v0, m.v1, times);
    add_point_on_line(wu0, wu1, m.v0, m.v1, times);
    add_nearest(m.w0, m.w1, times);
    add_nearest(wv0, wv1, times);
    add_nearest(wu0, wu1, times);
    add_nearest(wu0 + m.v0, wu1 + m.v1, times);
}

double clamped_ratio(double numerator, double denominator) {
    return denominator > 0 ? std::clamp(numerator / denominator, 0.0, 1.0) : 0.0;
}

// Computes the segments' closest points at time t; returns a hit if they are within the
// tolerance (compare Ericson 2005, section 5.1.9).
std::optional<SegmentHit> touch_at(const Relative& m, double t, double tolerance) {
    const Vec3 u = moving_point(m.u0, m.u1, t), v = moving_point(m.v0, m.v1, t);
    const Vec3 w = moving_point(m.w0, m.w1, t);
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
    const double uw = u.dot(w), vw = v.dot(w);
    // Uses the cross product: uu vv - uv^2 cancels for nearly parallel segments.
    const Vec3 normal = u.cross(v);
    double s = clamped_ratio(w.cross(v).dot(normal), normal.squaredNorm());
    double r = vv > 0 ? (s * uv - vw) / vv : 0.0;
    if (!(r >= 0 && r <= 1) || vv == 0) {
        r = std::clamp(r, 0.0, 1.0);
        s = clamped_ratio(uw + r * uv, uu);
    }
    if (!((s * u - r * v - w).squaredNorm() <= tolerance * tolerance)) return std::nullopt;
    return SegmentHit{t, s, r};
}

std::optional<SegmentHit> first_touch(const Relative& m) {
    const double u = std::sqrt(std::max(m.u0.squaredNorm(), m.u1.squaredNorm()));
    const double v = std::sqrt(std::max(m.v0.squaredNorm(), m.v1.squaredNorm()));
    const double w = std::sqrt(std::max(m.w0.squaredNorm(), m.w1.squaredNorm()));
    const double scale = u * v * w;
    if (!std::isfinite(scale)) return std::nullopt;

    const Cubic cubic = coplanarity(m);
    const auto [low, high] = std::minmax({cubic.k[0], cubic.k[1], cubic.k[2], cubic.k[3]});
    const double touch = tuning::swept_segments::touch_share * scale;
    if (low > touch || high < -touch) return std::nullopt;  // convex hull of the Bernstein coefficients

    double tolerance = 1e-7 * std::min(u, v) + 1e-11 * (u + v + w);
    Times times;
    const bool coplanar = std::max(-low, high) <= tuning::swept_segments::coplanar_share * scale;
    add_cubic_roots(cubic, touch, times);
    if (coplanar) {
        // The distance that such segments may have across their plane.
        tolerance += 4 * tuning::swept_segments::coplanar_share * (u + v + w);
        add_end_contacts(m, times);
        std::sort(times.begin(), times.end());
    }
    if (coplanar || std::abs(cubic.k[0]) <= touch)
        if (const auto hit = touch_at(m, 0, tolerance)) return hit;
    for (const double t : times)
        if (const auto hit = touch_at(m, t, tolerance)) return hit;
    if (coplanar || std::abs(cubic.k[3]) <= touch) return touch_at(m, 1, tolerance);
    return std::nullopt;
}

// Returns whether the boxes of the two motions meet; most pairs are rejected by the first axis.
bool boxes_meet(const MovingSegment& blade, const MovingSegment& edge) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto low = [axis](const MovingSegment& s) {
            return std::min(std::min(s.a0[axis], s.b0[axis]), std::min(s.a1[axis], s.b1[axis]));
        };
        const auto high = [axis](const MovingSegment& s) {
            return std::max(std::max(s.a0[axis], s.b0[axis]), std::max(s.a1[axis], s.b1[axis]));
        };
        if (!(low(blade) <= high(edge)) || !(low(edge) <= high(blade))) return false;
    }
    return true;
}

}  // namespace

std::optional<SegmentHit> first_hit(const MovingSegment& blade, const MovingSegment& edge) {
    if (!boxes_meet(blade, edge)) return std::nullopt;
    return first_touch({blade.b0 - blade.a0, blade.b1 - blade.a1, edge.b0 - edge.a0, edge.b1 - edge.a1,
                        edge.a0 - blade.a0, edge.a1 - blade.a1});
}

}  // namespace splitcubes::geometry
