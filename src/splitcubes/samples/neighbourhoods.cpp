#include <splitcubes/math/decompose.h>
#include <splitcubes/samples/balanced_weights.h>
#include <splitcubes/samples/kernel.h>
#include <splitcubes/samples/loops.h>
#include <splitcubes/samples/neighbourhoods.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Pa, twice the energy density of a gradient e n^T with unit vectors e and n, averaged over e.
double mean_modulus(const Material& material) {
    return (4 * material.lame_mu() + material.lame_lambda() + material.volume_stiffness) / 3;
}

}  // namespace

// Material behind a held phyxel moves with the hold and is not strained. If links into it counted, the fit
// would see half of the strain in front. So the row of a held phyxel keeps its links to free phyxels and to
// those beside it, and counts the share of its volume that is not behind.
void Neighbourhoods::face_free_side(std::size_t i) {
    rows_.free_share[i] = 1;
    if (rows_.held[i] == 0) return;
    Vec3 ahead = Vec3::Zero();
    double length = 0;
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        if (rows_.held[links_.neighbour[l]] != 0) continue;
        ahead += links_.weight[l] * links_.rest_edge[l];
        length += links_.weight[l] * links_.rest_edge[l].norm();
    }
    const double sum = ahead.norm();
    if (!(sum > 0)) return;
    const Vec3 normal = ahead / sum;
    using namespace tuning::holds;
    const double one_sided =
        std::clamp((sum / length - min_one_sided) / (max_one_sided - min_one_sided), 0.0, 1.0);
    if (one_sided == 0) return;
    double before = 0, behind = 0;
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        const double height = normal.dot(links_.rest_edge[l]);
        if (rows_.held[links_.neighbour[l]] != 0) {
            const double slope = height / links_.rest_edge[l].norm();
            const double hidden = std::clamp(-slope / behind_cosine, 0.0, 1.0);
            links_.weight[l] *= 1 - one_sided * hidden;
        }
        (height > 0 ? before : behind) += links_.weight[l] * height * height;
    }
    rows_.free_share[i] = 1 - 0.5 * one_sided * (1 - std::min(1.0, behind / before));
}

// Balances the weights of row i; a row of more links is dense enough without. Partly visible links enter
// as whole ones and are weakened afterwards: a balance of weakened links would give back what the cut took.
void Neighbourhoods::balance_row(std::size_t i) {
    std::array<Vec3, max_balanced_links> edge;
    std::array<double, max_balanced_links> weight;
    std::array<double, max_balanced_links> visible;
    std::array<std::uint32_t, max_balanced_links> link;
    std::size_t n = 0;
    double base_weight = 0;
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        base_weight += links_.base_weight[l];
        if (!(links_.weight[l] > 0)) continue;
        if (n == max_balanced_links) return;
        edge[n] = links_.rest_edge[l];
        weight[n] = std::min(links_.base_weight[l], links_.weight[l] / tuning::balance::fading_visibility);
        visible[n] = links_.weight[l] / weight[n];
        link[n++] = l;
    }
    if (n == 0) return;
    const double spacing =
        std::sqrt(rows_.base_trace[i] / (tuning::neighbourhoods::mean_square_length * base_weight));
    balance_weights(std::span(edge).first(n), std::span(weight).first(n), spacing);
    for (std::size_t k = 0; k < n; ++k) links_.weight[link[k]] = weight[k] * visible[k];
}

void Neighbourhoods::compute_row(const Pairs& pairs, std::size_t i) {
    Mat3 moment = Mat3::Zero();
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l)
        links_.weight[l] = links_.base_weight[l] * static_cast<double>(pairs.visibility[links_.pair[l]]);
    face_free_side(i);
    balance_row(i);
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l)
        if (links_.weight[l] > 0)
            moment += links_.weight[l] * links_.rest_edge[l] * links_.rest_edge[l].transpose();
    rows_.moment[i] = moment;
    const SymmetricEigen eigen = eigen_symmetric(moment);
    int kept = 0;
    while (kept < 3 && eigen.values[kept] > tuning::neighbourhoods::rank_threshold * eigen.values[0]) ++kept;
    Mat3& basis = rows_.basis[i];
    basis = eigen.vectors;
    // Uses the expression that completes F, so that the completion is exact at rest.
    if (kept == 2) basis.col(2) = Vec3(basis.col(0)).cross(Vec3(basis.col(1))).normalized();
    Mat3 inverse = Mat3::Zero();
    for (int k = 0; k < kept; ++k) inverse += basis.col(k) * basis.col(k).transpose() / eigen.values[k];
    rows_.inverse_moment[i] = inverse;
    rows_.rank[i] = static_cast<std::uint8_t>(kept);
    rows_.off_plane[i] = 0;
    for (std::uint32_t l = range_[i].begin; kept == 2 && l < range_[i].end; ++l)
        if (links_.weight[l] > 0 &&
            std::abs(basis.col(2).dot(links_.rest_edge[l])) > 1e-9 * links_.rest_edge[l].norm())
            rows_.off_plane[i] = 1;
    rows_.gradient_sum[i].setZero();
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        links_.gradient[l] = links_.weight[l] > 0 ? Vec3(links_.weight[l] * (inverse * links_.rest_edge[l]))
                                                  : Vec3(Vec3::Zero());
        rows_.gradient_sum[i] += links_.gradient[l];
    }
}

// With rank 1 the rotation of F about its line is arbitrary: unless all neighbours are on
// the line, a rigid rotation would cause a penalty force.
bool Neighbourhoods::has_resolved_gradient(std::size_t i) const {
    if (rows_.rank[i] != 1) return rows_.rank[i] > 0;
    const Vec3 line = rows_.basis[i].col(0);
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        const Vec3& edge = links_.rest_edge[l];
        if (links_.weight[l] > 0 && (edge - line * line.dot(edge)).norm() > 1e-9 * edge.norm()) return false;
    }
    return true;
}

void Neighbourhoods::set_penalty(const Material& material, std::size_t i) {
    rows_.volume[i] = rows_.free_share[i] * rows_.whole_volume[i];
    const bool is_resolved = rows_.base_trace[i] > 0 && has_resolved_gradient(i);
    rows_.penalty[i] = is_resolved ? tuning::neighbourhoods::penalty_factor * material.zero_energy *
                                         material.lame_mu() * rows_.volume[i] / rows_.base_trace[i]
                                   : 0;
    const double trace = rows_.moment[i].trace();
    rows_.coupling[i] =
        trace > 0 ? 1.5 * mean_modulus(material) * rows_.volume[i] / trace + 0.5 * rows_.penalty[i] : 0;
    rows_.revision[i] = revision_;
}

// Writes the data of row i's links from gradients and penalties on both sides.
void Neighbourhoods::link_row(std::size_t i) {
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l)
        links_.reverse_gradient[l] = links_.gradient[links_.reverse[l]];
    write_links(i);
}

// Writes row i's links to the slices.
void Neighbourhoods::write_links(std::size_t i) {
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        slices_.set_link(l, {links_.gradient[l], link_penalty(l, i), links_.reverse_gradient[l],
                             links_.weight[l], links_.weight[links_.reverse[l]]});
    }
}

// Updates the links to i from unchanged rows.
void Neighbourhoods::link_back(std::size_t i) {
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        if (scratch_.mark[links_.neighbour[l]] == 1) continue;
        const std::uint32_t back = links_.reverse[l];
        links_.reverse_gradient[back] = links_.gradient[l];
        slices_.set_reverse(back, links_.gradient[l], links_.weight[l]);
        slices_.set_penalty(back, link_penalty(l, i));
    }
}

void Neighbourhoods::finish_row(const Material& material, std::size_t i) {
    // The penalty's second derivative by x_i, own and neighbours' terms, simplified by A g = w x in the
    // kept directions.
    double squares = rows_.volume[i] * rows_.gradient_sum[i].squaredNorm();  // m
    double penalties = 0;                                                    // N/m
    for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
        const std::uint32_t j = links_.neighbour[l];
        squares += rows_.volume[j] * links_.reverse_gradient[l].squaredNorm();
        penalties +=
            rows_.penalty[i] * links_.weight[l] * (1 - rows_.gradient_sum[i].dot(links_.rest_edge[l])) +
            rows_.penalty[j] * links_.weight[links_.reverse[l]] *
                (1 + links_.reverse_gradient[l].dot(links_.rest_edge[l]));
    }
    rows_.diagonal[i] = mean_modulus(material) * squares + penalties;
    slices_.set_row(
        i, {rows_.volume[i], rows_.gradient_sum[i], rows_.penalty[i], rows_.penalty[i] * rows_.moment[i],
            rows_.inverse_moment[i], rows_.moment[i] * rows_.gradient_sum[i]});
}

Neighbourhoods::MaterialKey Neighbourhoods::key_of(const Material& material) {
    return {material.zero_energy, material.lame_mu(), material.lame_lambda(), material.volume_stiffness};
}

void Neighbourhoods::rebuild(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                             const Parallel& parallel) {
    build_structure(phyxels, pairs, parallel);
    for_phyxels(parallel, size(), [&](std::size_t i) { compute_row(pairs, i); });
    for (std::size_t i = 0; i < size(); ++i) slices_.set_rank(i, rows_.rank[i] == 3);
    material_key_ = {};
    refresh_volumes(phyxels, material, parallel);
}

void Neighbourhoods::refresh_volumes(const Phyxels& phyxels, const Material& material,
                                     const Parallel& parallel) {
    assert(phyxels.size() == size());
    scratch_.rows.clear();
    const bool all = !(material_key_ == key_of(material));
    for (std::uint32_t i = 0; i < size(); ++i)
        if (all || rows_.whole_volume[i] != phyxels.volume[i]) scratch_.rows.push_back(i);
    material_key_ = key_of(material);
    if (scratch_.rows.empty()) return;
    revision_ = next_revision();
    for_phyxels(parallel, scratch_.rows.size(), [&](std::size_t k) {
        rows_.whole_volume[scratch_.rows[k]] = phyxels.volume[scratch_.rows[k]];
        set_penalty(material, scratch_.rows[k]);
    });
    for (const std::uint32_t i : scratch_.rows) scratch_.mark[i] = 1;
    add_ring();
    for_phyxels(parallel, scratch_.rows.size(), [&](std::size_t k) { link_row(scratch_.rows[k]); });
    for_phyxels(parallel, scratch_.rows.size(), [&](std::size_t k) { link_back(scratch_.rows[k]); });
    for_phyxels(parallel, scratch_.ring.size(),
                [&](std::size_t k) { finish_row(material, scratch_.ring[k]); });
    for (const std::uint32_t i : scratch_.ring) scratch_.mark[i] = 0;
}

// Collects the marked rows and their neighbours in scratch_.ring.
void Neighbourhoods::add_ring() {
    scratch_.ring.assign(scratch_.rows.begin(), scratch_.rows.end());
    for (const std::uint32_t i : scratch_.rows)
        for (std::uint32_t l = range_[i].begin; l < range_[i].end; ++l) {
            if (scratch_.mark[links_.neighbour[l]] != 0) continue;
            scratch_.mark[links_.neighbour[l]] = 2;
            scratch_.ring.push_back(links_.neighbour[l]);
        }
}

// Marks a row in scratch_ and lists it, unless it is marked.
void Neighbourhoods::mark_row(std::uint32_t i) {
    if (scratch_.mark[i] == 1) return;
    scratch_.mark[i] = 1;
    scratch_.rows.push_back(i);
}

// Marks the rows of pairs in scratch_, besides those that are marked.
void Neighbourhoods::mark_rows(const Pairs& pairs, std::span<const std::uint32_t> changed_pairs) {
    for (const std::uint32_t pair : changed_pairs) {
        mark_row(pairs.a[pair]);
        mark_row(pairs.b[pair]);
    }
}

// Computes the marked rows again, and what their neighbours hold of them.
void Neighbourhoods::update_rows(const Pairs& pairs, const Material& material, const Parallel& parallel) {
    add_ring();
    for_phyxels(parallel, scratch_.rows.size(), [&](std::size_t k) {
        compute_row(pairs, scratch_.rows[k]);
        set_penalty(material, scratch_.rows[k]);
    });
    for (const std::uint32_t i : scratch_.rows) slices_.set_rank(i, rows_.rank[i] == 3);
    for_phyxels(parallel, scratch_.rows.size(), [&](std::size_t k) { link_row(scratch_.rows[k]); });
    for_phyxels(parallel, scratch_.rows.size(), [&](std::size_t k) { link_back(scratch_.rows[k]); });
    for_phyxels(parallel, scratch_.ring.size(),
                [&](std::size_t k) { finish_row(material, scratch_.ring[k]); });
    for (const std::uint32_t i : scratch_.ring) scratch_.mark[i] = 0;
}

bool Neighbourhoods::update_held(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                                 const Parallel& parallel) {
    assert(phyxels.size() == size() && pairs.size() == pair_count_);
    scratch_.rows.clear();
    for (std::uint32_t i = 0; i < size(); ++i) {
        if (rows_.held[i] == phyxels.held[i]) continue;
        rows_.held[i] = phyxels.held[i];
        mark_row(i);
    }
    if (scratch_.rows.empty()) return false;
    const std::size_t changed = scratch_.rows.size();
    for (std::size_t k = 0; k < changed; ++k) {
        const LinkRange& range = range_[scratch_.rows[k]];
        for (std::uint32_t l = range.begin; l < range.end; ++l) {
            const std::uint32_t j = links_.neighbour[l];
            if (rows_.held[j] != 0) mark_row(j);
        }
    }
    revision_ = next_revision();
    update_rows(pairs, material, parallel);
    return true;
}

void Neighbourhoods::update([[maybe_unused]] const Phyxels& phyxels, const Pairs& pairs,
                            std::span<const std::uint32_t> changed_pairs, const Material& material,
                            const Parallel& parallel) {
    assert(phyxels.size() == size() && pairs.size() == pair_count_);
    if (changed_pairs.empty()) return;
    revision_ = next_revision();
    scratch_.rows.clear();
    mark_rows(pairs, changed_pairs);
    update_rows(pairs, material, parallel);
}

}  // namespace splitcubes::meshless
