// Weight factors of pairs of phyxels with a surface between them: occlusion disks and the criteria they are
// compared with.
#pragma once

#include <splitcubes/occlusion/visibility.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace splitcubes::occlusion {

enum class CriterionKind {
    occlusion_disk,  // visible share of the disk (Pietroni et al. 2007, sec. 7.1)
    visibility,      // 0 if the segment is blocked (Belytschko et al. 1994, sec. 4)
    transparency,    // distance grows with the depth of the crossing behind the front (Organ et al. 1996)
    graph_distance   // shortest path over unblocked links (Steinemann et al. 2006, sec. 4)
};
/// Names in scenes and reports, in the order of the enumeration.
inline constexpr std::array<const char*, 4> criterion_names = {"occlusion-disk", "visibility", "transparency",
                                                               "graph-distance"};

/// Phyxels and the pairs within reach of each other.
struct PairSet {
    std::span<const Vec3> rest;           // per phyxel: m, rest space
    std::span<const double> support;      // per phyxel: radius, m
    std::span<const std::int32_t> piece;  // per phyxel; empty: all in one piece
    std::span<const std::uint32_t> a, b;  // per pair: phyxels

    std::size_t size() const { return a.size(); }
    /// Returns the larger support of the two, m.
    double reach(std::size_t pair) const {
        return support[a[pair]] > support[b[pair]] ? support[a[pair]] : support[b[pair]];
    }
};

/// Computes a factor for the weight of pairs, in [0, 1]: 1 with nothing in between, 0 for no interaction. The
/// factor is a function of the triangles, the pair and, if depends_on_others, the phyxels around it. It is
/// symmetric in the two, with the same bits for any number of threads.
class Criterion {
  public:
    virtual ~Criterion() = default;
    virtual std::string name() const = 0;
    /// Computes the factors of pairs. requested: indices of pairs. factor: output, one value in [0, 1] for
    /// each.
    virtual void evaluate(const geometry::OccluderGrid& occluders, const PairSet& pairs,
                          std::span<const std::uint32_t> requested, std::span<float> factor,
                          const Parallel& parallel) = 0;
    /// Returns the box that a changed triangle's box must meet to change the pair's factor, m, rest space.
    virtual geometry::Box region(const PairSet& pairs, std::size_t pair) const = 0;
    /// Returns an upper bound, per axis, of the distance from either phyxel of a pair of this reach to the
    /// bounds of its region, m.
    virtual double range(double reach) const { return 2.1 * reach; }
    /// Returns whether other phyxels can change the factor of a pair.
    virtual bool depends_on_others() const { return false; }
};

/// Makes a criterion. disks: used and required by occlusion_disk only.
std::unique_ptr<Criterion> make_criterion(CriterionKind kind, std::unique_ptr<VisibilityBackend> disks);

/// Returns w(d, h) / w(r, h) of the kernel (h^2 - r^2)^3 (Mueller et al. 2004, eq. 7): the factor of a pair
/// of distance r if the distance is replaced by d. 0 for d >= h. Requires r <= d.
double weight_ratio(double r, double d, double h);

}  // namespace splitcubes::occlusion
