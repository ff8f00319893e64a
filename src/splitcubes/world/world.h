// All bodies and tools of a simulation, and the step that advances them.
#pragma once

#include <splitcubes/body/step_report.h>
#include <splitcubes/contact/detection/collider.h>
#include <splitcubes/contact/response/contact.h>
#include <splitcubes/core/state_hash.h>
#include <splitcubes/cutting/blade.h>
#include <splitcubes/dynamics/solver_options.h>

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes {
class StateReader;
class StateWriter;
namespace meshless {
struct Obstacle;
struct StepInput;
}  // namespace meshless
}  // namespace splitcubes

namespace splitcubes::body {

class Body;
struct BodySettings;
struct BodyView;
class ColliderOverlaps;
class ContactFinder;
struct ContactIsland;
struct HitTask;
class Restitution;
class RigidContacts;
struct StepContext;
struct TopologyChange;

struct WorldSettings {
    double time_step = 1.0 / 60;                  // s
    double start_time = 0;                        // s, time before the first step
    Vec3 gravity = Vec3(0, 0, -9.81);             // m/s^2
    std::optional<meshless::GroundPlane> ground;  // becomes the first collider
    ContactOptions contact;
    meshless::SolverOptions solver;
    /// Validates all bodies after every step and throws JobError with the first error; on by default if
    /// NDEBUG is not defined.
#ifdef NDEBUG
    bool validate_each_step = false;
#else
    bool validate_each_step = true;
#endif
};

/// Sides of a blade behind its edge, on which the cut faces slide with friction.
struct BladeSides {
    double reach = 0;     // m, width of the sides behind the edge
    double friction = 0;  // Coulomb coefficient
};

/// In the list of a tool's bodies, in place of one that has been removed.
inline constexpr std::size_t removed_body = std::numeric_limits<std::size_t>::max();

/// A blade and what it may cut.
struct Tool {
    cutting::Blade blade;
    BladeSides sides;
    std::vector<std::size_t> bodies;  // indices of the bodies it cuts; empty: all. removed_body: none
    std::vector<Vec3> last_normal;    // per body: last normal of the stroke, world
    std::int32_t cut_number = 0;      // of the crossings that it makes
};

class World {
  public:
    World(const WorldSettings& settings, std::shared_ptr<const Parallel> parallel);
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    /// mesh: in its own frame, which settings.pose places.
    Body& add_body(const geometry::TriangleMesh& mesh, const BodySettings& settings);
    void add_collider(Collider collider) { colliders_.push_back(std::move(collider)); }
    /// Its crossings get the next cut number.
    void add_tool(cutting::Blade blade, std::vector<std::size_t> bodies = {}, const BladeSides& sides = {});
    // Indices above a removed one decrease by one, also in cached contacts and in the lists of tools. The
    // motion of all else changes only by contacts with the removed one.
    void remove_body(std::size_t index);
    void remove_collider(std::size_t index);
    void remove_tool(std::size_t index);
    /// Returns an unused cut number, for cuts without a tool.
    std::int32_t take_cut_number() { return next_cut_number_++; }
    std::int32_t next_cut_number() const { return next_cut_number_; }
    void set_next_cut_number(std::int32_t number) { next_cut_number_ = number; }

    /// Adds a pose of a tool at a time (s) after its last sample.
    void move_tool(std::size_t tool, double time, const Isometry& frame) {
        tools_[tool].blade.move_to(time, frame);
    }
    void set_tool_active(std::size_t tool, double from, double until) {
        tools_[tool].blade.set_active(from, until);
    }
    /// Drops what tools' paths were before the last step: no further step reads it.
    void forget_tool_paths();
    /// Sets the current frame (world from own) of a tool, between two steps: for tools that a user or a
    /// controller moves interactively. Its blade must have been made with a SampledMotion.
    void move_tool(std::size_t tool, const Isometry& frame) { tools_[tool].blade.move_to(time(), frame); }
    /// Makes a tool follow a path from now on; the times when it is active stay.
    void set_tool_path(std::size_t tool, const SampledMotion& path);

    /// Advances everything by one time step. Tools cut the edges that they crossed during the interval that
    /// ended when the step began, since both ends of that interval are known; so a cut appears one step after
    /// the blade passed.
    StepReport step();

    double time() const { return step_start(step_count_); }
    /// Returns the time at the start of a step, s.
    double step_start(std::int64_t step) const {
        return settings_.start_time + static_cast<double>(step) * settings_.time_step;
    }
    std::int64_t step_count() const { return step_count_; }
    const WorldSettings& settings() const { return settings_; }
    const Parallel& parallel() const { return *parallel_; }
    std::vector<std::unique_ptr<Body>>& bodies() { return bodies_; }
    const std::vector<std::unique_ptr<Body>>& bodies() const { return bodies_; }
    const std::vector<Tool>& tools() const { return tools_; }
    /// Per body: what the last step changed. Valid until the next step.
    std::span<const TopologyChange> topology_changes() const;
    const std::vector<Collider>& colliders() const { return colliders_; }
    void set_collider_motion(std::size_t index, std::function<Isometry(double time)> motion) {
        colliders_[index].motion = std::move(motion);
    }
    /// The contacts with a normal force in the last step, sorted by key.
    const std::vector<meshless::CachedContact>& active_contacts() const { return cached_contacts_; }

    /// Returns all surfaces in one mesh; pieces are numbered consecutively over the bodies.
    geometry::SurfaceMesh surface_mesh() const;
    /// Returns a hash of the whole state. Equal runs have equal hashes, for any number of threads.
    StateHash state_hash() const;
    /// For checkpoints (checkpoint.h); see Body::save and Body::load.
    void save(StateWriter& writer) const;
    void load(StateReader& reader);

  private:
    std::vector<meshless::Obstacle> obstacles_now() const;
    void accumulate_side_friction(const Tool& tool, ToolForce& force) const;
    template <class NewKey>
    void renumber_cached_contacts(const NewKey& new_key);
    HitTask hit_task(std::span<const BodyView> views) const;
    void begin_hits(std::span<const BodyView> views);
    void finish_hits(StepReport& report);
    void begin_overlaps(const StepContext& context, StepReport& report);
    void undo_overlaps(const StepContext& context, StepReport& report);
    void draw_on_colliders(std::size_t body, double start);
    void integrate(const StepContext& context, StepReport& report);
    void integrate_island(const ContactIsland& island, const StepContext& context, StepReport& report);
    void step_together(const ContactIsland& island, const meshless::ContactInput& contacts,
                       const StepContext& context, StepReport& report);

    WorldSettings settings_;
    std::shared_ptr<const Parallel> parallel_;
    std::vector<std::unique_ptr<Body>> bodies_;
    std::vector<TopologyChange> topology_changes_;  // per body, of the last step
    std::vector<Tool> tools_;
    std::vector<Collider> colliders_;
    std::unique_ptr<ContactFinder> contact_finder_;
    std::vector<ContactIsland> contact_islands_;
    std::unique_ptr<RigidContacts> rigid_contacts_;
    std::unique_ptr<ColliderOverlaps> collider_overlaps_;
    std::unique_ptr<Restitution> restitution_;
    std::vector<meshless::CachedContact> cached_contacts_;  // sorted by key
    struct IslandStep;
    std::unique_ptr<IslandStep> island_step_;
    std::vector<meshless::CachedContact> next_cached_contacts_;
    std::int64_t step_count_ = 0;
    std::int32_t next_cut_number_ = 0;
};

}  // namespace splitcubes::body
