// What the material around phyxels and edges bears, and what it has to.
#include <splitcubes/body/stress_kernels.h>
#include <splitcubes/body/tearing.h>
#include <splitcubes/geometry/segment_fan.h>
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

constexpr std::size_t stress_grain = 256, node_grain = 32;
// In place of the norm of a stress: what moves the phyxel is not its stress.
constexpr double held_phyxel = -2;
// Of a bound, for the rounding of what it bounds: relative, far above both.
constexpr double bound_slack = 1e-6;
// Of what is pressed to less than that share of its volume, or is inverted, the stress says nothing.
constexpr double min_volume = 0.05;
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
    context.parallel.for_each(count - known, stress_grain, [&](std::size_t k) {
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
    if (!(volume > min_volume)) return;
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
    chunk_largest_.resize((count + stress_grain - 1) / stress_grain);
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
                                     material.lame_lambda(), min_volume, least, bound_slack, stress_.data(),
                                     size_.data(), is_strained_.data()});
        else
            for (std::size_t i = begin; i < end; ++i) measure_one(context, i, least);
        chunk_largest_[begin / stress_grain] = *std::max_element(&size_[begin], &size_[end - 1] + 1);
    };
    context.parallel.for_chunks(count, stress_grain, std::cref(measure));
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
    context.parallel.for_each(count, 4 * stress_grain, [&](std::size_t i) {
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
    bound_principal_stress(context, min_stress());
    context.parallel.for_each(load_.size(), stress_grain, [&](std::size_t i) {
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
    const double least = min_load * settings_.propagation_ratio * weakest_[i];
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
    if (!(largest >= settings_.propagation_ratio * weakest_[i]) ||
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

// Whether the tracker knows who carries a node.
bool Tearing::is_lattice_driven(const TearContext& context, std::int32_t index) {
    return index >= 0 && static_cast<std::size_t>(index) < context.nodes.kernels().size() &&
           context.nodes.is_awake(static_cast<std::uint32_t>(index));
}

// Calls use(phyxel, weight) for those that carry a node, of which `index` is what the tracker calls it, if it
// does; returns the sum of the weights. What is not tracked looks around for itself.
template <class Use>
double Tearing::for_influences(const TearContext& context, const NodeGrid& grid, const Vec3i& node,
                               std::int32_t index, const Use& use) const {
    const meshless::NodeKernels& kernels = context.nodes.kernels();
    if (is_lattice_driven(context, index)) {
        const meshless::NodeKernels::Row& row = kernels.rows[static_cast<std::size_t>(index)];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k)
            use(kernels.phyxel[k], kernels.weight[k]);
        return 1;
    }
    const meshless::Phyxels& p = context.phyxels;
    const Vec3 rest = grid.rest().node_position(node);
    const std::int32_t piece = context.pieces.piece_of(grid, node);
    geometry::SegmentFan sights(context.occluders, rest, reach_);
    double total = 0;
    context.locator.visit(rest, reach_, [&](std::uint32_t i) {
        const Vec3& place = p.rest_position[i];
        const double weight = meshless::kernel((place - rest).squaredNorm(), p.support_radius[i]);
        if (!(weight > 0) || p.piece[i] != piece || sights.blocked(place)) return true;
        use(i, weight);
        total += weight;
        return true;
    });
    return total;
}

Tearing::StressSum Tearing::sum_stress(const TearContext& context, const NodeGrid& grid, const Vec3i& node,
                                       std::int32_t index) const {
    StressSum out;
    const double all = for_influences(context, grid, node, index, [&](std::uint32_t i, double weight) {
        if (size_[i] == held_phyxel) out.held += weight;
        if (size_[i] < 0) return;
        out.stress += weight * stress_[i];
        out.total += weight;
    });
    return all > 0 ? StressSum{out.stress / all, out.total / all, out.held / all} : StressSum{};
}

// What was wanted is known.
Tearing::StressSum Tearing::stress_at(const TearContext& context, const NodeGrid& grid, const Vec3i& node,
                                      std::int32_t index) const {
    if (!is_lattice_driven(context, index)) return sum_stress(context, grid, node, index);
    const NodeStress& known = node_stress_[static_cast<std::size_t>(index)];
    return known.step == step_ ? known.sum : sum_stress(context, grid, node, index);
}

// Of a tracked node, once a step.
void Tearing::want_stress(const TearContext& context, std::int32_t index) {
    if (!is_lattice_driven(context, index)) return;
    NodeStress& node = node_stress_[static_cast<std::size_t>(index)];
    if (node.step == step_) return;
    node.step = step_;
    wanted_.push_back(static_cast<std::uint32_t>(index));
}

void Tearing::find_wanted(const TearContext& context, const NodeGrid& grid) {
    context.parallel.for_each(wanted_.size(), node_grain, [&](std::size_t k) {
        const std::uint32_t index = wanted_[k];
        node_stress_[index].sum =
            sum_stress(context, grid, context.nodes.places()[index], static_cast<std::int32_t>(index));
    });
    wanted_.clear();
}

// Of an edge whose nodes have this sum, and are so called by the tracker; none where it is below `least`
// (Pa).
Tearing::Stress Tearing::find_stress(const TearContext& context, const NodeGrid& grid, const GridEdge& edge,
                                     const std::array<std::int32_t, 2>& nodes, const StressSum& sum,
                                     double least) const {
    if (!(sum.total > sum.held)) return {};
    const Mat3 mean = sum.stress / sum.total;
    if (has_values_below(mean, least - bound_slack * (std::abs(least) + mean.norm()))) return {};
    const SymmetricEigen eigen = eigen_symmetric(mean);
    return {eigen.values[0], eigen.vectors.col(0), gradient_at(context, grid, edge, nodes)};
}

// Kernel mean of the deformation, of those that have a say.
Mat3 Tearing::gradient_at(const TearContext& context, const NodeGrid& grid, const GridEdge& edge,
                          const std::array<std::int32_t, 2>& nodes) const {
    Mat3 gradient = Mat3::Zero();
    double total = 0;
    for (const int end : {0, 1}) {
        Mat3 sum = Mat3::Zero();
        double part = 0;
        const auto add = [&](std::uint32_t i, double weight) {
            if (size_[i] < 0) return;
            sum += weight * context.phyxels.deformation[i];
            part += weight;
        };
        const double all = for_influences(context, grid, end == 0 ? edge.node : edge.upper(),
                                          nodes[static_cast<std::size_t>(end)], add);
        if (!(all > 0)) continue;
        gradient += sum / all;
        total += part / all;
    }
    return gradient / total;
}

}  // namespace splitcubes::body
