// What a surface between two phyxels does to the weight they have for each
// other: occlusion disks and the criteria they are compared with.
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
    visibility,      // none where the segment is blocked (Belytschko et al. 1994, sec. 4)
    transparency,    // distance grows with the depth of the crossing behind the front (Organ et al. 1996)
    graph_distance   // shortest path over links that are not blocked (Steinemann et al. 2006, sec. 4)
};
/// As scenes and reports name them, in the order of the enumeration.
inline constexpr std::array<const char*, 4> criterion_names = {"occlusion-disk", "visibility", "transparency",
                                                               "graph-distance"};

/// Phyxels and those in reach of each other.
struct PairSet {
    std::span<const Vec3> rest;           // per phyxel: m, rest space
    std::span<const double> support;      // per phyxel: radius, m
    std::span<const std::int32_t> piece;  // per phyxel; empty: all one
    std::span<const std::uint32_t> a, b;  // per pair: phyxels

    std::size_t size() const { return a.size(); }
    /// The larger support of the two, m.
    double reach(std::size_t pair) const {
        return support[a[pair]] > support[b[pair]] ? support[a[pair]] : support[b[pair]];
    }
};

/// Gives pairs a factor of their weight: 1 where nothing is in between, 0 where
/// they have nothing to do with each other, never outside. It is a function of
/// the triangles, the pair and, where depends_on_others, the phyxels around it;
/// symmetric in the two; the same bits for any number of threads.
class Criterion {
  public:
    virtual ~Criterion() = default;
    virtual std::string name() const = 0;
    /// asked: indices of pairs; factor: one value in [0, 1] for each, written.
    virtual void evaluate(const geometry::OccluderGrid& occluders, const PairSet& pairs,
                          std::span<const std::uint32_t> asked, std::span<float> factor,
                          const Parallel& parallel) = 0;
    /// What a changed triangle's box must meet to change the pair's factor, m, rest space.
    virtual geometry::Box region(const PairSet& pairs, std::size_t pair) const = 0;
    /// No region of a pair of this reach goes farther from either phyxel along an axis, m.
    virtual double range(double reach) const { return 2.1 * reach; }
    /// Whether other phyxels can change the factor of a pair.
    virtual bool depends_on_others() const { return false; }
};

/// disks: used by occlusion_disk only, which needs it.
std::unique_ptr<Criterion> make_criterion(CriterionKind kind, std::unique_ptr<VisibilityBackend> disks);

/// w(d, h) / w(r, h) of the kernel (h^2 - r^2)^3 (Mueller et al. 2004, eq. 7):
/// the factor of a pair whose distance r counts as d. 0 for d >= h. Needs r <= d.
double weight_ratio(double r, double d, double h);

}  // namespace splitcubes::occlusion
