// Sums whose rounding error does not grow with the number of terms.
#pragma once

#include <cmath>

namespace splitcubes {

/// Neumaier's sum (1974): the rounding error of each addition is kept and added at
/// the end.
class CompensatedSum {
  public:
    void add(double term) {
        const double next = sum_ + term;
        error_ += std::abs(sum_) >= std::abs(term) ? (sum_ - next) + term : (term - next) + sum_;
        sum_ = next;
    }
    double value() const { return sum_ + error_; }

  private:
    double sum_ = 0, error_ = 0;
};

}  // namespace splitcubes
