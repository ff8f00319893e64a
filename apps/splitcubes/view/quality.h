// The effort for pictures of what moves, chosen by the time that they take.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace splitcubes::view {

/// Effort for a picture: with shadows and four samples a pixel, without both, and of a half and a third of
/// the resolution.
enum class Quality { fine, quick, coarse, coarsest };
inline constexpr std::array<std::string_view, 4> quality_names = {
    "fine", "without shadows", "half the resolution", "a third of the resolution"};

/// Goes down within a second of slow pictures, and up again after some seconds of fast ones. Each time that
/// an ascent fails, the next one is tried later.
class QualityControl {
  public:
    Quality quality() const { return quality_; }
    /// A frame was drawn in a quality; seconds: that it took, now: when it ended.
    void drawn(Quality drawn, double seconds, double now);

    static constexpr double slow_frame = 0.036;  // s; 28 a second, so that a busy machine has 20

  private:
    void change(int by, double now);

    Quality quality_ = Quality::fine;
    int frames_ = 0;         // ever
    double mean_ = 0;        // s, of the frames since the last change
    int counted_ = 0;        // frames in the mean
    double since_ = 0;       // s, of the last change
    double fast_since_ = 0;  // s, since when frames are fast
    double patience_ = 4;    // s of fast frames before an ascent
    bool ascended_ = false;
};

}  // namespace splitcubes::view
