// Moves what a scene moves by itself: its tools, constraints, handles and colliders.
#pragma once

#include "published_state.h"
#include "scene_source.h"

#include <splitcubes/scene/course.h>

#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace splitcubes::view {

/// Edges of the scene's tools while they cut, m, world; not of those that are drawn as solids.
void append_blades(const SceneSource& source, const scene::Course& course, double time,
                   std::vector<std::vector<Vec3>>& out);
/// The solids of the scene's tools while they are near their work.
void append_instruments(const SceneSource& source, const scene::Course& course, double time,
                        std::vector<InstrumentState>& out);
/// meshes: of the colliders, own frames.
void append_colliders(const scene::SceneDescription& scene, const scene::Course& course,
                      const std::vector<std::shared_ptr<const geometry::TriangleMesh>>& meshes, double time,
                      std::vector<ColliderState>& out);

/// Between two steps it gives the simulation the poses of the next one. Its state are ids and the course of
/// the scene; a copy goes on from where the simulation was, and one that has not gone back in time with the
/// simulation forgets what came later.
class SceneDriver {
  public:
    /// Adds the scene's things to a simulation that has its bodies.
    SceneDriver(const SceneSource& source, Simulation& simulation, const std::vector<BodyId>& bodies);
    /// Before each step.
    void advance(Simulation& simulation);
    /// After the simulation has gone back in time.
    void go_back(const Simulation& simulation);
    const scene::Course& course() const { return course_; }
    bool owns(ToolId tool) const;
    bool owns(HandleId handle) const;
    /// Handles whose regions have vertices among those of the bodies.
    void append_rods(double time, const std::vector<BodyState>& states, std::vector<RodState>& out) const;
    /// Forces of a step on the scene's tools and by its handles.
    void append_forces(const StepResult& result, double time, std::vector<ForceState>& out) const;
    const std::vector<std::shared_ptr<const geometry::TriangleMesh>>& collider_meshes() const {
        return collider_meshes_;
    }

  private:
    BodyId body_of(const std::string& name) const;
    void add_tools(Simulation& simulation);
    void add_colliders(Simulation& simulation);
    void add_solid_tools(Simulation& simulation);
    void advance_course(const Simulation& simulation);
    void move_tools(Simulation& simulation, double from, double to);
    void move_constraints(Simulation& simulation, double from, double to);
    void move_handles(Simulation& simulation, double from, double to);

    const SceneSource& source_;
    std::vector<BodyId> bodies_;
    scene::Course course_;
    std::vector<std::vector<ToolId>> tools_;  // a scene's tool: one an edge of it
    std::vector<std::optional<ConstraintId>> constraints_;
    std::vector<std::optional<HandleId>> handles_;
    std::vector<ColliderId> colliders_;
    std::vector<std::pair<std::size_t, ColliderId>> solid_tools_;  // number of the tool
    std::vector<std::function<bool(const Vec3&)>> handle_regions_;
    std::vector<std::shared_ptr<const geometry::TriangleMesh>> collider_meshes_;
};

}  // namespace splitcubes::view
