// Rigid pieces against the skin of elastic ones, against each other, and between those and
// colliders.
#pragma once

#include <splitcubes/body/body.h>
#include <splitcubes/body/contact_finder.h>
#include <splitcubes/body/sphere_grid.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace splitcubes::body {

/// Contacts of rigid pieces with what is no collider. They are found where things are at the
/// start of a step, and act when everything has moved: what has passed by in the step is put back, and what
/// is left of the approach is taken by impulses with Coulomb friction, inelastic, found by projected
/// Gauss-Seidel on the velocities (Erleben 2007). A rigid piece is its contact points
/// towards skin, and the box around them in its own frame towards other rigid pieces. An
/// overlap at the start of the step stays but for a slow lift. Elastic pieces take the impulses as a
/// whole, by their rigid motion: rigid pieces are light, and do not dent them. So both momenta go from
/// one side to the other exactly, and kinetic energy is only taken, but for what moving colliders and skin
/// that moves by itself give. What is held takes no impulse. No state of its own between steps. The pushes
/// run on one thread.
class RigidContacts {
  public:
    struct Task {
        std::span<const std::unique_ptr<Body>> bodies;
        std::span<const meshless::Obstacle> obstacles;
        double friction = 0;  // Coulomb coefficient
        double dt = 0;        // s
        Vec3 gravity = Vec3::Zero();
    };
    struct Outcome {
        double kinetic_energy = 0;  // J, change of it
        std::size_t contacts = 0;   // that pushed
    };
    /// Before the step of all bodies; skin: of the same bodies, as they are.
    void find(const Task& task, const ContactFinder& skin, const Parallel& parallel);
    /// After it, before the node frames are taken.
    Outcome push(const Task& task);

  private:
    /// A sample of skin that lies near a crumb.
    struct Near {
        std::uint32_t sample, fragment;
    };
    /// Of the samples near a crumb: planes, and of what they are; m^2, distances' squares from a point.
    struct Planes {
        struct Plane {
            Vec3 position, normal;
            std::uint32_t body;
            std::int32_t piece;
        };
        std::vector<Plane> all;
        std::vector<double> square;
    };
    using Plane = Planes::Plane;
    struct Row {
        std::uint32_t upper = 0;               // crumb
        std::int32_t lower = -1;               // crumb, -1: skin or an obstacle
        std::int32_t whole = -1;               // among the elastic pieces: that which has the skin
        meshless::ContactSide side;            // skin; its part is the body's number
        Vec3 own = Vec3::Zero();               // m, upper's point in its own frame
        Vec3 lower_own = Vec3::Zero();         // m, of a lower crumb in its frame; off the skin's sample
        Vec3 carried = Vec3::Zero();           // m, where lower_own has gone in the step
        Vec3 normal = Vec3::UnitZ();           // from lower to upper
        Vec3 start = Vec3::Zero();             // m, upper less lower at the start of the step
        double gap = 0;                        // m, at the start of the step
        double max_depenetration = 0;          // m
        double friction = 0;                   // Coulomb coefficient
        Vec3 surface_velocity = Vec3::Zero();  // m/s, of an obstacle
        double min_normal_velocity = 0;        // m/s, normal velocity that it may have at least
        Vec3 point = Vec3::Zero();             // m, world, where both sides are pushed
    };
    struct Fragment {
        std::uint32_t body = 0, index = 0;  // index into RigidPieces::bodies
        double radius = 0;                  // m, of its points about the centre
        double way = 0;                     // m, that a point of it goes in the step at most
        Vec3 low = Vec3::Zero();            // m, own frame, box of its points
        Vec3 high = Vec3::Zero();           // m
        bool held = false;                  // by a constraint
        bool pushed = false;                // by something else than a collider
        std::vector<std::uint32_t> near;    // samples of skin, ascending
        std::vector<Row> rows;              // that it is the upper side of, against skin
        std::vector<double> depth;          // m, <= 0, in each obstacle, after the step
    };
    /// A row as the rounds need it: of the upper mover, and of the lower one against it.
    struct Push {
        std::uint32_t upper = 0, lower = 0;                 // movers
        Vec3 normal = Vec3::UnitZ();                        // from lower to upper
        Vec3 arm = Vec3::Zero(), lower_arm = Vec3::Zero();  // m, of the place, from their centres
        // Of a push of 1 along the normal: m, its torque on each; 1/(kg m), the turning that comes of it.
        Vec3 torque = Vec3::Zero(), lower_torque = Vec3::Zero();
        Vec3 turn = Vec3::Zero(), lower_turn = Vec3::Zero();
        Vec3 skin_velocity = Vec3::Zero();     // m/s, before the pushes
        Vec3 surface_velocity = Vec3::Zero();  // m/s, of an obstacle
        double min_normal_velocity = 0;        // m/s, normal velocity that it may have at least
        double friction = 0;                   // Coulomb coefficient
        double effective_normal_mass = 0;      // kg
        double tangential_mass = 0;            // kg
        double normal_impulse = 0;             // N s
        Vec3 friction_impulse = Vec3::Zero();  // N s

        Vec3 impulse() const { return normal_impulse * normal + friction_impulse; }  // on the upper
    };
    /// An elastic piece, as the pushes move it.
    struct PieceProxy {
        std::uint32_t body = 0;
        std::int32_t piece = -1;
        bool held = false;
        double mass = 0;                            // kg
        Vec3 centre = Vec3::Zero();                 // m
        Vec3 momentum = Vec3::Zero();               // kg m/s, before the pushes
        Vec3 angular_momentum = Vec3::Zero();       // kg m^2/s, about the centre, before the pushes
        Mat3 inertia = Mat3::Zero();                // kg m^2, about the centre
        Mat3 inverse_inertia = Mat3::Zero();        // 1/(kg m^2), its inverse
        Vec3 end_angular_velocity = Vec3::Zero();   // rad/s, after the step
        Vec3 shift = Vec3::Zero();                  // m, of places
        Vec3 angular_momentum_debt = Vec3::Zero();  // kg m^2/s, spin that putting apart has changed
        Vec3 velocity = Vec3::Zero();               // m/s, change of it
        Vec3 angular_velocity = Vec3::Zero();       // rad/s, change of it
    };

    /// What takes pushes: crumbs, then elastic pieces, of whose velocities it is what the pushes change; last
    /// what takes none.
    struct Mover {
        double mobility = 0;                   // 1/kg; 0: held
        Mat3 inverse_inertia = Mat3::Zero();   // 1/(kg m^2), world
        Vec3 velocity = Vec3::Zero();          // m/s, of the centre
        Vec3 angular_velocity = Vec3::Zero();  // rad/s

        Vec3 velocity_at(const Vec3& arm) const { return velocity + angular_velocity.cross(arm); }
        void push(const Vec3& arm, const Vec3& impulse) {
            velocity += mobility * impulse;
            angular_velocity += inverse_inertia * arm.cross(impulse);
        }
    };

    /// A face of a box in its own frame.
    struct Face {
        int axis = 2, sign = 1;
        double gap = -std::numeric_limits<double>::infinity();  // m
    };

    void list_fragments(const Task& task);
    void measure_skin(const Task& task);
    double way_of(std::uint32_t body, std::int32_t piece) const;
    void list_samples(const ContactFinder& skin, const Parallel& parallel);
    void sort_fragments();
    template <class Visit>
    void visit_near(const Vec3& point, const Visit& visit) const;
    void meet_skin(const Task& task, const ContactFinder& skin, std::uint32_t fragment);
    static std::size_t partner_of(const Vec3& point, const Vec3& outwards, Planes& planes);
    bool lies_before(const Task& task, const Vec3& point, std::size_t partner, const Planes& planes,
                     Row& row) const;
    static void stand_on(const Body& body, const ContactFinder::SurfaceSample& partner, const Vec3& point,
                         Row& row);
    Face face_between(const Fragment& upper, const Fragment& lower) const;
    void meet_fragment(const Task& task, std::uint32_t first, std::uint32_t second);
    void meet_obstacles(const Task& task, std::uint32_t fragment);
    meshless::RigidPiece& piece_of(const Fragment& fragment) const;
    double linear_mobility(const Row& row) const;
    void carry_rows();
    Vec3 lower_place(const Row& row) const;
    std::int32_t proxy_of(std::uint32_t body, std::int32_t piece);
    void weigh_proxies(const Task& task);
    void move_proxies();
    void correct_positions(const Task& task);
    geometry::SignedDistance::Sample deepest(const meshless::Obstacle& obstacle,
                                             const Fragment& fragment) const;
    void note_depth(const Task& task, Fragment& fragment) const;
    bool push_out_of_obstacles(const Task& task, Fragment& fragment);
    double room(const Row& row) const;
    bool correct_position(const Task& task, const Row& row);
    void list_movers();
    void weigh(Row& row);
    Vec3 velocity_of(const Push& push) const;
    void apply_friction(Push& push, double& largest);
    double solve(Push& push);
    void solve_all(double fastest);
    void push_fragments();
    double kinetic_energy() const;

    std::vector<Fragment> fragments_;
    std::vector<std::vector<Near>> near_;  // per part of the samples
    std::vector<SphereGrid::Ball> balls_;  // per crumb: where skin may be that it meets
    SphereGrid grid_;
    std::vector<std::pair<std::array<int, 3>, std::uint32_t>> sorted_;  // crumbs by cell of the centre
    double cell_ = 0;                                                   // m
    // Per body and piece: m, that skin goes in the step at most; and the most of all.
    std::vector<std::vector<double>> skin_way_;
    double most_skin_way_ = 0;
    double spacing_ = 0;  // m, the largest
    std::vector<Row> rows_;
    std::vector<PieceProxy> proxies_;
    std::vector<Mover> movers_;
    std::vector<Push> pushes_;                                   // per row
    double dt_ = 0;                                              // s
    std::vector<meshless::Phyxels*> phyxels_;                    // per body
    std::vector<std::span<const Vec3>> positions_, velocities_;  // per body
};

}  // namespace splitcubes::body
