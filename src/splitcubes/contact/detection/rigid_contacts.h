// Contacts of rigid fragments with elastic pieces and with each other, supported by colliders.
#pragma once

#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/plane_lanes.h>
#include <splitcubes/contact/detection/rigid_impulses.h>
#include <splitcubes/contact/detection/sphere_grid.h>
#include <splitcubes/contact/response/contact.h>
#include <splitcubes/contact/response/obstacle.h>
#include <splitcubes/geometry/signed_distance.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace splitcubes::meshless {
struct Momenta;
struct Phyxels;
struct RigidPiece;
}  // namespace splitcubes::meshless

namespace splitcubes::body {

/// Contacts of rigid pieces with elastic pieces and with each other, at the positions at the start of a step.
/// They are resolved when everything has moved: penetration that arose in the step is undone by moving
/// positions, and the remaining approach velocity is removed by inelastic impulses with Coulomb friction.
/// Which rigid pieces meet each other is found then, too, as their motion is known: where they fly together,
/// however fast, few do.
///
/// Towards surfaces a rigid piece is its contact points; towards other rigid pieces it is the box around them
/// in its own frame. An overlap at the start of the step remains but for a slow depenetration. Elastic pieces
/// take the impulses by their rigid motion only: rigid pieces are light and do not dent them. Colliders that
/// touch an elastic piece keep it from being pushed in. So both momenta are exchanged exactly. Kinetic and
/// potential energy of what contacts connect only decrease, except for what moving colliders and kinematic
/// surfaces supply. Held pieces take no impulse. There is no state between steps. The impulses are solved on
/// one thread.
class RigidContacts {
  public:
    struct Task {
        std::span<const BodyView> bodies;
        std::span<const meshless::Obstacle> obstacles;
        double friction = 0;  // Coulomb coefficient
        double dt = 0;        // s
        Vec3 gravity = Vec3::Zero();
    };
    /// Changes by corrections and impulses.
    struct Outcome {
        double kinetic_energy = 0;             // J
        Vec3 momentum = Vec3::Zero();          // kg m/s
        Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
        double hold_work = 0;                  // J, by impulses of held fragments that move
        std::size_t contacts = 0;              // number of those with an impulse
    };
    /// Finds the contacts with surfaces, before any body steps. finder: the last search of the same bodies in
    /// the same state; islands: what it found.
    void find(const Task& task, const ContactFinder& finder, std::span<const ContactIsland> islands,
              const Parallel& parallel);
    /// Resolves the contacts, after all bodies have stepped and before the node frames are updated.
    Outcome push(const Task& task, const Parallel& parallel);
    /// Number of contacts in the last push, before those are dropped that do not touch.
    std::size_t listed() const { return listed_; }

  private:
    /// A surface sample near a fragment.
    struct Near {
        std::uint32_t sample, fragment;
    };
    /// Tangent plane of a sample.
    struct Plane {
        Vec3 position, normal;
        std::uint32_t body;
        std::int32_t piece;
    };
    /// Planes of the samples near a fragment.
    struct Planes {
        std::vector<Plane> all;
        PlaneLanes lanes;

        void list(const ContactFinder& finder, std::span<const std::uint32_t> samples);
    };
    struct ContactRow {
        std::uint32_t upper = 0;  // fragment
        std::int32_t lower = -1;  // fragment; -1: surface or obstacle
        std::int32_t proxy = -1;  // index of the piece proxy that owns the surface; its piece until find ends
        meshless::ContactSide side;        // of the surface; its part is the index of the body
        Vec3 own = Vec3::Zero();           // m, contact point in the upper fragment's frame
        Vec3 lower_own = Vec3::Zero();     // m, in the lower fragment's frame; else from the surface sample
        Vec3 end_position = Vec3::Zero();  // m, world, lower contact point on a surface after the step
        Vec3 normal = Vec3::UnitZ();       // from lower to upper
        Vec3 start = Vec3::Zero();         // m, upper contact point minus lower one at the start of the step
        double gap = 0;                    // m, at the start of the step
        double max_depenetration = 0;      // m
        double friction = 0;               // Coulomb coefficient
        Vec3 surface_velocity = Vec3::Zero();  // m/s, of a moving obstacle
        double min_normal_velocity = 0;        // m/s, minimum relative normal velocity after the impulses
        Vec3 point = Vec3::Zero();             // m, world, application point of the impulses
    };
    struct Fragment {
        std::uint32_t body = 0, index = 0;  // index into RigidPieces::bodies
        double radius = 0;                  // m, of its contact points about the centre
        double max_displacement = 0;        // m, expected maximum of its points in the step
        Vec3 start_centre = Vec3::Zero();   // m, before the step
        Mat3 start_rotation = Mat3::Identity();
        double motion = 0;                // m, maximum of its points in the step, beside that of all
        Vec3 low = Vec3::Zero();          // m, own frame, bounding box of its points
        Vec3 high = Vec3::Zero();         // m
        bool held = false;                // by a constraint
        bool pushed = false;              // by anything but a collider
        std::vector<std::uint32_t> near;  // surface samples, ascending
        std::vector<ContactRow> rows;     // its contacts with surfaces, then with later fragments
        std::vector<double> depth;        // m, <= 0, per obstacle, before positions are corrected
        double outside_until = 0;         // m, its way below which it is not deeper in obstacles

        Vec3 start_point(const Vec3& own) const { return start_centre + start_rotation * own; }
    };
    /// Contact of an elastic piece with a collider.
    struct Support {
        std::uint32_t proxy = 0;
        meshless::ContactSide side;   // of the piece; its part is the index of the body
        Vec3 normal = Vec3::UnitZ();  // from the collider to the piece
        double offset = 0;            // m, gap at the end of the step less normal . point
        double gap = 0;               // m, after the step, before positions are corrected
        bool is_moving = false;       // the collider
    };
    /// Elastic piece as one rigid body.
    struct PieceProxy {
        std::uint32_t body = 0;
        std::int32_t piece = -1;
        bool held = false;
        double mass = 0;                           // kg
        Vec3 centre = Vec3::Zero();                // m
        Vec3 momentum = Vec3::Zero();              // kg m/s, before the impulses
        Vec3 angular_momentum = Vec3::Zero();      // kg m^2/s, about the centre, before the impulses
        Mat3 inertia = Mat3::Zero();               // kg m^2, about the centre
        Mat3 inverse_inertia = Mat3::Zero();       // 1/(kg m^2)
        Vec3 end_angular_velocity = Vec3::Zero();  // rad/s, at the end of the step
        Vec3 shift = Vec3::Zero();                 // m, position correction
        Vec3 velocity = Vec3::Zero();              // m/s, change by the impulses
        Vec3 angular_velocity = Vec3::Zero();      // rad/s, change by the impulses
        double start_energy = 0;                   // J, of the rigid motion, before the step

        Vec3 moved_centre() const { return centre + shift; }
    };
    /// Movers that contacts connect, fragments and elastic pieces. What is held connects nothing.
    struct Group {
        std::vector<std::uint32_t> movers;
        double energy = 0;       // J, of their rigid motion, that they may have after the step
        double potential = 0;    // J, of gravity, before the corrections
        bool is_driven = false;  // something that moves supplies energy
        Vec3 angular_momentum_debt = Vec3::Zero();  // kg m^2/s, taken by position corrections
    };

    /// Mover while positions are corrected, which only shifts it.
    struct Shifted {
        Vec3 start = Vec3::Zero();     // m, centre before corrections
        Vec3 by = Vec3::Zero();        // m, since then
        Vec3 velocity = Vec3::Zero();  // m/s
        double mobility = 0;           // 1/kg, inverse mass; 0: held
    };
    /// Contact of two movers while positions are corrected.
    struct Correction {
        std::uint32_t upper = 0, lower = 0;
        Vec3 normal = Vec3::UnitZ();  // from lower to upper
        double gap = 0;               // m, remaining_gap before corrections
        double min_depth = 0;         // m, smaller ones are left
        double apart_until = 0;       // m, sum of the ways of both below which they do not overlap
    };

    /// Face of a bounding box in its own frame.
    struct BoxFace {
        int axis = 2, sign = 1;
        double gap = -std::numeric_limits<double>::infinity();  // m
    };

    void list_fragments(const Task& task);
    void measure_surfaces(const Task& task);
    double max_displacement_of(std::uint32_t body, std::int32_t piece) const;
    void list_samples(const ContactFinder& finder, const Parallel& parallel);
    void list_balls(double reach);
    void sort_rows(const Task& task);
    void meet_surface(const Task& task, const ContactFinder& finder, std::uint32_t fragment_index,
                      Planes& planes);
    bool set_gap(const Task& task, const Vec3& point, std::size_t partner, const Planes& planes,
                 ContactRow& row) const;
    static void set_lower_side(const BodyView& body, const ContactFinder::SurfaceSample& partner,
                               const Vec3& point, ContactRow& row);
    static double box_gap(const Fragment& upper, const Fragment& lower);
    void measure_motions();
    void list_rows(const Task& task, const Parallel& parallel);
    BoxFace face_between(const Fragment& upper, const Fragment& lower) const;
    void meet_fragment(const Task& task, std::uint32_t first, std::uint32_t second,
                       std::vector<ContactRow>& rows) const;
    void add_face_rows(const Task& task, std::uint32_t upper, std::uint32_t lower, const BoxFace& face,
                       double near, double end_near, std::vector<ContactRow>& rows) const;
    void meet_obstacles(const Task& task, std::uint32_t fragment_index);
    meshless::RigidPiece& piece_of(const Fragment& fragment) const;
    /// Tells whether corrections reduce overlaps that the step began with.
    enum class Overlaps { keep, reduce };
    void find_end_positions();
    Vec3 lower_point(const ContactRow& row) const;
    std::int32_t proxy_of(std::uint32_t body, std::int32_t piece);
    void measure_proxies(const Task& task);
    void move_proxies();
    void list_supports(std::span<const ContactIsland> islands);
    void measure_supports();
    bool lift_from_supports();
    void correct_positions(const Task& task, Overlaps overlaps);
    void reduce_overlaps(const Task& task);
    // Movers by index: fragments first, then proxies.
    std::uint32_t mover_count() const {
        return static_cast<std::uint32_t>(fragments_.size() + proxies_.size());
    }
    std::uint32_t lower_mover(const ContactRow& row) const;
    bool is_held(std::uint32_t mover) const;
    meshless::Momenta momenta_of(std::uint32_t mover) const;
    double mass_of(std::uint32_t mover) const;
    Vec3 centre_of(std::uint32_t mover) const;
    Vec3 velocity_of(std::uint32_t mover) const;
    Vec3 angular_velocity_of(std::uint32_t mover) const;
    double energy_of(const Task& task, std::uint32_t mover) const;
    void shift(std::uint32_t mover, const Vec3& by);
    void accelerate(std::uint32_t mover, const Vec3& velocity, const Vec3& angular_velocity);
    void form_groups(const Task& task);
    meshless::Momenta momenta_of(const Group& group) const;
    double energy_of(const Task& task, const Group& group) const;
    void pay_debts(double share);
    void pay_for_lifts(const Task& task);
    double clearance(const meshless::Obstacle& obstacle, const Fragment& fragment) const;
    geometry::SignedDistance::Sample deepest(const meshless::Obstacle& obstacle,
                                             const Fragment& fragment) const;
    void record_depth(const Task& task, Fragment& fragment) const;
    bool push_out_of_obstacles(const Task& task, Fragment& fragment);
    double remaining_gap(const ContactRow& row, Overlaps overlaps) const;
    void list_corrections(Overlaps overlaps);
    bool correct_position(const Task& task, Correction& correction);
    std::vector<RigidImpulses::Mover> list_movers() const;
    void add_impulse(const ContactRow& row);
    double push_fragments();
    Outcome totals() const;

    std::vector<Fragment> fragments_;
    std::vector<std::vector<Near>> near_;  // per range of samples
    std::vector<SphereGrid::Ball> balls_;  // per fragment: where it may meet surfaces, or other fragments
    SphereGrid grid_;
    // m, per body and piece: maximum displacement of the surface in the step; and the maximum of all.
    std::vector<std::vector<double>> max_displacements_;
    double max_surface_displacement_ = 0;
    double spacing_ = 0;  // m, maximum of all bodies
    std::vector<ContactRow> rows_, spare_rows_;
    std::vector<PieceProxy> proxies_;
    std::vector<Support> supports_;
    std::vector<std::uint32_t> group_of_;  // per mover
    std::vector<Group> groups_;
    std::vector<Shifted> shifted_;  // per mover
    std::vector<double> ways_;      // m, per mover: sum of the position corrections
    std::vector<Correction> corrections_;
    double max_correction_ = 0;  // m, how far corrections may move a mover
    std::size_t listed_ = 0;
    // Movers: fragments, then elastic pieces (their velocities are changes), and last an immovable one. A
    // contact for each row.
    RigidImpulses impulses_;
    double dt_ = 0;                                              // s
    std::vector<meshless::Phyxels*> phyxels_;                    // per body
    std::vector<std::span<const Vec3>> positions_, velocities_;  // per body
};

}  // namespace splitcubes::body
