// Compensated summation: the rounding error does not grow with the number of terms.
#pragma once

#include <cmath>

namespace splitcubes {

/// Neumaier's sum (1974): adds up the rounding errors of the additions and applies them in value().
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
