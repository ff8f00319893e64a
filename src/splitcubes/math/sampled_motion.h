// Rigid motions that are known at some times only.
#pragma once

#include <splitcubes/math/types.h>

#include <vector>

namespace splitcubes {

/// A rigid motion as samples: at their times it is theirs to the last bit,
/// between them positions go straight and rotations the short way round, before
/// the first and after the last it stands still.
class SampledMotion {
  public:
    /// time (s): finite, after that of the last sample; frame: world from own, finite.
    /// Throws InputError otherwise.
    void add(double time, const Isometry& frame);

    bool empty() const { return times_.empty(); }
    const std::vector<double>& times() const { return times_; }      // s, increasing
    const std::vector<Isometry>& frames() const { return frames_; }  // world from own
    /// Of at least one sample.
    Isometry at(double time) const;

  private:
    std::vector<double> times_;
    std::vector<Isometry> frames_;
};

}  // namespace splitcubes
