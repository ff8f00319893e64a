#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/kernel.h>
#include <splitcubes/meshless/loops.h>
#include <splitcubes/meshless/neighbourhoods.h>

#include <algorithm>
#include <cassert>

namespace splitcubes::meshless {

namespace {

// Directions whose eigenvalue is below this share of the largest are dropped.
constexpr double rank_threshold = 1e-3;
// What a row's weights sum to in the pair stiffnesses: with ten, zero_energy 0.1
// brings a body back whose phyxels start at random places, and a bar hung by
// one end sags 2 % less than without (0.02 leaves the former crumpled).
constexpr double pair_weight_sum = 10;

}  // namespace

void Neighbourhoods::build_structure(const Phyxels& phyxels, const Pairs& pairs, const Parallel& parallel) {
    const std::size_t n = phyxels.size();
    const std::size_t links = 2 * pairs.size();
    offsets_.assign(n + 1, 0);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        assert(pairs.a[p] < pairs.b[p] && pairs.b[p] < n);
        ++offsets_[pairs.a[p] + 1];
        ++offsets_[pairs.b[p] + 1];
    }
    for (std::size_t i = 0; i < n; ++i) offsets_[i + 1] += offsets_[i];
    neighbour_.resize(links);
    reverse_.resize(links);
    pair_.resize(links);
    std::vector<std::uint32_t> link_to_lower(pairs.size());  // b -> a of each pair
    std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
    // Pairs are sorted by (a, b): the lower neighbours of a row, where it is b,
    // come in ascending order of a; they must stand before its higher ones.
    for (const bool lower : {true, false})
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            const std::uint32_t from = lower ? pairs.b[p] : pairs.a[p];
            const std::uint32_t link = next[from]++;
            neighbour_[link] = lower ? pairs.a[p] : pairs.b[p];
            pair_[link] = static_cast<std::uint32_t>(p);
            if (lower) {
                link_to_lower[p] = link;
                continue;
            }
            reverse_[link] = link_to_lower[p];
            reverse_[reverse_[link]] = link;
        }
    for (auto* array : {&base_weight_, &weight_, &pair_stiffness_, &share_}) array->assign(links, 0);
    for (auto* array : {&rest_edge_, &gradient_, &reverse_gradient_}) array->assign(links, Vec3::Zero());
    visibility_.assign(links, 1);
    rank_.assign(n, 0);
    basis_.assign(n, Mat3::Identity());
    gradient_sum_.assign(n, Vec3::Zero());
    base_weight_sum_.assign(n, 0);
    volume_.assign(phyxels.volume.begin(), phyxels.volume.end());
    diagonal_.assign(n, 0);
    pair_first_.assign(n, Vec3::Zero());
    pair_second_.assign(n, Mat3::Zero());
    mark_.assign(n, 0);
    rows_.clear();
    ring_.clear();
    rows_.reserve(n);
    ring_.reserve(n);
    for_phyxels(parallel, n, [&](std::size_t i) {
        for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
            rest_edge_[l] = phyxels.rest_position[neighbour_[l]] - phyxels.rest_position[i];
            base_weight_[l] = kernel(rest_edge_[l].squaredNorm(), phyxels.support_radius[i]);
            base_weight_sum_[i] += base_weight_[l];
        }
    });
}

void Neighbourhoods::compute_row(const Pairs& pairs, std::size_t i) {
    Mat3 moment = Mat3::Zero();
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        visibility_[l] = pairs.visibility[pair_[l]];
        weight_[l] = base_weight_[l] * static_cast<double>(visibility_[l]);
        if (weight_[l] > 0) moment += weight_[l] * rest_edge_[l] * rest_edge_[l].transpose();
    }
    const SymmetricEigen eigen = eigen_symmetric(moment);
    int kept = 0;
    while (kept < 3 && eigen.values[kept] > rank_threshold * eigen.values[0]) ++kept;
    Mat3& basis = basis_[i];
    basis = eigen.vectors;
    // The same expression as completes F, so that at rest the completion is exact.
    if (kept == 2) basis.col(2) = Vec3(basis.col(0)).cross(Vec3(basis.col(1))).normalized();
    Mat3 inverse = Mat3::Zero();
    for (int k = 0; k < kept; ++k) inverse += basis.col(k) * basis.col(k).transpose() / eigen.values[k];
    rank_[i] = static_cast<std::uint8_t>(kept);
    gradient_sum_[i].setZero();
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        gradient_[l] = weight_[l] > 0 ? Vec3(weight_[l] * (inverse * rest_edge_[l])) : Vec3(Vec3::Zero());
        gradient_sum_[i] += gradient_[l];
    }
}

bool Neighbourhoods::tells_direction(std::size_t i, std::size_t link) const {
    if (!(weight_[link] > 0) || rank_[i] == 0) return false;
    if (rank_[i] >= 2) return true;
    // Of rank 1, F turns about its line as it likes: only neighbours on the line
    // are told, else a rigid rotation would make a force.
    const Vec3 line = basis_[i].col(0);
    const Vec3& edge = rest_edge_[link];
    return (edge - line * line.dot(edge)).norm() <= 1e-9 * edge.norm();
}

void Neighbourhoods::link_row(const Phyxels& phyxels, const Material& material, std::size_t i) {
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        const std::uint32_t j = neighbour_[l];
        const std::uint32_t back = reverse_[l];
        reverse_gradient_[l] = gradient_[back];
        const bool here = tells_direction(i, l);
        const bool there = tells_direction(j, back);
        share_[l] = here == there ? 0.5 : here ? 1.0 : 0.0;
        pair_stiffness_[l] = 0;
        if (!here && !there) continue;
        const auto held_by = [&](std::size_t phyxel, std::size_t link) {
            return phyxels.volume[phyxel] * base_weight_[link] / base_weight_sum_[phyxel];
        };
        // Sums are commutative, so both directed copies are equal to the last bit.
        double volume = 0;
        if (base_weight_sum_[i] > 0) volume += held_by(i, l);
        if (base_weight_sum_[j] > 0) volume += held_by(j, back);
        pair_stiffness_[l] = material.zero_energy * material.lame_mu() * 0.5 * pair_weight_sum * volume /
                             rest_edge_[l].squaredNorm() * static_cast<double>(visibility_[l]);
    }
}

void Neighbourhoods::compute_sums(const Material& material, std::size_t i) {
    double squares = volume_[i] * gradient_sum_[i].squaredNorm();  // m
    double pairs = 0;                                              // N/m
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        squares += volume_[neighbour_[l]] * reverse_gradient_[l].squaredNorm();
        const double seen = 1 - share_[l] * gradient_sum_[i].dot(rest_edge_[l]) +
                            (1 - share_[l]) * reverse_gradient_[l].dot(rest_edge_[l]);
        pairs += pair_stiffness_[l] * seen * seen;
    }
    Vec3 first = Vec3::Zero();   // N/m * m
    Mat3 second = Mat3::Zero();  // N/m * m^2
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        const Vec3 shared = pair_stiffness_[l] * share_[l] * rest_edge_[l];
        first += shared;
        second += share_[l] * shared * rest_edge_[l].transpose();
    }
    pair_first_[i] = first;
    pair_second_[i] = second;
    diagonal_[i] =
        (4 * material.lame_mu() + material.lame_lambda() + material.volume_stiffness) / 3 * squares + pairs;
}

void Neighbourhoods::rebuild(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                             const Parallel& parallel) {
    build_structure(phyxels, pairs, parallel);
    for_phyxels(parallel, size(), [&](std::size_t i) { compute_row(pairs, i); });
    refresh_volumes(phyxels, material, parallel);
}

void Neighbourhoods::refresh_volumes(const Phyxels& phyxels, const Material& material,
                                     const Parallel& parallel) {
    assert(phyxels.size() == size());
    std::copy(phyxels.volume.begin(), phyxels.volume.end(), volume_.begin());
    for_phyxels(parallel, size(), [&](std::size_t i) { link_row(phyxels, material, i); });
    for_phyxels(parallel, size(), [&](std::size_t i) { compute_sums(material, i); });
}

void Neighbourhoods::update(const Phyxels& phyxels, const Pairs& pairs,
                            std::span<const std::uint32_t> changed_pairs, const Material& material,
                            const Parallel& parallel) {
    assert(phyxels.size() == size() && 2 * pairs.size() == link_count());
    rows_.clear();
    ring_.clear();
    for (const std::uint32_t pair : changed_pairs)
        for (const std::uint32_t i : {pairs.a[pair], pairs.b[pair]}) {
            if (mark_[i] == 1) continue;
            mark_[i] = 1;
            rows_.push_back(i);
        }
    // A new row changes g_ji, shares and stiffnesses in its neighbours' links.
    ring_.assign(rows_.begin(), rows_.end());
    for (const std::uint32_t i : rows_)
        for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
            if (mark_[neighbour_[l]] != 0) continue;
            mark_[neighbour_[l]] = 2;
            ring_.push_back(neighbour_[l]);
        }
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) { compute_row(pairs, rows_[k]); });
    for_phyxels(parallel, ring_.size(), [&](std::size_t k) {
        volume_[ring_[k]] = phyxels.volume[ring_[k]];
        link_row(phyxels, material, ring_[k]);
    });
    for_phyxels(parallel, ring_.size(), [&](std::size_t k) { compute_sums(material, ring_[k]); });
    for (const std::uint32_t i : ring_) mark_[i] = 0;
}

}  // namespace splitcubes::meshless
