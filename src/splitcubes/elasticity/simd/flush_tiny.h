// Flushing of denormal floating-point numbers to zero.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace splitcubes::meshless {

// Flushes denormals (below 1e-38) to zero on this thread during its lifetime. Residuals far from a
// disturbance reach that range, where operations take about a hundred times as long.
class FlushTiny {
  public:
#if defined(__SSE2__)
    FlushTiny() : before_(_mm_getcsr()) {
        _mm_setcsr(before_ | 0x8040U);
    }
    ~FlushTiny() {
        _mm_setcsr(before_);
    }
    FlushTiny(const FlushTiny&) = delete;
    FlushTiny& operator=(const FlushTiny&) = delete;

  private:
    unsigned before_;
#else
    FlushTiny() {}
#endif
};

}  // namespace splitcubes::meshless
