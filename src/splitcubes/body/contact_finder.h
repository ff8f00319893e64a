// Which points of the bodies' skins may push on what within a step.
#pragma once

#include <splitcubes/body/body.h>
#include <splitcubes/body/collider.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Bodies that step on their own, or together since they may push on each other.
struct ContactGroup {
    std::vector<std::size_t> bodies;          // ascending; part k of the contacts is bodies[k]
    std::vector<meshless::Contact> contacts;  // sorted by key
};

/// The skin is sampled by vertices of the surface, about two a phyxel spacing. Each moves as
/// the four phyxels do that carry most of it.
///
/// Colliders: the way that a sample will go by its velocity and gravity is followed in the
/// collider's own, moving frame up to where it meets the solid, so that nothing is jumped over;
/// a contact is the tangent plane there.
///
/// Pieces and bodies: of the samples of another piece around a sample, with normals that face
/// it, the signed distance to the plane through each, averaged by nearness (implicit moving
/// least squares, Kolluri 2005). Within one piece only what a cut parts at rest can meet:
/// the segment between points just below the two samples crosses a surface.
///
/// Rigid pieces meet colliders on their own (meshless::step_rigid) and nothing else; bodies that a
/// deformation carries meet the ground only.
class ContactFinder {
  public:
    struct Task {
        std::span<const std::unique_ptr<Body>> bodies;
        std::span<const Collider> colliders;
        ContactOptions options;
        double time = 0;  // s, at the start of the step
        double dt = 0;    // s
        Vec3 gravity = Vec3::Zero();
    };
    /// One group for every body that has a part in none else; in order of their first bodies.
    std::vector<ContactGroup> find(const Task& task, const Parallel& parallel);

  private:
    struct Sample {
        std::uint32_t body = 0;
        std::uint32_t vertex = 0;
        std::int32_t piece = 0;
        Vec3 rest = Vec3::Zero();         // m, rest space
        Vec3 rest_normal = Vec3::Zero();  // unit, outward
        Vec3 position = Vec3::Zero();     // m, world
        Vec3 normal = Vec3::Zero();       // unit, outward, world
        double spacing = 0;               // m, of the body's phyxels
        meshless::ContactSide side;       // its carriers, once found
    };
    struct Meeting;
    void list_samples(const Task& task);
    static void find_carriers(const Task& task, Sample& sample);
    void meet_colliders(const Task& task, const Parallel& parallel);
    void meet_pieces(const Task& task, const Parallel& parallel);
    bool may_meet(const Task& task, const Sample& a, const Sample& b) const;
    bool meet(const Task& task, const Sample& sample, std::span<const std::uint32_t> near, double reach,
              meshless::Contact& out) const;
    std::vector<ContactGroup> grouped(const Task& task);

    std::vector<Sample> samples_;
    std::vector<meshless::Contact> contacts_;  // part: number of the body
};

}  // namespace splitcubes::body
