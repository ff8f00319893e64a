#include <splitcubes/core/error.h>
#include <splitcubes/math/sampled_motion.h>

#include <algorithm>
#include <cmath>

namespace splitcubes {

void SampledMotion::add(double time, const Isometry& frame) {
    const std::string where = "motion, sample " + std::to_string(times_.size());
    if (!std::isfinite(time) || !frame.matrix().allFinite())
        throw InputError(where, "is not finite", "give a time and a frame of finite numbers");
    if (!times_.empty() && !(time > times_.back()))
        throw InputError(
            where, std::to_string(time) + " s does not come after " + std::to_string(times_.back()) + " s",
            "order the samples by time");
    times_.push_back(time);
    frames_.push_back(frame);
}

std::size_t SampledMotion::forget_before(double time) {
    const auto after = std::upper_bound(times_.begin(), times_.end(), time);
    if (after - times_.begin() < 2) return 0;
    const auto count = after - times_.begin() - 1;
    times_.erase(times_.begin(), times_.begin() + count);
    frames_.erase(frames_.begin(), frames_.begin() + count);
    return static_cast<std::size_t>(count);
}

Isometry SampledMotion::at(double time) const {
    const auto after = std::upper_bound(times_.begin(), times_.end(), time);
    if (after == times_.begin()) return frames_.front();
    const auto k = static_cast<std::size_t>(after - times_.begin()) - 1;
    if (after == times_.end() || time == times_[k] || frames_[k].matrix() == frames_[k + 1].matrix())
        return frames_[k];
    const double f = (time - times_[k]) / (times_[k + 1] - times_[k]);
    const Isometry &a = frames_[k], &b = frames_[k + 1];
    Isometry out = Isometry::Identity();
    out.linear() = Quat(a.linear()).slerp(f, Quat(b.linear())).normalized().toRotationMatrix();
    out.translation() = (1 - f) * a.translation() + f * b.translation();
    return out;
}

}  // namespace splitcubes
