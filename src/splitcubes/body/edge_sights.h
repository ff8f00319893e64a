// Which phyxels the middles of grid edges see, kept from step to step.
#pragma once

#include <splitcubes/body/surface_changes.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/geometry/sight_fan.h>
#include <splitcubes/meshless/locator.h>
#include <splitcubes/meshless/phyxels.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// What EdgeSights looks at.
struct SightContext {
    const geometry::OccluderGrid& occluders;
    const SurfaceChanges& changes;  // of what the occluders are made of
    const meshless::Phyxels& phyxels;
    const meshless::PhyxelLocator& locator;
    double reach;  // m, the largest support
};

/// A phyxel is seen where the segment from the edge's middle to it meets no surface. Looks again
/// only where the surface has changed since, and there first at what hid a phyxel or what has come since it
/// was seen; what it tells is what looking anew at all would tell.
/// Edges are numbered by one thread; different numbers may then be looked at by different threads.
class EdgeSights {
  public:
    /// What is known of a phyxel near an edge.
    struct Link {
        double weight;  // of the kernel there, > 0
        std::uint32_t phyxel : 28;
        enum : std::uint32_t { unknown, seen, hidden };
        std::uint32_t sight : 2;
        std::uint32_t before : 2;  // what it was when it was last looked at
        // Of then: what the occluders had counted, where it was seen; which triangle hid it.
        std::uint32_t witness;
    };
    static constexpr std::uint32_t most_phyxels = 1U << 28;

    /// A step begins: edges that the last step did not ask for may be forgotten, and all are where there are
    /// fewer phyxels than then; more are those of then and new ones behind them. Numbers of the step before
    /// mean nothing any more.
    void begin(std::size_t phyxels);

    /// The edge's number, the same until begin. rest: m, the edge's middle.
    std::uint32_t number_of(std::uint64_t edge, const Vec3& rest);
    std::size_t size() const { return used_; }

    /// The phyxels whose support holds the edge's middle, ascending, and which of them were seen or hidden
    /// when that was last looked at.
    std::span<const Link> near(std::uint32_t number, const SightContext& context);
    /// Which of them are still known to be seen or hidden; of the others look finds it out. After near.
    void doubt(std::uint32_t number, const SightContext& context);
    /// Finds out of phyxels of a piece what is told by what once hid them, and by what has come since they
    /// were seen, which is found sooner than by looking anew; after doubt.
    void recall_hidden(std::uint32_t number, std::int32_t piece, const SightContext& context);
    void recall_seen(std::uint32_t number, std::int32_t piece, const SightContext& context);
    /// Finds out which of the phyxels of a piece the edge sees; after near.
    void look(std::uint32_t number, std::int32_t piece, const SightContext& context);

  private:
    struct Entry {
        std::uint64_t edge = 0;
        Vec3 rest = Vec3::Zero();         // m
        std::uint32_t when = 0;           // the last change of the surface that the links know of
        bool is_found = false;            // whether links holds what is near
        bool is_wanted = false;           // in this step
        std::uint32_t known_phyxels = 0;  // the first so many were asked for links
        std::vector<Link> links;
    };
    std::size_t slot_of(std::uint64_t edge) const;
    static void look_along(const Entry& entry, std::span<Link* const> links, const SightContext& context);
    static void doubt(Entry& entry, const SightContext& context);
    void rebuild_table(std::size_t slots);
    void forget_unused();

    std::vector<Entry> entries_;  // those from used_ on wait for new edges, with their memory
    std::size_t used_ = 0, wanted_ = 0;
    std::vector<std::uint32_t> table_;  // open addressing: number + 1, or 0
    std::size_t phyxels_ = 0;
};

}  // namespace splitcubes::body
