// Diagnoses tools that cut nothing in a simulation.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/splitting/crossed_edges.h>
#include <splitcubes/world/world.h>

#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// A tool that cut no edge, and a body that it might have cut.
struct IdleTool {
    std::size_t tool, body;
    geometry::Box sweep;             // m, world, bounds of the blade's sweep so far; empty: never active
    geometry::Box bounds;            // m, world, bounds of the body meanwhile
    splitting::CrossedEdges before;  // edges that the blade crossed in all steps but the last
    splitting::CrossedEdges last;    // edges crossed in the last step, which the next step would cut
};

/// Watches tools step by step until each has cut; costs nothing after that. A tool that has not cut yet is
/// compared with the bounds of the bodies; where these overlap, its path through the body's rest space is
/// followed.
class IdleTools {
  public:
    /// Recognises tools that have cut in an earlier part of the run by their crossings.
    explicit IdleTools(const World& world);
    /// To be called after each step.
    void observe(const World& world, const StepReport& report);
    /// Returns the idle tools, each with the body that it came closest to cutting.
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
