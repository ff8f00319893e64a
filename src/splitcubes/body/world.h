// All bodies and tools of a simulation, and the step that advances them.
#pragma once

#include <splitcubes/body/body.h>
#include <splitcubes/body/contact_finder.h>
#include <splitcubes/body/rigid_contacts.h>
#include <splitcubes/cutting/blade.h>

#include <memory>
#include <string>
#include <vector>

namespace splitcubes::body {

struct WorldSettings {
    double time_step = 1.0 / 60;                  // s
    Vec3 gravity = Vec3(0, 0, -9.81);             // m/s^2
    std::optional<meshless::GroundPlane> ground;  // becomes the first collider
    ContactOptions contact;
    meshless::SolverOptions solver;
    /// Checks all bodies from nothing after every step and throws JobError with the
    /// first finding; on by default where NDEBUG is not defined.
#ifdef NDEBUG
    bool validate_each_step = false;
#else
    bool validate_each_step = true;
#endif
};

/// What the material feels of a blade but its edge.
struct BladeSides {
    double reach = 0;     // m, how far the sides reach behind the edge
    double friction = 0;  // Coulomb coefficient
};

/// A blade and what it may cut.
struct Tool {
    cutting::Blade blade;
    BladeSides sides;
    std::vector<std::size_t> bodies;  // numbers of the bodies it cuts; empty: all
    std::vector<Vec3> last_normal;    // per body: the stroke's last normal, world
};

class World {
  public:
    World(const WorldSettings& settings, std::shared_ptr<const Parallel> parallel);

    Body& add_body(const geometry::TriangleMesh& placed, const BodySettings& settings);
    void add_collider(Collider collider) { colliders_.push_back(std::move(collider)); }
    void add_tool(cutting::Blade blade, std::vector<std::size_t> bodies = {}, const BladeSides& sides = {});
    /// Where a tool is now (world from own), between two steps: for tools that a hand or a
    /// controller moves as time goes on. Its blade must have been made with samples.
    void move_tool(std::size_t tool, const Isometry& frame) { tools_[tool].blade.move_to(time(), frame); }
    /// Lets a tool go along samples from now on; it stays active when it was.
    void set_tool_path(std::size_t tool, const SampledMotion& path);

    /// Advances everything by one time step. Tools cut what they crossed during the
    /// interval that ended when the step began (both ends of it are known then), so
    /// a blade's mark appears one step after it passed.
    StepReport step();

    double time() const { return static_cast<double>(step_count_) * settings_.time_step; }
    std::int64_t step_count() const { return step_count_; }
    const WorldSettings& settings() const { return settings_; }
    const Parallel& parallel() const { return *parallel_; }
    std::vector<std::unique_ptr<Body>>& bodies() { return bodies_; }
    const std::vector<std::unique_ptr<Body>>& bodies() const { return bodies_; }
    const std::vector<Tool>& tools() const { return tools_; }
    const std::vector<Collider>& colliders() const { return colliders_; }
    void set_collider_motion(std::size_t number, std::function<Isometry(double time)> motion) {
        colliders_[number].motion = std::move(motion);
    }
    /// The contacts that pushed in the last step, sorted by key.
    const std::vector<meshless::CachedContact>& pushing_contacts() const { return contact_memory_; }

    /// All surfaces in one mesh; pieces are numbered through the bodies.
    geometry::SurfaceMesh surface_mesh() const;
    /// Of the whole state: equal for equal runs, for any number of threads.
    StateHash state_hash() const;
    /// For checkpoints (checkpoint.h), as Body's.
    void save(StateWriter& writer) const;
    void load(StateReader& reader);

  private:
    std::vector<meshless::Obstacle> obstacles_now() const;
    void accumulate_side_friction(const Tool& tool, ToolForce& force) const;
    void integrate(const StepContext& context, StepReport& report);
    void integrate_group(const ContactIsland& group, const StepContext& context, StepReport& report);
    void step_together(const ContactIsland& group, const meshless::ContactInput& contacts,
                       const StepContext& context, StepReport& report);
    void step_apart(const ContactIsland& group, const meshless::ContactInput& contacts,
                    const StepContext& context, StepReport& report);
    void push_between(const ContactIsland& group, std::vector<meshless::Contact>& between,
                      std::span<const meshless::StepInput> inputs, const StepContext& context,
                      std::vector<meshless::CachedContact>& next);

    WorldSettings settings_;
    std::shared_ptr<const Parallel> parallel_;
    std::vector<std::unique_ptr<Body>> bodies_;
    std::vector<Tool> tools_;
    std::vector<Collider> colliders_;
    ContactFinder contact_finder_;
    std::vector<ContactIsland> contact_groups_;
    RigidContacts rigid_contacts_;
    std::vector<meshless::CachedContact> contact_memory_;  // sorted by key
    /// Of the group that steps, kept for its memory.
    struct GroupStep {
        std::vector<meshless::CachedContact> cached;
        std::vector<meshless::HandleSpring> handle_springs;
        std::vector<double> limits;
        std::vector<Vec3> handle_forces;
        std::vector<meshless::StepInput> inputs;
        std::vector<meshless::ImplicitSolver::Member> members;
    };
    GroupStep group_step_;
    std::vector<meshless::CachedContact> next_memory_;
    std::int64_t step_count_ = 0;
};

}  // namespace splitcubes::body
