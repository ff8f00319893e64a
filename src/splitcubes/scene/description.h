// The contents of a scene as plain data: all defaults are filled in, all units are SI,
// all coordinates are in the world frame at time 0 unless said otherwise.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/occlusion/criterion.h>
#include <splitcubes/scene/appearance.h>
#include <splitcubes/scene/shapes.h>

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace splitcubes::scene {

// Regions of a body, in placed coordinates at time 0; closed sets.

struct BoxRegion {
    Vec3 min = Vec3::Zero();  // m
    Vec3 max = Vec3::Zero();  // m
    bool operator==(const BoxRegion&) const = default;
};
struct SphereRegion {
    Vec3 center = Vec3::Zero();  // m
    double radius = 1;           // m
    bool operator==(const SphereRegion&) const = default;
};
/// The points p with (p - point) . normal >= 0.
struct HalfSpaceRegion {
    Vec3 point = Vec3::Zero();    // m
    Vec3 normal = Vec3::UnitZ();  // of any length above zero, points into the region
    bool operator==(const HalfSpaceRegion&) const = default;
};
/// Within `radius` of the segment's line, between its ends.
struct CylinderRegion {
    Vec3 from = Vec3::Zero();  // m
    Vec3 to = Vec3::UnitZ();   // m
    double radius = 1;         // m
    bool operator==(const CylinderRegion&) const = default;
};
/// Within half of `thickness` of a plane.
struct SlabRegion {
    Vec3 point = Vec3::Zero();    // m, on the middle plane
    Vec3 normal = Vec3::UnitZ();  // of any length above zero
    double thickness = 1;         // m, whole
    bool operator==(const SlabRegion&) const = default;
};
using Region = std::variant<BoxRegion, SphereRegion, HalfSpaceRegion, CylinderRegion, SlabRegion>;

enum class MaterialModel { corotated, st_venant_kirchhoff };

/// Strain that stays; strains as the material's model measures them.
struct PlasticityDescription {
    double yield = 0.02;          // norm of the elastic strain above which it flows
    std::optional<double> creep;  // rate of flow, 1/s; none: at once
    double maximum = 0.4;         // of the plastic strain's norm
    bool operator==(const PlasticityDescription&) const = default;
};

/// Makes a part of the body weaker or stronger: `factor` within `region`.
struct StrengthPatch {
    Region region = BoxRegion{};
    double factor = 1;
    bool operator==(const StrengthPatch&) const = default;
};
/// Strength painted on the mesh: at each point the brightness (mean of red, green and
/// blue) of the nearest surface point, 0 standing for `dark`, 1 for `light`. The paint is a
/// picture laid on by the mesh's texture coordinates, or else its vertex colours.
struct StrengthPaint {
    double dark = 0.1;
    double light = 1;
    std::filesystem::path picture;  // absolute; empty: the vertex colours
    std::string picture_sha256{};   // of what that file holds; empty: whatever it holds
    bool operator==(const StrengthPaint&) const = default;
};
using StrengthLayer = std::variant<StrengthPatch, StrengthPaint>;

/// Stress above which the material parts.
struct TearingDescription {
    double strength = 1e5;                    // Pa, of the largest principal stress
    double propagation_ratio = 0.6;           // share of it that is borne at the tip of a crack
    std::optional<double> crack_speed;        // m/s; none: as fast as in brittle material
    std::vector<StrengthLayer> strength_map;  // factors of the strength, multiplied where they overlap
    bool operator==(const TearingDescription&) const = default;
};

struct MaterialDescription {
    MaterialModel model = MaterialModel::corotated;
    double density = 1000;         // kg/m^3
    double youngs_modulus = 1e5;   // Pa
    double poisson_ratio = 0.3;    // [0, 0.499]
    double volume_stiffness = 0;   // Pa, against change of volume in large deformation
    double mass_damping = 0;       // 1/s
    double stiffness_damping = 0;  // s
    double zero_energy = 0.35;     // dimensionless weight of the penalty on zero-energy modes
    std::optional<PlasticityDescription> plasticity;  // none: elastic
    std::optional<TearingDescription> tearing;        // none: only tools cut it
    double cutting_resistance = 0;  // J/m^2, fracture toughness: work of a blade per rest area
    bool operator==(const MaterialDescription&) const = default;
};

// Deformation models that move a body instead of its phyxels.

/// A control point of a free-form lattice and where it is displaced to.
struct LatticePoint {
    Vec3i index = Vec3i::Zero();
    Vec3 displacement = Vec3::Zero();  // m
    bool operator==(const LatticePoint&) const = default;
};
struct LatticeKeyframeDescription {
    double time = 0;                   // s, strictly increasing
    std::vector<LatticePoint> points;  // those not named are not displaced
    bool operator==(const LatticeKeyframeDescription&) const = default;
};
/// The body's box as a Bezier volume.
struct FreeFormDescription {
    Vec3i degree = Vec3i(1, 1, 1);  // per axis; one more control points
    std::vector<LatticeKeyframeDescription> keyframes;
    bool operator==(const FreeFormDescription&) const = default;
};
/// Springs between the grid's nodes, with the material's density, modulus and damping.
struct MassSpringDescription {
    bool operator==(const MassSpringDescription&) const = default;
};
using DeformationDescription = std::variant<FreeFormDescription, MassSpringDescription>;

struct BodyDescription {
    std::string name;
    Shape shape = BoxShape{};
    PlacementDescription placement;
    // Exactly one of the two is set.
    std::optional<int> cells = 32;    // grid cells along the longest side of the placed shape's box
    std::optional<double> cell_size;  // m
    // Exactly one of the two is set.
    std::optional<int> phyxel_count = 800;  // wished for; the sampling comes close to it
    std::optional<double> phyxel_spacing;   // m
    MaterialDescription material;
    std::optional<DeformationDescription> deformation;  // none: elastic phyxels
    AppearanceDescription appearance;
    Vec3 velocity = Vec3::Zero();          // m/s, world, at time 0
    Vec3 angular_velocity = Vec3::Zero();  // rad/s, world, about the centre of mass, at time 0
    bool operator==(const BodyDescription&) const = default;
};

struct GroundDescription {
    double height = 0;      // m, the plane z = height; the free side is above
    double friction = 0.5;  // Coulomb coefficient
    bool operator==(const GroundDescription&) const = default;
};

/// A pose on a path. Between keyframes positions are interpolated as the owner
/// says and rotations take the short way round; before the first and after the
/// last the path stands still.
struct MotionKeyframe {
    double time = 0;               // s, strictly increasing along a path
    Vec3 position = Vec3::Zero();  // m; of a constraint: displacement; of a tool: of its frame's origin
    Rotation rotation;             // of a constraint: about its pivot; of a tool: about its frame's origin
    bool operator==(const MotionKeyframe&) const = default;
};

/// What must hold, all that is given. Once it held it counts as holding, whatever comes.
struct Condition {
    std::string body;            // name of a body that is in several pieces; empty: none
    int at_least = 2;            // pieces of that body
    std::string ended;           // name of a tool whose motion has ended; empty: none
    std::optional<double> time;  // s, that has come
    bool operator==(const Condition&) const = default;
};

enum class CarrierKind { tool, collider, body };

/// What a motion is given relative to, so that it is carried along.
struct Carrier {
    CarrierKind kind = CarrierKind::tool;
    std::string name;
    std::optional<Region> region;  // of a body: the part whose material carries; none: all of it
    bool operator==(const Carrier&) const = default;
};

enum class ConstraintKind {
    hold,  // the region stays where it is at time 0
    move,  // the region follows the keyframes
};

/// Prescribes the positions of material that is inside `region` at time 0, while
/// from_time <= time < until_time.
struct ConstraintDescription {
    std::string body;  // name of the body
    Region region = HalfSpaceRegion{};
    ConstraintKind kind = ConstraintKind::hold;
    std::vector<MotionKeyframe> keyframes;  // empty for hold, at least one for move
    Vec3 pivot = Vec3::Zero();              // m; when not said: the region's centre (half space: its point)
    double from_time = 0;                   // s
    std::optional<double> until_time;       // s; none: never released
    std::optional<Condition> start_when;    // times count from when it holds, motion from where it is then
    std::optional<Condition> release_when;
    /// The region goes along with it, from where both are at from_time; keyframes move it in addition.
    std::optional<Carrier> relative_to;
    bool operator==(const ConstraintDescription&) const = default;
};

// Blade edges, in the tool's own frame.

struct PolylineBlade {
    std::vector<Vec3> points;  // m, at least two
    bool operator==(const PolylineBlade&) const = default;
};
struct StraightBlade {
    Vec3 from = Vec3::Zero();  // m
    Vec3 to = Vec3::UnitZ();   // m
    bool operator==(const StraightBlade&) const = default;
};
/// From start to end right-handed about the axis. Angle zero is the part of the x
/// axis perpendicular to `axis`; of the y axis where `axis` is within 25 degrees of x.
struct ArcBlade {
    Vec3 center = Vec3::Zero();  // m
    double radius = 1;           // m
    Vec3 axis = Vec3::UnitZ();   // direction of any length above zero
    double start_angle_degrees = 0;
    double end_angle_degrees = 180;
    int segments = 16;
    bool operator==(const ArcBlade&) const = default;
};
using BladeDescription = std::variant<PolylineBlade, StraightBlade, ArcBlade>;

enum class Interpolation {
    linear,  // straight lines between the positions
    smooth,  // Catmull-Rom through the positions
};

struct KeyframeMotion {
    std::vector<MotionKeyframe> keyframes;  // at least one
    Interpolation interpolation = Interpolation::linear;
    bool operator==(const KeyframeMotion&) const = default;
};
/// The frame's origin goes along a circle at a constant rate; angle zero as for ArcBlade.
struct CircularMotion {
    Vec3 center = Vec3::Zero();  // m
    Vec3 axis = Vec3::UnitZ();   // direction of any length above zero
    double radius = 1;           // m
    double start_angle_degrees = 0;
    double turns = 1;            // negative: left-handed about the axis
    double from_time = 0;        // s
    double until_time = 1;       // s
    bool turn_with_path = true;  // the frame turns along with the angle that has been passed
    bool operator==(const CircularMotion&) const = default;
};
/// A circle whose centre rises along the axis and whose radius may change, both at a constant rate.
struct HelixMotion {
    CircularMotion circle;             // its radius is that at the start
    double rise = 0;                   // m, along the axis, over the whole motion
    std::optional<double> end_radius;  // m; none: that at the start
    bool operator==(const HelixMotion&) const = default;
};
using SimpleMotion = std::variant<KeyframeMotion, CircularMotion, HelixMotion>;
/// Motions one inside the other: each moves the frame in which the next one is given.
struct ComposedMotion {
    std::vector<SimpleMotion> parts;  // the outermost first; at least one
    bool operator==(const ComposedMotion&) const = default;
};
using Motion = std::variant<KeyframeMotion, CircularMotion, HelixMotion, ComposedMotion>;

/// Makes a tool's instrument push what it touches.
struct SolidDescription {
    double friction = 0.3;  // Coulomb coefficient
    bool operator==(const SolidDescription&) const = default;
};

/// Blades that move as one rigid thing and cut while active_from <= time <= active_until.
struct ToolDescription {
    std::string name;
    std::vector<BladeDescription> blades;  // at least one
    std::vector<std::string> bodies;       // names of those it cuts; empty: all
    Motion motion = KeyframeMotion{};
    double active_from = 0;                           // s; when not said: the motion's first time
    double active_until = 0;                          // s; when not said: the motion's last time
    double side = 0;                                  // m, how far the blade's sides reach behind its edge
    double friction = 0;                              // of the sides, Coulomb coefficient
    std::optional<InstrumentDescription> instrument;  // none: its edges are drawn as lines
    std::optional<geometry::Finish> finish;           // of the blade; none: steel
    std::optional<geometry::Finish> grip_finish;      // of its handle; none: black plastic
    std::optional<SolidDescription> solid;            // none: only its edges act
    std::optional<Carrier> relative_to;  // whose motion depends on the state; none: the motion is the world's
    std::optional<Condition> start_when;  // its times count from when it holds
    std::optional<Condition> end_when;    // from then on it stands still and does not cut
    std::optional<double> shown_from,
        shown_until;  // s, when its instrument is drawn; none: around its motion
    bool operator==(const ToolDescription&) const = default;
};

enum class SolverKind { implicit_steps, explicit_steps };
enum class Integrator { bdf2, backward_euler, tr_bdf2 };

struct SolverDescription {
    SolverKind kind = SolverKind::implicit_steps;
    // The rest is read by implicit steps only.
    Integrator integrator = Integrator::bdf2;
    double tolerance = 1e-3;   // of the linear solve, relative to the right-hand side
    int max_iterations = 200;  // of the linear solve
    bool operator==(const SolverDescription&) const = default;
};

struct OcclusionDescription {
    std::string backend = "cpu";
    int disk_size = 16;  // texels a side: 8, 16 or 32
    occlusion::CriterionKind criterion = occlusion::CriterionKind::occlusion_disk;
    bool operator==(const OcclusionDescription&) const = default;
};

enum class SurfaceFormat { ply, obj, stl, glb };

struct OutputDescription {
    int every_nth_frame = 1;                    // 1: all
    SurfaceFormat format = SurfaceFormat::ply;  // of the surface meshes
    bool pictures = false;                      // also draw each written frame
    bool links = false;                         // also write the links between phyxels
    bool operator==(const OutputDescription&) const = default;
};

/// A camera at a given position, or one that shows the whole scene.
struct CameraDescription {
    std::optional<Vec3> eye;                 // m, world; none: placed automatically
    std::optional<Vec3> target;              // m, world; set exactly when eye is
    Vec3 direction = Vec3(0.6, -1.0, 0.55);  // scene to eye, any length; of the automatic camera
    Vec3 up = Vec3::UnitZ();                 // direction, world
    double vertical_fov_degrees = 35;        // whole opening angle
    int width = 1280;                        // of the picture, pixels, even
    int height = 720;                        // of the picture, pixels, even
    bool operator==(const CameraDescription&) const = default;
};

/// A half space that is solid.
struct HalfSpaceShape {
    Vec3 point = Vec3::Zero();    // m, on its plane
    Vec3 normal = Vec3::UnitZ();  // of any length above zero, out of the solid
    bool operator==(const HalfSpaceShape&) const = default;
};

/// A solid that does not deform and is not pushed. Without a motion it stays at its placement.
struct ColliderDescription {
    std::string name;
    std::optional<Shape> shape;                // in its own frame
    std::optional<HalfSpaceShape> half_space;  // world at time 0; exactly one of the two is set
    PlacementDescription placement;            // of `shape`
    double rounding = 0;                       // m, of a box's edges
    std::vector<MotionKeyframe> keyframes;     // displacement, and rotation about the pivot; empty: still
    Vec3 pivot = Vec3::Zero();            // m; when not said: the placement's position, the plane's point
    double friction = 0.5;                // Coulomb coefficient
    std::optional<Carrier> relative_to;   // none: the keyframes are the world's
    std::optional<Condition> start_when;  // the keyframes' times count from when it holds
    std::optional<Condition> end_when;    // from then on it stands still
    std::optional<geometry::Finish> finish;
    bool operator==(const ColliderDescription&) const = default;
};

/// Pieces and bodies against each other.
struct ContactDescription {
    bool pieces = true;
    double friction = 0.5;              // Coulomb coefficient
    std::optional<double> restitution;  // coefficient of all hits; none: as the solvers leave them
    bool operator==(const ContactDescription&) const = default;
};

/// Pulls what is inside `region` at time 0 along a path while from_time <= time < until_time.
struct HandleDescription {
    std::string name;
    std::string body;
    Region region = HalfSpaceRegion{};
    std::vector<MotionKeyframe> keyframes;  // empty: it pulls to where the region was at time 0
    Vec3 pivot = Vec3::Zero();              // m; when not said: the region's centre
    double stiffness = 1000;                // N/m, of the whole region
    std::optional<double> force_limit;      // N; none: as much as the springs give
    double from_time = 0;                   // s
    std::optional<double> until_time;       // s; none: never released
    std::optional<Condition> start_when;    // times count from when it holds, motion from where it is then
    std::optional<Condition> release_when;
    /// The region goes along with it, from where both are at from_time; the keyframes move it in addition.
    std::optional<Carrier> relative_to;
    bool operator==(const HandleDescription&) const = default;
};

struct SceneDescription {
    std::string name;
    std::filesystem::path folder;  // absolute; what relative file names refer to
    std::vector<BodyDescription> bodies;
    Vec3 gravity = Vec3(0, 0, -9.81);  // m/s^2, world
    std::optional<GroundDescription> ground;
    std::vector<ColliderDescription> colliders;
    ContactDescription contact;
    std::vector<ConstraintDescription> constraints;
    std::vector<HandleDescription> handles;
    std::vector<ToolDescription> tools;
    SolverDescription solver;
    OcclusionDescription occlusion;
    double time_step = 1.0 / 60;  // s, one frame
    int frames = 120;             // time steps to run; a duration is rounded up to whole ones
    OutputDescription output;
    CameraDescription camera;
    DisplayDescription display;
    int threads = 0;  // 0: what the machine has
    /// One line each, of deprecated keys that the text used.
    std::vector<std::string> deprecations;
    bool operator==(const SceneDescription&) const = default;
};

}  // namespace splitcubes::scene
