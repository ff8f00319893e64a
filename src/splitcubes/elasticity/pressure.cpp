#include <splitcubes/elasticity/pressure.h>
#include <splitcubes/elasticity/tuning.h>
#include <splitcubes/samples/kernel.h>

#include <algorithm>
#include <cassert>
#include <vector>

namespace splitcubes::meshless {

void average_over_neighbourhoods(const Neighbourhoods& neighbourhoods, std::span<const double> support_radius,
                                 std::span<double> values) {
    const std::size_t n = neighbourhoods.size();
    assert(support_radius.size() == n && values.size() == n);
    std::vector<double> mean(n);
    for (int round = 0; round < tuning::pressure::rounds; ++round) {
        for (std::size_t i = 0; i < n; ++i) {
            double weight = kernel(0, support_radius[i]) * neighbourhoods.volume()[i];
            double sum = weight * values[i], total = weight;
            for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
                const std::uint32_t j = neighbourhoods.neighbour()[l];
                weight = neighbourhoods.weight()[l] * neighbourhoods.volume()[j];
                sum += weight * values[j];
                total += weight;
            }
            mean[i] = total > 0 ? sum / total : values[i];
        }
        std::copy(mean.begin(), mean.end(), values.begin());
    }
}

}  // namespace splitcubes::meshless
