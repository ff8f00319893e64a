#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/fracture/stress_field.h>
#include <splitcubes/fracture/stress_kernels.h>
#include <splitcubes/fracture/tuning.h>
#include <splitcubes/geometry/segment_fan.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/samples/kernel.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Value of stress_norm_ for a held phyxel, whose motion is prescribed. Other excluded phyxels have -1.
constexpr double held_phyxel = -2;

// Bits of StressField::is_strained_.
constexpr std::uint8_t strained = 1, beside_strained = 2;

}  // namespace

StressField::StressField(const StrengthField& strength, const meshless::Phyxels& phyxels,
                         const meshless::Neighbourhoods& neighbourhoods)
    : strength_(strength) {
    for (const double h : phyxels.support_radius) reach_ = std::max(reach_, h);
    // A sheet of one layer of phyxels has rank 2 initially, and in-plane stress.
    for (const std::uint8_t rank : neighbourhoods.rank())
        own_rank_.push_back(std::max<std::uint8_t>(rank, 2));
}

// Sets the minimum strength of new phyxels over the nodes within half a spacing along each axis, because a
// weak region may be thinner than the spacing.
void StressField::find_min_strengths(const NodeGrid& grid, const TearContext& context) {
    const std::size_t known = min_strength_.size(), count = context.phyxels.size();
    min_strength_.resize(count, strength_.settings().strength);
    own_rank_.resize(count, 3);
    if (!strength_.settings().strength_factor) return;
    context.parallel.for_each(count - known, tuning::grains::stressed_phyxels, [&](std::size_t k) {
        const Vec3& rest = context.phyxels.rest_position[known + k];
        const Vec3 half = Vec3::Constant(0.5 * context.spacing);
        const Vec3i low = grid.rest().to_grid(rest - half).array().floor().cast<int>();
        const Vec3i high = grid.rest().to_grid(rest + half).array().ceil().cast<int>();
        double weakest = strength_.at(rest);
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x)
                    weakest = std::min(weakest, strength_.at(grid.rest().node_position({x, y, z})));
        min_strength_[known + k] = weakest;
    });
}

// Computes the stress of one phyxel, for materials that find_corotated_stresses does not support. On entry,
// the norm is negative for an excluded phyxel.
void StressField::measure_phyxel(const TearContext& context, std::size_t i, double threshold) {
    const meshless::Phyxels& p = context.phyxels;
    const bool is_included = stress_norm_[i] >= 0;
    stress_[i].setZero();
    is_strained_[i] = 0;
    if (!is_included) return;
    stress_norm_[i] = -1;
    const Mat3& F = p.deformation[i];
    const double volume = F.determinant();
    if (!(volume > tuning::tearing::min_volume_share)) return;
    const Mat3 cauchy = meshless::piola_stress(context.material, F, p.rotation[i], p.plastic_strain[i]) *
                        F.transpose() / volume;
    if (!cauchy.allFinite()) return;
    stress_[i] = 0.5 * (cauchy + cauchy.transpose());
    stress_norm_[i] = stress_[i].norm();
    is_strained_[i] =
        stress_norm_[i] >= threshold &&
        !has_eigenvalues_below(stress_[i], threshold - tuning::tearing::stress_bound_slack * stress_norm_[i]);
}

// Computes the phyxels' stresses and marks those that may have a principal stress above the threshold, Pa.
// Returns the largest norm, Pa, an upper bound of all principal stresses.
double StressField::measure_phyxels(const TearContext& context, double threshold) {
    const meshless::Phyxels& p = context.phyxels;
    const std::size_t count = p.size();
    stress_.resize(count);
    stress_norm_.resize(count);
    is_strained_.resize(count);
    constexpr std::size_t grain = tuning::grains::stressed_phyxels;
    chunk_largest_.resize((count + grain - 1) / grain);
    const auto rank = context.neighbourhoods.rank();
    const bool some_held = context.held.size() == count;
    const meshless::Material& material = context.material;
    const bool is_plain = material.model == meshless::MaterialModel::corotated && !material.plasticity &&
                          !(material.volume_stiffness > 0);
    const auto measure = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            stress_norm_[i] = some_held && context.held[i] ? held_phyxel : rank[i] < own_rank_[i] ? -1 : 0;
        if (is_plain)
            find_corotated_stresses({p.deformation.data(), p.rotation.data(), begin, end, material.lame_mu(),
                                     material.lame_lambda(), tuning::tearing::min_volume_share, threshold,
                                     tuning::tearing::stress_bound_slack, stress_.data(), stress_norm_.data(),
                                     is_strained_.data()});
        else
            for (std::size_t i = begin; i < end; ++i) measure_phyxel(context, i, threshold);
        chunk_largest_[begin / grain] = *std::max_element(&stress_norm_[begin], &stress_norm_[end - 1] + 1);
    };
    context.parallel.for_chunks(count, grain, std::cref(measure));
    double largest = 0;
    for (const double size : chunk_largest_) largest = std::max(largest, size);
    return largest;
}

// Computes upper bounds of the phyxels' principal stresses and marks the neighbours of those above the
// threshold, Pa. Most material is below it, which is decided without principal values.
void StressField::bound_principal_stress(const TearContext& context, double threshold) {
    const meshless::Neighbourhoods& n = context.neighbourhoods;
    const std::size_t count = context.phyxels.size();
    principal_.resize(count);
    context.parallel.for_each(count, 4 * tuning::grains::stressed_phyxels, [&](std::size_t i) {
        principal_[i] = stress_norm_[i] < 0 ? -std::numeric_limits<double>::infinity() : threshold;
        if (is_strained_[i] == strained) principal_[i] = largest_eigenvalue_bound(stress_[i]);
    });
    for (std::size_t i = 0; i < count; ++i) {
        if (is_strained_[i] != strained) continue;
        for (std::size_t k = n.links_begin(i); k < n.links_end(i); ++k)
            is_strained_[n.neighbour()[k]] |= beside_strained;
    }
}

double StressField::find_loads(const NodeGrid& grid, const TearContext& context) {
    find_min_strengths(grid, context);
    if (measure_phyxels(context, min_stress()) <
        strength_.settings().propagation_ratio * strength_.settings().strength * strength_.min_factor())
        return 0;
    load_.assign(context.phyxels.size(), 0);
    bound_principal_stress(context, min_stress());
    context.parallel.for_each(load_.size(), tuning::grains::stressed_phyxels, [&](std::size_t i) {
        if (is_strained_[i] != 0) load_[i] = load_of(context, i);
    });
    double largest = 0;
    for (const double load : load_) largest = std::max(largest, load);
    return largest;
}

// Returns the load of one phyxel, or 0 if it is below the smallest load that matters.
double StressField::load_of(const TearContext& context, std::size_t i) const {
    const meshless::Neighbourhoods& n = context.neighbourhoods;
    const std::size_t begin = n.links_begin(i), end = n.links_end(i);
    const double own = meshless::kernel(0, context.phyxels.support_radius[i]);
    const double threshold = min_load_share * strength_.settings().propagation_ratio * min_strength_[i];
    // The largest principal stress of a mean is at most the mean of the largest principal stresses.
    double largest = stress_norm_[i], total = 0, top = 0;
    const auto bound = [&](std::size_t j, double weight) {
        if (stress_norm_[j] < 0 || !(weight > 0)) return;
        largest = std::max(largest, stress_norm_[j]);
        top += weight * principal_[j];
        total += weight;
    };
    bound(i, own);
    for (std::size_t k = begin; k < end; ++k) bound(n.neighbour()[k], n.weight()[k]);
    if (!(largest >= strength_.settings().propagation_ratio * min_strength_[i]) ||
        top < (threshold - tuning::tearing::stress_bound_slack * std::abs(threshold)) * total)
        return 0;
    total = 0;
    Mat3 sum = Mat3::Zero();
    const auto add = [&](std::size_t j, double weight) {
        if (stress_norm_[j] < 0) return;
        sum += weight * stress_[j];
        total += weight;
    };
    add(i, own);
    for (std::size_t k = begin; k < end; ++k) add(n.neighbour()[k], n.weight()[k]);
    if (!(total > 0)) return 0;
    const Mat3 mean = sum / total;
    if (has_eigenvalues_below(mean, threshold - tuning::tearing::stress_bound_slack * mean.norm())) return 0;
    return eigen_symmetric(mean).values[0] / std::max(min_strength_[i], 1e-300);
}

void StressField::begin_nodes(const TearContext& context) {
    ++step_;
    node_stress_.resize(context.nodes.kernels().size());
    phyxels_of_.assign(context.pieces.count(), 0);
    for (const std::int32_t piece : context.phyxels.piece) ++phyxels_of_[static_cast<std::size_t>(piece)];
}

bool StressField::is_large(const TearContext& context, std::int32_t piece) const {
    const auto p = static_cast<std::size_t>(piece);
    return phyxels_of_[p] >= tuning::tearing::min_tear_phyxels &&
           context.pieces.node_counts()[p] >= tuning::tearing::min_tear_nodes;
}

// Calls use(phyxel, weight) for the phyxels that influence a node and returns the sum of the weights. index:
// tracker index of the node or -1; without a kernel there, the phyxels are searched.
template <class Use>
double StressField::for_influences(const TearContext& context, const NodeGrid& grid, const Vec3i& node,
                                   std::int32_t index, const Use& use) const {
    const meshless::NodeKernels& kernels = context.nodes.kernels();
    if (context.has_kernel(index)) {
        const meshless::NodeKernels::Row& row = kernels.rows[static_cast<std::size_t>(index)];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k)
            use(kernels.phyxel[k], kernels.weight[k]);
        return 1;
    }
    const meshless::Phyxels& p = context.phyxels;
    const Vec3 rest = grid.rest().node_position(node);
    const std::int32_t piece = context.pieces.piece_of(grid, node);
    geometry::SegmentFan segments(context.occluders, rest, reach_);
    double total = 0;
    context.locator.visit(rest, reach_, [&](std::uint32_t i) {
        const Vec3& position = p.rest_position[i];
        const double weight = meshless::kernel((position - rest).squaredNorm(), p.support_radius[i]);
        if (!(weight > 0) || p.piece[i] != piece || segments.blocked(position)) return true;
        use(i, weight);
        total += weight;
        return true;
    });
    return total;
}

StressSum StressField::sum_stress(const TearContext& context, const NodeGrid& grid, const Vec3i& node,
                                  std::int32_t index) const {
    StressSum out;
    const double all = for_influences(context, grid, node, index, [&](std::uint32_t i, double weight) {
        if (stress_norm_[i] == held_phyxel) out.held += weight;
        if (stress_norm_[i] < 0) return;
        out.stress += weight * stress_[i];
        out.total += weight;
    });
    return all > 0 ? StressSum{out.stress / all, out.total / all, out.held / all} : StressSum{};
}

StressSum StressField::stress_at(const TearContext& context, const NodeGrid& grid, const Vec3i& node,
                                 std::int32_t index) const {
    if (!context.has_kernel(index)) return sum_stress(context, grid, node, index);
    const NodeStress& known = node_stress_[static_cast<std::size_t>(index)];
    return known.step == step_ ? known.sum : sum_stress(context, grid, node, index);
}

void StressField::request_stress(const TearContext& context, std::int32_t index) {
    if (!context.has_kernel(index)) return;
    NodeStress& node = node_stress_[static_cast<std::size_t>(index)];
    if (node.step == step_) return;
    node.step = step_;
    requested_nodes_.push_back(static_cast<std::uint32_t>(index));
}

void StressField::store_stress(const TearContext& context, std::int32_t index, const StressSum& sum) {
    if (context.has_kernel(index)) node_stress_[static_cast<std::size_t>(index)] = {step_, sum};
}

void StressField::find_requested_stresses(const TearContext& context, const NodeGrid& grid) {
    context.parallel.for_each(requested_nodes_.size(), tuning::grains::stress_nodes, [&](std::size_t k) {
        const std::uint32_t index = requested_nodes_[k];
        node_stress_[index].sum =
            sum_stress(context, grid, context.nodes.nodes()[index], static_cast<std::int32_t>(index));
    });
    requested_nodes_.clear();
}

EdgeStress StressField::find_stress(const TearContext& context, const NodeGrid& grid, const GridEdge& edge,
                                    const std::array<std::int32_t, 2>& nodes, const StressSum& sum,
                                    double threshold) const {
    if (!(sum.total > sum.held)) return {};
    const Mat3 mean = sum.stress / sum.total;
    if (has_eigenvalues_below(
            mean, threshold - tuning::tearing::stress_bound_slack * (std::abs(threshold) + mean.norm())))
        return {};
    const SymmetricEigen eigen = eigen_symmetric(mean);
    return {eigen.values[0], eigen.vectors.col(0), gradient_at(context, grid, edge, nodes)};
}

// Returns the kernel mean of the deformation gradient at an edge, over the phyxels that are not excluded.
Mat3 StressField::gradient_at(const TearContext& context, const NodeGrid& grid, const GridEdge& edge,
                              const std::array<std::int32_t, 2>& nodes) const {
    Mat3 gradient = Mat3::Zero();
    double total = 0;
    for (const int end : {0, 1}) {
        Mat3 sum = Mat3::Zero();
        double counted = 0;
        const auto add = [&](std::uint32_t i, double weight) {
            if (stress_norm_[i] < 0) return;
            sum += weight * context.phyxels.deformation[i];
            counted += weight;
        };
        const double all = for_influences(context, grid, end == 0 ? edge.node : edge.upper(),
                                          nodes[static_cast<std::size_t>(end)], add);
        if (!(all > 0)) continue;
        gradient += sum / all;
        total += counted / all;
    }
    return gradient / total;
}

}  // namespace splitcubes::body
