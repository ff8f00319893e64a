// A device with six axes, where the library for it was there at build time and its daemon runs.
#pragma once

#include <splitcubes/view/input.h>

#include <array>
#include <vector>

namespace splitcubes::view {

class SpaceMouse {
  public:
    SpaceMouse();
    ~SpaceMouse();
    SpaceMouse(const SpaceMouse&) = delete;
    SpaceMouse& operator=(const SpaceMouse&) = delete;

    bool is_there() const { return is_there_; }
    /// Appends what it did since the last call: motions, and its buttons as the left button of the pointer at
    /// a position, pixels. seconds: since the last call.
    void poll(double x, double y, double seconds, std::vector<ViewerInput>& out);

  private:
    bool is_there_ = false;
    std::array<int, 6> axes_{};  // the last deflection
};

}  // namespace splitcubes::view
