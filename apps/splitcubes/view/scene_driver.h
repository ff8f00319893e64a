// Moves what a scene moves by itself: its tools, constraints, handles and colliders.
#pragma once

#include "published_state.h"
#include "scene_source.h"

#include <optional>
#include <vector>

namespace splitcubes::view {

/// Between two steps it gives the simulation the poses of the next one. It keeps no state but the ids, so
/// that it follows the simulation back and forward in time.
class SceneDriver {
  public:
    /// Adds the scene's things to a simulation that has its bodies.
    SceneDriver(const SceneSource& source, Simulation& simulation, const std::vector<BodyId>& bodies);
    /// Before each step.
    void advance(Simulation& simulation);
    bool owns(ToolId tool) const;
    bool owns(HandleId handle) const;
    /// Edges of the scene's tools while they cut, m, world.
    void append_blades(double time, std::vector<std::vector<Vec3>>& out) const;
    void append_colliders(double time, std::vector<ColliderState>& out) const;

  private:
    BodyId body_of(const std::string& name) const;
    void add_tools(Simulation& simulation);
    void add_colliders(Simulation& simulation);
    void move_tools(Simulation& simulation, double from, double to);
    void move_constraints(Simulation& simulation, double from, double to);
    void move_handles(Simulation& simulation, double from, double to);

    const SceneSource& source_;
    std::vector<BodyId> bodies_;
    std::vector<std::vector<ToolId>> tools_;  // a scene's tool: one an edge of it
    std::vector<std::optional<ConstraintId>> constraints_;
    std::vector<std::optional<HandleId>> handles_;
    std::vector<ColliderId> colliders_;
    std::vector<std::shared_ptr<const geometry::TriangleMesh>> collider_meshes_;
};

}  // namespace splitcubes::view
