// The criteria that test segments between phyxels, and the parts that drawings of them share.
#pragma once

#include <splitcubes/occlusion/criterion.h>

#include <limits>
#include <vector>

namespace splitcubes::occlusion {

/// Whether a triangle meets the segment between the phyxels, but for 1e-3 of the
/// distance at either end: a phyxel may lie on a surface.
bool segment_blocked(const geometry::OccluderGrid& occluders, const PairQuery& pair);

/// Share of the support within which a crossing behind a crack's front lets through.
inline constexpr double transparent_share = 0.5;

/// Factor of the transparency criterion (Organ et al. 1996, eq. 8, with lambda 2):
/// distance r counts as r + h (depth / (transparent_share h))^2, the depth of a
/// crossing being its distance from the nearest front, the deepest of several.
/// A front is an edge of one cut triangle and no other triangle. The skin lets
/// nothing through.
double transparency_factor(const geometry::OccluderGrid& occluders, const PairQuery& pair, double support);

/// Links by phyxel, and which of them are blocked, found when first asked.
class LinkGraph {
  public:
    LinkGraph(const geometry::OccluderGrid& occluders, const PairSet& pairs);

    /// Whether the segment of a pair is blocked or parts two pieces. May be
    /// called on several threads.
    bool blocked(std::size_t pair) const;
    /// Buffers of a search; one a thread.
    struct Search {
        std::vector<double> distance;        // per phyxel, m; infinite where not reached
        std::vector<std::uint32_t> reached;  // phyxels
    };
    /// Lengths of the shortest paths of links that are not blocked from a phyxel to
    /// those within `limit` (Dijkstra 1959); ends early at phyxel `to`.
    void search(std::uint32_t from, double limit, Search& out,
                std::uint32_t to = std::numeric_limits<std::uint32_t>::max()) const;

  private:
    struct Link {
        std::uint32_t phyxel, pair;
    };
    const geometry::OccluderGrid& occluders_;
    PairSet pairs_;
    std::vector<std::uint32_t> offsets_;  // rows of links_, one more than phyxels
    std::vector<Link> links_;
    mutable std::vector<std::uint8_t> state_;  // per pair: 0 unknown, 1 free, 2 blocked
};

}  // namespace splitcubes::occlusion
