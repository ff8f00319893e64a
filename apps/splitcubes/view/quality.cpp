#include "quality.h"

#include <algorithm>

namespace splitcubes::view {

namespace {

constexpr int warming_frames = 1;        // the first one waits for shaders
constexpr double memory = 0.8;           // of the mean
constexpr double hopeless = 3;           // times the limit: one frame is enough
constexpr double least_observed = 0.25;  // s, before a change
// Each finer quality takes at most about 2.5 times as long.
constexpr double fast_frame = 0.35 * QualityControl::slow_frame;
constexpr double longest_patience = 120;  // s
constexpr double quick_failure = 20;      // s: an ascent that failed by then was wrong

}  // namespace

void QualityControl::change(int by, double now) {
    if (by > 0 && ascended_ && now < since_ + quick_failure)
        patience_ = std::min(2 * patience_, longest_patience);
    quality_ = static_cast<Quality>(static_cast<int>(quality_) + by);
    ascended_ = by < 0;
    since_ = fast_since_ = now;
    mean_ = 0;
    counted_ = 0;
}

void QualityControl::drawn(Quality drawn, double seconds, double now) {
    // Pictures of what is at rest are fine ones, and tell about no other quality.
    if (++frames_ <= warming_frames || drawn != quality_) return;
    const bool is_coarsest = quality_ == Quality::coarsest;
    // The first frame in a quality waits for its shaders.
    if (counted_++ == 0) return;
    mean_ = counted_ == 2 ? seconds : memory * mean_ + (1 - memory) * seconds;
    if (seconds > fast_frame) fast_since_ = now;
    if (mean_ > slow_frame && !is_coarsest) {
        if (now > since_ + least_observed || mean_ > hopeless * slow_frame) change(1, now);
        return;
    }
    if (quality_ != Quality::fine && now > fast_since_ + patience_) change(-1, now);
}

}  // namespace splitcubes::view
