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

void append_pairs(const Phyxels& phyxels, const PhyxelLocator& locator, std::size_t first, Pairs& pairs,
                  const Parallel& parallel) {
    assert(locator.size() == phyxels.size());
    double largest = 0;
    for (const double h : phyxels.support_radius) largest = std::max(largest, h);
    std::vector<std::vector<std::uint32_t>> partners(phyxels.size() - first);
    parallel.for_each(partners.size(), 16, [&](std::size_t k) {
        const std::size_t i = first + k;
        const Vec3& here = phyxels.rest_position[i];
        locator.visit(here, largest, [&](std::uint32_t j) {
            if (j >= i || phyxels.piece[j] != phyxels.piece[i]) return true;
            const double reach = std::max(phyxels.support_radius[i], phyxels.support_radius[j]);
            const double distance_squared = (phyxels.rest_position[j] - here).squaredNorm();
            if (distance_squared < reach * reach && distance_squared > 0) partners[k].push_back(j);
            return true;
        });
        std::sort(partners[k].begin(), partners[k].end());
    });
    for (std::size_t k = 0; k < partners.size(); ++k) {
        pairs.a.insert(pairs.a.end(), partners[k].begin(), partners[k].end());
        pairs.b.insert(pairs.b.end(), partners[k].size(), static_cast<std::uint32_t>(first + k));
    }
    pairs.visibility.resize(pairs.a.size(), 1.0F);
}

}  // namespace splitcubes::meshless
