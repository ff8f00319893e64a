// Why tools of a simulation cut nothing: watches them step by step, until each has cut.
#pragma once

#include <splitcubes/body/world.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/splitting/crossed_edges.h>

#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// A tool that cut no edge, and a body that it might have cut.
struct IdleTool {
    std::size_t tool, body;
    geometry::Box sweep;             // m, world: what the blade swept so far; empty: it was never active
    geometry::Box bounds;            // m, world: of the body meanwhile
    splitting::CrossedEdges before;  // that the blade crossed in the steps but the last
    splitting::CrossedEdges last;    // in the last, whose marks would appear in the next
};

/// Costs nothing once all tools have cut. One that has not is compared with the bounds of the bodies
/// while it moves, and where they meet, its way through the body's rest space is followed.
class IdleTools {
  public:
    /// Tools that have cut already, in an earlier part of the run, are known by their marks.
    explicit IdleTools(const World& world);
    /// To be called after each step.
    void observe(const World& world, const StepReport& report);
    /// Of each idle tool the body that it came nearest to cutting.
    std::vector<IdleTool> idle(const World& world) const;

  private:
    struct Pair {
        geometry::Box bounds;
        std::vector<std::vector<Vec3>> pose;  // of the blade, in the body's rest space; empty: unknown
        std::vector<std::uint64_t> before, last;
    };
    void follow(const World& world, std::size_t tool, std::size_t body);

    std::vector<std::uint8_t> has_cut_;  // per tool
    std::vector<geometry::Box> sweep_;   // per tool
    std::vector<Pair> pairs_;            // per tool and body
};

}  // namespace splitcubes::body
