#include "notch_bench.h"

#include "validation.h"

namespace splitcubes::app {

std::vector<NotchDepth> measure_notches(const std::shared_ptr<const Parallel>& parallel) {
    std::vector<NotchDepth> out;
    for (const int across : {4, 6}) {
        std::vector<double> shares;
        for (int layers = 1; layers <= 3 * across / 2; ++layers) shares.push_back(layers / (2.0 * across));
        const std::size_t first = out.size();
        for (std::size_t k = 0; k < shares.size(); ++k)
            out.push_back({.across = across, .layers = static_cast<int>(k) + 1});
        for (std::size_t c = 0; c < occlusion::criterion_names.size(); ++c) {
            const std::vector<ValidationPoint> points =
                notched_bars(shares, across, static_cast<occlusion::CriterionKind>(c), parallel);
            for (std::size_t k = 0; k < points.size(); ++k) {
                out[first + k].expected = points[k].expected;
                out[first + k].sag[c] = points[k].measured;
            }
        }
    }
    return out;
}

}  // namespace splitcubes::app
