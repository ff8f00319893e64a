// Choice of the past that is kept where memory is limited.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace splitcubes::view {

/// Returns the index of the item that is missed least among ascending ones: distances between those that stay
/// grow with the square root of their age. The first and the last item stay. step_of(item): its step, or the
/// item's number of some other clock.
template <class Items, class StepOf>
std::size_t least_missed(const Items& items, const StepOf& step_of) {
    constexpr double youth = 60;  // steps, of which none is missed less than another one
    std::size_t out = 0;
    double least = 0;
    const std::int64_t now = step_of(items.back());
    for (std::size_t k = 1; k + 1 < items.size(); ++k) {
        const auto gap = static_cast<double>(step_of(items[k + 1]) - step_of(items[k - 1]));
        const double loss = gap / std::sqrt(static_cast<double>(now - step_of(items[k])) + youth);
        if (out != 0 && loss >= least) continue;
        least = loss;
        out = k;
    }
    return out;
}

}  // namespace splitcubes::view
