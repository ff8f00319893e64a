// Settings of simulations and of the things in them. All have defaults; set what matters by designated
// initialisers.
#pragma once

#include <splitcubes/api/mesh.h>
#include <splitcubes/api/types.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace splitcubes {

/// The half space below a plane, on which bodies lie.
struct Ground {
    Vector3 normal{0, 0, 1};  ///< of any length above zero, upwards
    double offset = 0;        ///< m: the points p with normal . p = offset, the normal made unit
    double friction = 0.5;    ///< Coulomb coefficient, >= 0
};

/// Contact between bodies and pieces.
struct ContactSettings {
    bool pieces = true;     ///< pieces and bodies push on each other, and cut faces on theirs
    double friction = 0.5;  ///< between them, Coulomb coefficient, >= 0
    /// Coefficient of restitution, 0 to 1: the speed at which two things part after a hit, over that at which
    /// they met, also of hits on colliders and the ground. None: as the solver leaves it.
    std::optional<double> restitution = {};
};

/// Integrators of implicit steps.
enum class Integrator : std::uint8_t {
    bdf2,            ///< of second order; damps vibrations of a few steps per period
    backward_euler,  ///< of first order; damps strongly
    tr_bdf2,         ///< of second order with little damping, in two solves; in contact as bdf2
};

/// Settings of the time steps.
struct SolverSettings {
    bool explicit_steps = false;               ///< many small explicit steps in place of an implicit one
    Integrator integrator = Integrator::bdf2;  ///< of implicit steps
    double tolerance = 1e-3;                   ///< of the linear solve, relative to the forces of the step
    int max_iterations = 200;                  ///< of the linear solve
};

/// Budgets of undo and redo.
struct HistorySettings {
    /// Undo goes back to before each cut at rest, and before each lower_tool while no other tool is lowered.
    bool automatic = true;
    std::uint64_t memory_budget = std::uint64_t{256} << 20;  ///< bytes; what is beyond goes to the disk
    /// Folder for what is beyond the memory budget, which must exist; empty: the oldest entries are dropped
    /// then. Files in it are removed when the simulation ends.
    std::string disk_folder;
    std::uint64_t disk_budget = std::uint64_t{4} << 30;  ///< bytes; beyond it the oldest entries are dropped
};

/// Settings of a Simulation.
struct SimulationSettings {
    double time_step = 1.0 / 60;        ///< s, > 0
    Vector3 gravity{0, 0, -9.81};       ///< m/s^2
    std::optional<Ground> ground = {};  ///< none: things fall on
    ContactSettings contact = {};       ///< between pieces and bodies
    SolverSettings solver = {};         ///< of the elastic step
    HistorySettings history = {};       ///< of undo and redo
    /// Threads of a step, 0: as many as the machine has. Results are the same bits for any number.
    int thread_count = 0;
};

/// Strain that stays.
struct PlasticitySettings {
    double yield = 0.02;  ///< norm of the elastic strain above which it flows, > 0
    double creep = std::numeric_limits<double>::infinity();  ///< rate of flow, 1/s, > 0; infinite: at once
    double maximum = 0.4;                                    ///< of the plastic strain's norm, > 0
};

/// Elastic material.
struct MaterialSettings {
    double density = 1000;         ///< kg/m^3, > 0
    double youngs_modulus = 1e5;   ///< Pa, > 0
    double poisson_ratio = 0.3;    ///< 0 <= . < 0.5
    double mass_damping = 0;       ///< 1/s, >= 0
    double stiffness_damping = 0;  ///< s, >= 0
    double cutting_resistance =
        0;  ///< fracture toughness, J/m^2: work of a blade for an area at rest that it cuts
    std::optional<PlasticitySettings> plasticity = {};  ///< none: elastic
};

/// When material tears by itself.
struct TearingSettings {
    double strength = std::numeric_limits<double>::infinity();  ///< Pa, largest principal Cauchy stress, > 0
    double propagation_ratio = 0.6;  ///< share of the strength that holds at a crack's tip, (0, 1]
};

/// Settings of a simulation that may change between two steps.
struct StepSettings {
    double time_step = 1.0 / 60;                 ///< s, > 0
    Vector3 gravity{0, 0, -9.81};                ///< m/s^2
    std::optional<double> ground_friction = {};  ///< Coulomb coefficient, >= 0; none: there is no ground
    double contact_friction = 0.5;               ///< between pieces and bodies, Coulomb coefficient, >= 0
    std::optional<double> restitution = {};      ///< of hits, 0 to 1; none: as the solver leaves them
};

/// A soft body.
struct BodySettings {
    std::string name = "body";       ///< for messages
    Pose placement = {};             ///< world from the mesh; rest space is the world with the body so placed
    double scale = 1;                ///< of the mesh before it is placed, > 0
    double cell_size = 0;            ///< m, of the grid that cuts are made in; 0: by `cells`
    int cells = 32;                  ///< along the longest side, where no cell size is given, 2 to 1024
    int phyxel_count = 800;          ///< elastic samples, about; 1 or more
    double phyxel_spacing = 0;       ///< m, between elastic samples; 0: by `phyxel_count`
    MaterialSettings material = {};  ///< that it is made of
    std::optional<TearingSettings> tearing = {};  ///< none: only tools cut it
    Vector3 velocity = {};                        ///< m/s, when it is added
    Vector3 angular_velocity = {};                ///< rad/s, about the centre of mass, when it is added
};

/// A blade. It starts raised: lower_tool lets it cut.
struct ToolSettings {
    std::string name = "blade";       ///< for messages
    Pose pose = {};                   ///< world from own frame when it is added
    std::vector<BodyId> bodies = {};  ///< that it cuts; empty: all, those that come later too
    double side_reach = 0;            ///< m, how far its sides reach behind the edge, for friction
    double side_friction = 0;         ///< Coulomb coefficient of the sides, >= 0
};

/// An axis-aligned box at rest.
struct BoxRegion {
    Vector3 low = {};   ///< m, rest space
    Vector3 high = {};  ///< m, rest space
};
/// A ball at rest.
struct SphereRegion {
    Vector3 centre = {};  ///< m, rest space
    double radius = 0;    ///< m, > 0
};
/// Returns whether a point, in rest space, belongs to it. Called while something is added and within steps,
/// by the thread that calls; must always say the same, must not throw, and must not call the simulation
/// (ErrorKind::busy).
using RegionTest = std::function<bool(const Vector3& rest)>;
/// A part of a body, by its rest positions. A RegionTest cannot be saved to a file.
using Region = std::variant<BoxRegion, SphereRegion, RegionTest>;

/// A region that is held, and moves as its poses say.
struct ConstraintSettings {
    Region region = {};  ///< must hold an elastic sample
    Pose pose = {};      ///< world from rest when it is added; the default holds it where it is at rest
};

/// Springs that pull a region to where its poses say.
struct HandleSettings {
    std::string name = "handle";                                   ///< for messages
    Region region = {};                                            ///< must hold an elastic sample
    Pose pose = {};                                                ///< world from rest when it is added
    double stiffness = 1000;                                       ///< N/m, of the whole region, > 0
    double force_limit = std::numeric_limits<double>::infinity();  ///< N, of the whole force, > 0
};

/// A half space normal . p <= offset, in its own frame.
struct HalfSpaceShape {
    Vector3 normal{0, 0, 1};  ///< outwards, of any length above zero
    double offset = 0;        ///< m
};
/// A ball about the origin of its own frame.
struct SphereShape {
    double radius = 0;  ///< m, > 0
};
/// A box about the origin of its own frame.
struct BoxShape {
    Vector3 size = {};    ///< m, whole sides, > 0
    double rounding = 0;  ///< m, of the edges, up to half the shortest side
};
/// A half space, a ball, a box, or a mesh that encloses something, by distances on a grid of 64 cells.
using ColliderShape = std::variant<HalfSpaceShape, SphereShape, BoxShape, MeshView>;

/// A thing that does not deform and pushes bodies.
struct ColliderSettings {
    std::string name = "collider";  ///< for messages
    ColliderShape shape = {};       ///< in its own frame
    Pose pose = {};                 ///< world from own frame when it is added
    double friction = 0.5;          ///< Coulomb coefficient, >= 0
};

}  // namespace splitcubes
