#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/kernel.h>
#include <splitcubes/meshless/loops.h>
#include <splitcubes/meshless/neighbourhoods.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Directions whose eigenvalue is below this fraction of the largest are dropped.
constexpr double rank_threshold = 1e-3;
// c_i = this * zero_energy * mu V_i / trace A_i. With 5, zero_energy 0.1 restores the shape of a body whose
// phyxels start at random positions; 0.02 leaves it crumpled.
constexpr double penalty_factor = 5;

// Pa, twice the energy density of a gradient e n^T with unit vectors e and n, averaged over e.
double mean_modulus(const Material& material) {
    return (4 * material.lame_mu() + material.lame_lambda() + material.volume_stiffness) / 3;
}

std::uint64_t next_revision() {
    static std::atomic<std::uint64_t> last{0};
    return ++last;
}

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
    // Pairs are sorted by (a, b), so the lower neighbours of a row (as b) come in
    // ascending order of a; they must precede the higher ones.
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
    for (auto* array : {&base_weight_, &weight_}) array->assign(links, 0);
    for (auto* array : {&rest_edge_, &gradient_, &reverse_gradient_}) array->assign(links, Vec3::Zero());
    rank_.assign(n, 0);
    off_plane_.assign(n, 0);
    basis_.assign(n, Mat3::Identity());
    gradient_sum_.assign(n, Vec3::Zero());
    moment_.assign(n, Mat3::Zero());
    inverse_moment_.assign(n, Mat3::Zero());
    base_trace_.assign(n, 0);
    penalty_.assign(n, 0);
    volume_.assign(phyxels.volume.begin(), phyxels.volume.end());
    diagonal_.assign(n, 0);
    coupling_.assign(n, 0);
    row_revision_.assign(n, 0);
    structure_ = next_revision();
    mark_.assign(n, 0);
    rows_.clear();
    ring_.clear();
    rows_.reserve(n);
    ring_.reserve(n);
    for_phyxels(parallel, n, [&](std::size_t i) {
        for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
            rest_edge_[l] = phyxels.rest_position[neighbour_[l]] - phyxels.rest_position[i];
            base_weight_[l] = kernel(rest_edge_[l].squaredNorm(), phyxels.support_radius[i]);
            base_trace_[i] += base_weight_[l] * rest_edge_[l].squaredNorm();
        }
    });
    slices_.build(offsets_, neighbour_, phyxels.rest_position);
}

void Neighbourhoods::compute_row(const Pairs& pairs, std::size_t i) {
    Mat3 moment = Mat3::Zero();
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        weight_[l] = base_weight_[l] * static_cast<double>(pairs.visibility[pair_[l]]);
        if (weight_[l] > 0) moment += weight_[l] * rest_edge_[l] * rest_edge_[l].transpose();
    }
    moment_[i] = moment;
    const SymmetricEigen eigen = eigen_symmetric(moment);
    int kept = 0;
    while (kept < 3 && eigen.values[kept] > rank_threshold * eigen.values[0]) ++kept;
    Mat3& basis = basis_[i];
    basis = eigen.vectors;
    // Uses the expression that completes F, so that the completion is exact at rest.
    if (kept == 2) basis.col(2) = Vec3(basis.col(0)).cross(Vec3(basis.col(1))).normalized();
    Mat3 inverse = Mat3::Zero();
    for (int k = 0; k < kept; ++k) inverse += basis.col(k) * basis.col(k).transpose() / eigen.values[k];
    inverse_moment_[i] = inverse;
    rank_[i] = static_cast<std::uint8_t>(kept);
    off_plane_[i] = 0;
    for (std::uint32_t l = offsets_[i]; kept == 2 && l < offsets_[i + 1]; ++l)
        if (weight_[l] > 0 && std::abs(basis.col(2).dot(rest_edge_[l])) > 1e-9 * rest_edge_[l].norm())
            off_plane_[i] = 1;
    gradient_sum_[i].setZero();
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        gradient_[l] = weight_[l] > 0 ? Vec3(weight_[l] * (inverse * rest_edge_[l])) : Vec3(Vec3::Zero());
        gradient_sum_[i] += gradient_[l];
    }
}

// With rank 1 the rotation of F about its line is arbitrary: unless all neighbours are on
// the line, a rigid rotation would cause a penalty force.
bool Neighbourhoods::has_resolved_gradient(std::size_t i) const {
    if (rank_[i] != 1) return rank_[i] > 0;
    const Vec3 line = basis_[i].col(0);
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        const Vec3& edge = rest_edge_[l];
        if (weight_[l] > 0 && (edge - line * line.dot(edge)).norm() > 1e-9 * edge.norm()) return false;
    }
    return true;
}

void Neighbourhoods::set_penalty(const Material& material, std::size_t i) {
    const bool is_resolved = base_trace_[i] > 0 && has_resolved_gradient(i);
    penalty_[i] =
        is_resolved ? penalty_factor * material.zero_energy * material.lame_mu() * volume_[i] / base_trace_[i]
                    : 0;
    const double trace = moment_[i].trace();
    coupling_[i] = trace > 0 ? 1.5 * mean_modulus(material) * volume_[i] / trace + 0.5 * penalty_[i] : 0;
    row_revision_[i] = revision_;
}

// Writes the data of row i's links from gradients and penalties on both sides.
void Neighbourhoods::link_row(std::size_t i) {
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        reverse_gradient_[l] = gradient_[reverse_[l]];
        slices_.set_link(
            l, {gradient_[l], link_penalty(l, i), reverse_gradient_[l], weight_[l], weight_[reverse_[l]]});
    }
}

// Updates the links to i from unchanged rows.
void Neighbourhoods::link_back(std::size_t i) {
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        if (mark_[neighbour_[l]] == 1) continue;
        const std::uint32_t back = reverse_[l];
        reverse_gradient_[back] = gradient_[l];
        slices_.set_reverse(back, gradient_[l], weight_[l]);
        slices_.set_penalty(back, link_penalty(l, i));
    }
}

void Neighbourhoods::finish_row(const Material& material, std::size_t i) {
    // The penalty's second derivative by x_i, own and neighbours' terms, simplified by A g = w x in the
    // kept directions.
    double squares = volume_[i] * gradient_sum_[i].squaredNorm();  // m
    double penalties = 0;                                          // N/m
    for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
        const std::uint32_t j = neighbour_[l];
        squares += volume_[j] * reverse_gradient_[l].squaredNorm();
        penalties += penalty_[i] * weight_[l] * (1 - gradient_sum_[i].dot(rest_edge_[l])) +
                     penalty_[j] * weight_[reverse_[l]] * (1 + reverse_gradient_[l].dot(rest_edge_[l]));
    }
    diagonal_[i] = mean_modulus(material) * squares + penalties;
    slices_.set_row(i, {volume_[i], gradient_sum_[i], penalty_[i], penalty_[i] * moment_[i],
                        inverse_moment_[i], moment_[i] * gradient_sum_[i]});
}

Neighbourhoods::MaterialKey Neighbourhoods::key_of(const Material& material) {
    return {material.zero_energy, material.lame_mu(), material.lame_lambda(), material.volume_stiffness};
}

void Neighbourhoods::rebuild(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                             const Parallel& parallel) {
    build_structure(phyxels, pairs, parallel);
    for_phyxels(parallel, size(), [&](std::size_t i) { compute_row(pairs, i); });
    for (std::size_t i = 0; i < size(); ++i) slices_.set_rank(i, rank_[i] == 3);
    material_key_ = {};
    refresh_volumes(phyxels, material, parallel);
}

void Neighbourhoods::refresh_volumes(const Phyxels& phyxels, const Material& material,
                                     const Parallel& parallel) {
    assert(phyxels.size() == size());
    rows_.clear();
    const bool all = !(material_key_ == key_of(material));
    for (std::uint32_t i = 0; i < size(); ++i)
        if (all || volume_[i] != phyxels.volume[i]) rows_.push_back(i);
    material_key_ = key_of(material);
    if (rows_.empty()) return;
    revision_ = next_revision();
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) {
        volume_[rows_[k]] = phyxels.volume[rows_[k]];
        set_penalty(material, rows_[k]);
    });
    for (const std::uint32_t i : rows_) mark_[i] = 1;
    add_ring();
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) { link_row(rows_[k]); });
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) { link_back(rows_[k]); });
    for_phyxels(parallel, ring_.size(), [&](std::size_t k) { finish_row(material, ring_[k]); });
    for (const std::uint32_t i : ring_) mark_[i] = 0;
}

// Collects the marked rows and their neighbours in ring_.
void Neighbourhoods::add_ring() {
    ring_.assign(rows_.begin(), rows_.end());
    for (const std::uint32_t i : rows_)
        for (std::uint32_t l = offsets_[i]; l < offsets_[i + 1]; ++l) {
            if (mark_[neighbour_[l]] != 0) continue;
            mark_[neighbour_[l]] = 2;
            ring_.push_back(neighbour_[l]);
        }
}

void Neighbourhoods::update([[maybe_unused]] const Phyxels& phyxels, const Pairs& pairs,
                            std::span<const std::uint32_t> changed_pairs, const Material& material,
                            const Parallel& parallel) {
    assert(phyxels.size() == size() && 2 * pairs.size() == link_count());
    if (changed_pairs.empty()) return;
    revision_ = next_revision();
    rows_.clear();
    for (const std::uint32_t pair : changed_pairs)
        for (const std::uint32_t i : {pairs.a[pair], pairs.b[pair]}) {
            if (mark_[i] == 1) continue;
            mark_[i] = 1;
            rows_.push_back(i);
        }
    add_ring();
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) {
        compute_row(pairs, rows_[k]);
        set_penalty(material, rows_[k]);
    });
    for (const std::uint32_t i : rows_) slices_.set_rank(i, rank_[i] == 3);
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) { link_row(rows_[k]); });
    for_phyxels(parallel, rows_.size(), [&](std::size_t k) { link_back(rows_[k]); });
    for_phyxels(parallel, ring_.size(), [&](std::size_t k) { finish_row(material, ring_[k]); });
    for (const std::uint32_t i : ring_) mark_[i] = 0;
}

}  // namespace splitcubes::meshless
