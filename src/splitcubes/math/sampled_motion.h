// Rigid motions known at sampled times.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <vector>

namespace splitcubes {

/// Sampled rigid motion. At the times of samples it equals them to the last bit; in between, positions are
/// interpolated linearly and rotations by slerp; before the first and after the last sample it is at rest.
class SampledMotion {
  public:
    /// Adds a sample. time (s): finite and after the last sample; frame: world from own, finite. Throws
    /// InputError otherwise.
    void add(double time, const Isometry& frame);

    /// Drops the samples that no time from this one on depends on: all before the last one that is not later.
    /// Returns how many.
    std::size_t forget_before(double time);

    bool empty() const { return times_.empty(); }
    const std::vector<double>& times() const { return times_; }      // s, increasing
    const std::vector<Isometry>& frames() const { return frames_; }  // world from own
    /// Returns the frame at a time. There must be at least one sample.
    Isometry at(double time) const;

  private:
    std::vector<double> times_;
    std::vector<Isometry> frames_;
};

}  // namespace splitcubes
