#include "notch_bench.h"

#include "validation.h"

namespace splitcubes::app {

std::vector<NotchDepth> measure_notches(const std::shared_ptr<const Parallel>& parallel) {
    std::vector<NotchDepth> out;
    for (const int across : {4, 6}) {
        std::vector<double> shares;
        const std::size_t first = out.size();
        for (int k = 0; k < notch_depths_per_cell * 3 * across / 2; ++k) {
            out.push_back({.across = across, .cells = (k + 0.5) / notch_depths_per_cell});
            shares.push_back(out.back().cells / (2.0 * across));
        }
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
