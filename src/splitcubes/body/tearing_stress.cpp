// What the material around phyxels and edges bears, and what it has to.
#include <splitcubes/body/stress_kernels.h>
#include <splitcubes/body/tearing.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/constitutive.h>
#include <splitcubes/meshless/kernel.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

constexpr std::size_t grain = 256, edge_grain = 8;
// In place of the norm of a stress: what moves the phyxel is not its stress.
constexpr double held_phyxel = -2;
// Of a bound, for the rounding of what it bounds: relative, far above both.
constexpr double bound_slack = 1e-6;
// Of what is pressed to less than that share of its volume, or is inverted, the stress says nothing.
constexpr double least_volume = 0.05;
// Of phyxels, in Tearing::is_strained_.
constexpr std::uint8_t strained = 1, beside_strained = 2;

}  // namespace

// A weak region may be thinner than the phyxels' spacing: each answers for the
// weakest node within half a spacing along each axis.
void Tearing::find_weakest(const NodeGrid& grid, const TearContext& context) {
    const std::size_t known = weakest_.size(), count = context.phyxels.size();
    weakest_.resize(count, settings_.strength);
    own_rank_.resize(count, 3);
    if (!settings_.strength_factor) return;
    context.parallel.for_each(count - known, grain, [&](std::size_t k) {
        const Vec3& rest = context.phyxels.rest_position[known + k];
        const Vec3 half = Vec3::Constant(0.5 * context.spacing);
        const Vec3i low = grid.rest().to_grid(rest - half).array().floor().cast<int>();
        const Vec3i high = grid.rest().to_grid(rest + half).array().ceil().cast<int>();
        double weakest = strength_at(rest);
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x)
                    weakest = std::min(weakest, strength_at(grid.rest().node_position({x, y, z})));
        weakest_[known + k] = weakest;
    });
}

// Of those that have a say, which other materials than find_corotated_stresses knows.
void Tearing::measure_one(const TearContext& context, std::size_t i, double least) {
    const meshless::Phyxels& p = context.phyxels;
    const bool has_say = size_[i] >= 0;
    stress_[i].setZero();
    is_strained_[i] = 0;
    if (!has_say) return;
    size_[i] = -1;
    const Mat3& F = p.deformation[i];
    const double volume = F.determinant();
    if (!(volume > least_volume)) return;
    const Mat3 cauchy = meshless::piola_stress(context.material, F, p.rotation[i], p.plastic_strain[i]) *
                        F.transpose() / volume;
    if (!cauchy.allFinite()) return;
    stress_[i] = 0.5 * (cauchy + cauchy.transpose());
    size_[i] = stress_[i].norm();
    is_strained_[i] = size_[i] >= least && !has_values_below(stress_[i], least - bound_slack * size_[i]);
}

// Stresses, and which may have a principal one above `least`; returns the largest norm of a stress, an upper
// bound of all principal stresses.
double Tearing::measure_phyxels(const TearContext& context, double least) {
    const meshless::Phyxels& p = context.phyxels;
    const std::size_t count = p.size();
    stress_.resize(count);
    size_.resize(count);
    is_strained_.resize(count);
    chunk_largest_.resize((count + grain - 1) / grain);
    const auto rank = context.neighbourhoods.rank();
    const bool some_held = context.held.size() == count;
    const meshless::Material& material = context.material;
    const bool is_plain = material.model == meshless::MaterialModel::corotated && !material.plasticity &&
                          !(material.volume_stiffness > 0);
    const auto measure = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            size_[i] = some_held && context.held[i] ? held_phyxel : rank[i] < own_rank_[i] ? -1 : 0;
        if (is_plain)
            find_corotated_stresses({p.deformation.data(), p.rotation.data(), begin, end, material.lame_mu(),
                                     material.lame_lambda(), least_volume, least, bound_slack, stress_.data(),
                                     size_.data(), is_strained_.data()});
        else
            for (std::size_t i = begin; i < end; ++i) measure_one(context, i, least);
        chunk_largest_[begin / grain] = *std::max_element(&size_[begin], &size_[end - 1] + 1);
    };
    context.parallel.for_chunks(count, grain, std::cref(measure));
    double largest = 0;
    for (const double size : chunk_largest_) largest = std::max(largest, size);
    return largest;
}

// Bounds of the phyxels' principal stresses, and next to whom one is above `least`. Most material is
// pressed: what that is needs no principal values.
void Tearing::bound_principal_stress(const TearContext& context, double least) {
    const meshless::Neighbourhoods& n = context.neighbourhoods;
    const std::size_t count = context.phyxels.size();
    principal_.resize(count);
    context.parallel.for_each(count, 4 * grain, [&](std::size_t i) {
        principal_[i] = size_[i] < 0 ? -std::numeric_limits<double>::infinity() : least;
        if (is_strained_[i] == strained) principal_[i] = greatest_value_bound(stress_[i]);
    });
    for (std::size_t i = 0; i < count; ++i) {
        if (is_strained_[i] != strained) continue;
        for (std::size_t k = n.offsets()[i]; k < n.offsets()[i + 1]; ++k)
            is_strained_[n.neighbour()[k]] |= beside_strained;
    }
}

void Tearing::find_loads(const TearContext& context) {
    load_.assign(context.phyxels.size(), 0);
    bound_principal_stress(context, least_stress());
    context.parallel.for_each(load_.size(), grain, [&](std::size_t i) {
        if (is_strained_[i] != 0) load_[i] = load_of(context, i);
    });
    top_load_ = 0;
    for (const double load : load_) top_load_ = std::max(top_load_, load);
}

// Of one phyxel; 0 where it is below the least that anything asks for.
double Tearing::load_of(const TearContext& context, std::size_t i) const {
    const meshless::Neighbourhoods& n = context.neighbourhoods;
    const std::size_t begin = n.offsets()[i], end = n.offsets()[i + 1];
    const double own = meshless::kernel(0, context.phyxels.support_radius[i]);
    const double least = least_load * settings_.toughness * weakest_[i];
    // No principal stress of a mean is above the mean of the principal stresses.
    double largest = size_[i], total = 0, top = 0;
    const auto bound = [&](std::size_t j, double weight) {
        if (size_[j] < 0 || !(weight > 0)) return;
        largest = std::max(largest, size_[j]);
        top += weight * principal_[j];
        total += weight;
    };
    bound(i, own);
    for (std::size_t k = begin; k < end; ++k) bound(n.neighbour()[k], n.weight()[k]);
    if (!(largest >= settings_.toughness * weakest_[i]) ||
        top < (least - bound_slack * std::abs(least)) * total)
        return 0;
    total = 0;
    Mat3 sum = Mat3::Zero();
    const auto add = [&](std::size_t j, double weight) {
        if (size_[j] < 0) return;
        sum += weight * stress_[j];
        total += weight;
    };
    add(i, own);
    for (std::size_t k = begin; k < end; ++k) add(n.neighbour()[k], n.weight()[k]);
    if (!(total > 0)) return 0;
    const Mat3 mean = sum / total;
    if (has_values_below(mean, least - bound_slack * mean.norm())) return 0;
    return eigen_symmetric(mean).values[0] / std::max(weakest_[i], 1e-300);
}

// The edge's number in this step; its load is known after the next answer.
std::uint32_t Tearing::ask(const NodeGrid& grid, const GridEdge& edge, const TearContext& context) {
    const Vec3 middle =
        0.5 * (grid.rest().node_position(edge.node) + grid.rest().node_position(edge.upper()));
    const std::uint32_t number = sights_.number_of(splitting::edge_id(edge), middle);
    if (number >= loaded_edges_.size()) loaded_edges_.resize(sights_.size());
    LoadedEdge& loaded = loaded_edges_[number];
    if (loaded.asked == step_) return number;
    loaded.asked = step_;
    loaded.rest = middle;
    loaded.piece = context.pieces.piece_of(grid, edge.node);
    asked_.push_back(number);
    return number;
}

void Tearing::answer(const TearContext& context) {
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) find_stress(asked_[k], context);
    };
    context.parallel.for_chunks(asked_.size(), edge_grain, std::cref(find));
    asked_.clear();
}

// Whether the mean's largest principal stress may be above `limit` (Pa), whoever of those not yet known is
// seen: the principal value of a sum is at most the sum of the principal values, and it is largest where
// those above the limit are seen and none else.
bool Tearing::may_pass(std::span<const EdgeSights::Link> near, const LoadedEdge& edge,
                       const TearContext& context, double limit) const {
    const meshless::Phyxels& p = context.phyxels;
    double total = 0, excess = 0;
    Mat3 sum = Mat3::Zero();
    for (const EdgeSights::Link& link : near) {
        const std::uint32_t j = link.phyxel;
        if (link.sight == EdgeSights::Link::hidden || p.piece[j] != edge.piece || size_[j] < 0) continue;
        if (link.sight == EdgeSights::Link::unknown) {
            excess += link.weight * std::max(0.0, principal_[j] - limit);
            continue;
        }
        sum += link.weight * stress_[j];
        total += link.weight;
    }
    if (!(total > 0)) return excess > 0;
    return !has_values_below(sum, limit * total - excess);
}

// Where no choice of those that may be seen could tear the edge, whom it sees need not be asked.
void Tearing::find_stress(std::uint32_t number, const TearContext& context) {
    const meshless::Phyxels& p = context.phyxels;
    const SightContext sight{context.occluders, context.changes, p, context.locator, reach_};
    LoadedEdge& out = loaded_edges_[number];
    out.strength = std::max(strength_at(out.rest), 1e-300);
    out.stress = {};
    const double least = settings_.toughness * out.strength;
    const double enough = least - bound_slack * std::abs(least);
    const std::span<const EdgeSights::Link> near = sights_.near(number, sight);
    const bool is_any_above = std::any_of(near.begin(), near.end(), [&](const EdgeSights::Link& link) {
        return principal_[link.phyxel] > enough && p.piece[link.phyxel] == out.piece;
    });
    if (!is_any_above) return;
    sights_.doubt(number, sight);
    if (!may_pass(near, out, context, enough)) return;
    sights_.recall_hidden(number, out.piece, sight);
    if (!may_pass(near, out, context, enough)) return;
    sights_.recall_seen(number, out.piece, sight);
    if (!may_pass(near, out, context, enough)) return;
    sights_.look(number, out.piece, sight);
    double total = 0, held = 0;
    Mat3 sum = Mat3::Zero(), gradient = Mat3::Zero();
    for (const EdgeSights::Link& link : near) {
        const std::uint32_t j = link.phyxel;
        if (link.sight != EdgeSights::Link::seen || p.piece[j] != out.piece) continue;
        if (size_[j] == held_phyxel) held += link.weight;
        if (size_[j] < 0) continue;
        sum += link.weight * stress_[j];
        gradient += link.weight * p.deformation[j];
        total += link.weight;
    }
    if (!(total > held)) return;
    const Mat3 mean = sum / total;
    if (has_values_below(mean, enough - bound_slack * mean.norm())) return;
    const SymmetricEigen eigen = eigen_symmetric(mean);
    out.stress.largest = eigen.values[0];
    out.stress.direction = eigen.vectors.col(0);
    out.stress.world_from_rest = gradient / total;
}

}  // namespace splitcubes::body
