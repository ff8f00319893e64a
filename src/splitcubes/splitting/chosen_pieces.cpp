#include <splitcubes/splitting/chosen_pieces.h>

#include <algorithm>

namespace splitcubes::splitting {

std::vector<std::uint8_t> pieces_to_drop(std::span<const double> volumes,
                                         std::span<const std::uint8_t> left_out, const PieceChoice& choice) {
    std::vector<std::uint8_t> dropped(volumes.size(), 0);
    if (choice.all()) return dropped;
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < volumes.size(); ++k)
        if (left_out.empty() || left_out[k] == 0) order.push_back(k);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return volumes[a] > volumes[b]; });
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
        const bool too_small = choice.min_volume > 0 && !(volumes[order[rank]] >= choice.min_volume);
        const bool too_many = choice.largest > 0 && rank >= choice.largest;
        dropped[order[rank]] = too_small || too_many;
    }
    return dropped;
}

}  // namespace splitcubes::splitting
