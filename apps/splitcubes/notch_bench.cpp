#include "notch_bench.h"

#include "validation.h"

#include <splitcubes/occlusion/criterion.h>

namespace splitcubes::app {

std::vector<NotchDepth> measure_notches(const std::shared_ptr<const Parallel>& parallel) {
    std::vector<NotchDepth> out;
    for (const int across : {4, 6})
        for (int layers = 1; layers <= 3 * across / 2; ++layers) {
            NotchDepth depth;
            depth.across = across;
            depth.layers = layers;
            for (std::size_t k = 0; k < depth.sag.size(); ++k) {
                const ValidationPoint point = notched_bar(layers / (2.0 * across), across,
                                                          static_cast<occlusion::CriterionKind>(k), parallel);
                depth.sag[k] = point.measured;
                depth.expected = point.expected;
            }
            out.push_back(depth);
        }
    return out;
}

}  // namespace splitcubes::app
