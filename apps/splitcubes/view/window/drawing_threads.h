// Threads that draw, beside those that simulate.
#pragma once

#include <vector>

namespace splitcubes::view {

/// A rasteriser in software takes whole cores. It leaves the simulation its own: where both want a core, the
/// simulation has it. Made when the window is there and no other thread but the driver's.
class DrawingThreads {
  public:
    DrawingThreads();
    /// Threads for the simulation where so many are wished for; 0: all that are left.
    int threads_left(int wished) const;
    /// Lowers the priority of the driver's threads and of the calling one, not of those that came since.
    void give_way() const;

  private:
    bool in_software_ = false;
    std::vector<int> threads_;
};

}  // namespace splitcubes::view
