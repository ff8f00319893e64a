// How the processor treats numbers too small to be stored whole.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace splitcubes::meshless {

// Numbers below 1e-38, which a residual leaves far from where it began, count as zero while
// this lives: the processor would take a hundred times as long for them.
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
