#include <splitcubes/cutting/sweep.h>
#include <splitcubes/cutting/tuning.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::cutting {

namespace {

// Rounds a number of parts up, with a tolerance: a part of the maximum size is not divided again, so a
// recorded sweep has the same parts as the original.
double part_count(double parts) {
    return std::ceil(parts * (1 - 1e-9));
}

// Appends the times, without `from`, that divide [from, until], a part of one span between keyframes or of
// the time before or after all of them.
void add_times(const Blade& blade, double from, double until, std::vector<double>& times) {
    const std::vector<Keyframe>& keys = blade.keyframes();
    const auto after = std::upper_bound(keys.begin(), keys.end(), from,
                                        [](double t, const Keyframe& key) { return t < key.time; });
    double parts = 1;
    if (after != keys.begin() && after != keys.end()) {
        const Keyframe &a = *(after - 1), &b = *after;
        const double share = (until - from) / (b.time - a.time);
        parts = std::max(parts, part_count(share * a.rotation.angularDistance(b.rotation) / max_turn));
        if (blade.interpolation() == PathInterpolation::smooth)
            parts = std::max(parts, part_count(share * tuning::sweep::parts_per_smooth_span));
    }
    for (int k = 1; k < static_cast<int>(parts); ++k) {
        const double time = from + (until - from) * (k / parts);
        if (time > times.back() && time < until) times.push_back(time);
    }
    times.push_back(until);
}

SweptBlade between(const std::vector<std::vector<Vec3>>& before,
                   const std::vector<std::vector<Vec3>>& after) {
    SweptBlade out;
    for (std::size_t line = 0; line < before.size(); ++line) {
        const std::vector<Vec3>&p = before[line], &q = after[line];
        for (std::size_t i = 0; i + 1 < p.size(); ++i) {
            out.segments.push_back({p[i], p[i + 1], q[i], q[i + 1]});
            out.bounds.add(geometry::bounds_of(out.segments.back()));
        }
    }
    return out;
}

}  // namespace

std::vector<double> sweep_times(const Blade& blade, double t0, double t1) {
    assert(t0 <= t1);
    const double from = std::max(t0, blade.active_from()), until = std::min(t1, blade.active_until());
    if (!(until > from)) return {};
    std::vector<double> times = {from};
    const std::vector<Keyframe>& keys = blade.keyframes();
    auto key = std::upper_bound(keys.begin(), keys.end(), from,
                                [](double t, const Keyframe& k) { return t < k.time; });
    for (; key != keys.end() && key->time < until; ++key) add_times(blade, times.back(), key->time, times);
    add_times(blade, times.back(), until, times);
    return times;
}

std::vector<SweptBlade> sweep(const Blade& blade, double t0, double t1) {
    const std::vector<double> times = sweep_times(blade, t0, t1);
    std::vector<SweptBlade> out;
    if (times.empty()) return out;

    std::vector<std::vector<Vec3>> before = blade.pose(times.front());
    for (std::size_t k = 1; k < times.size(); ++k) {
        std::vector<std::vector<Vec3>> after = blade.pose(times[k]);
        out.push_back(between(before, after));
        out.back().begin = (times[k - 1] - t0) / (t1 - t0);
        out.back().end = (times[k] - t0) / (t1 - t0);
        before = std::move(after);
    }
    return out;
}

}  // namespace splitcubes::cutting
