#include <splitcubes/samples/loops.h>
#include <splitcubes/samples/neighbourhoods.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

void compute_support_radii(Phyxels& phyxels, const PhyxelLocator& locator, const Parallel& parallel,
                           const SupportOptions& options, std::size_t first) {
    assert(locator.size() == phyxels.size() && first <= phyxels.size() && options.nearest_count > 0);
    const auto wanted = static_cast<std::size_t>(options.nearest_count) + 1;
    for_phyxel_chunks(parallel, phyxels.size() - first, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> nearest;
        for (std::size_t i = first + begin; i < first + end; ++i) {
            const Vec3& here = phyxels.rest_position[i];
            locator.nearest(here, wanted, nearest);
            double sum = 0;
            std::size_t others = 0;
            for (const std::uint32_t j : nearest) {
                if (j == i || others + 1 == wanted) continue;
                sum += (phyxels.rest_position[j] - here).norm();
                ++others;
            }
            const double mean = others > 0 ? sum / static_cast<double>(others) : phyxels.contact_radius[i];
            phyxels.support_radius[i] = options.factor * mean;
        }
    });
}

Pairs find_pairs(const Phyxels& phyxels, const PhyxelLocator& locator, const Parallel& parallel) {
    assert(locator.size() == phyxels.size());
    const std::size_t n = phyxels.size();
    double largest = 0;
    for (const double h : phyxels.support_radius) largest = std::max(largest, h);
    std::vector<std::vector<std::uint32_t>> partners((n + phyxel_grain - 1) / phyxel_grain);
    std::vector<std::uint32_t> counts(n, 0);
    for_phyxel_chunks(parallel, n, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> near;
        std::vector<std::uint32_t>& found = partners[begin / phyxel_grain];
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3& here = phyxels.rest_position[i];
            near.clear();
            locator.visit(here, largest, [&](std::uint32_t j) {
                if (j <= i || phyxels.piece[j] != phyxels.piece[i]) return true;
                const double reach = std::max(phyxels.support_radius[i], phyxels.support_radius[j]);
                const double distance_squared = (phyxels.rest_position[j] - here).squaredNorm();
                // Coincident phyxels contribute nothing to each other's gradient.
                if (distance_squared < reach * reach && distance_squared > 0) near.push_back(j);
                return true;
            });
            std::sort(near.begin(), near.end());
            found.insert(found.end(), near.begin(), near.end());
            counts[i] = static_cast<std::uint32_t>(near.size());
        }
    });
    Pairs pairs;
    for (std::size_t i = 0; i < n; ++i)
        pairs.a.insert(pairs.a.end(), counts[i], static_cast<std::uint32_t>(i));
    for (const auto& found : partners) pairs.b.insert(pairs.b.end(), found.begin(), found.end());
    pairs.visibility.assign(pairs.a.size(), 1.0F);
    return pairs;
}

std::vector<std::uint32_t> transfer_visibility(const Pairs& from, Pairs& to) {
    std::vector<std::uint32_t> unknown;
    std::size_t f = 0;
    for (std::size_t t = 0; t < to.size(); ++t) {
        const auto before = [&] {
            return from.a[f] < to.a[t] || (from.a[f] == to.a[t] && from.b[f] < to.b[t]);
        };
        while (f < from.size() && before()) ++f;
        if (f < from.size() && from.a[f] == to.a[t] && from.b[f] == to.b[t])
            to.visibility[t] = from.visibility[f];
        else
            unknown.push_back(static_cast<std::uint32_t>(t));
    }
    return unknown;
}

}  // namespace splitcubes::meshless
