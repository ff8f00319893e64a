// Criteria that test segments between phyxels, and the parts that drawings of them share.
#pragma once

#include <splitcubes/occlusion/criterion.h>

#include <limits>
#include <vector>

namespace splitcubes::occlusion {

/// Returns whether a triangle meets the segment between the phyxels, shortened by 1e-3 of the distance at
/// either end because a phyxel may be on a surface.
bool segment_blocked(const geometry::OccluderGrid& occluders, const PairQuery& pair);

/// Share of the support within which a crossing behind a crack front is partly transparent.
inline constexpr double transparent_share = 0.5;

/// Returns the factor of the transparency criterion (Organ et al. 1996, eq. 8, with lambda 2): distance r is
/// replaced by r + h (depth / (transparent_share h))^2, where the depth of a crossing is its distance from
/// the nearest crack front; of several crossings the deepest counts. A front is an edge of one cut triangle
/// and no other triangle. The boundary is opaque.
double transparency_factor(const geometry::OccluderGrid& occluders, const PairQuery& pair, double support);

/// Links by phyxel; whether a link is blocked is evaluated on first use.
class LinkGraph {
  public:
    LinkGraph(const geometry::OccluderGrid& occluders, const PairSet& pairs);

    /// Returns whether the segment of a pair is blocked or joins two pieces. May be called on several
    /// threads.
    bool blocked(std::size_t pair) const;
    /// Buffers of a search; one per thread.
    struct Search {
        std::vector<double> distance;        // per phyxel, m; infinite if not reached
        std::vector<std::uint32_t> reached;  // phyxels
    };
    /// Computes the lengths of the shortest paths over unblocked links from a phyxel to those within `limit`
    /// (Dijkstra 1959); stops early at phyxel `to`.
    void search(std::uint32_t from, double limit, Search& out,
                std::uint32_t to = std::numeric_limits<std::uint32_t>::max()) const;

  private:
    struct Link {
        std::uint32_t phyxel, pair;
    };
    const geometry::OccluderGrid& occluders_;
    PairSet pairs_;
    std::vector<std::uint32_t> offsets_;  // start of each row of links_; one more than phyxels
    std::vector<Link> links_;
    mutable std::vector<std::uint8_t> state_;  // per pair: 0 unknown, 1 free, 2 blocked
};

}  // namespace splitcubes::occlusion
