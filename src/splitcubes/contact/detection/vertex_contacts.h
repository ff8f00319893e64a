// Contacts of colliders with vertices between the contact samples.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider.h>
#include <splitcubes/contact/response/contact.h>
#include <splitcubes/core/parallel.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

struct ColliderPoses;
struct SurfacePoint;

/// Samples lie at the centres of cells, about two per phyxel spacing. Rims of cut faces, corners of small
/// pieces and strained faces reach beyond them. So the vertex nearest to a collider in each box of a spacing
/// touches it, too, if it is nearer than all samples around it, by more than a tolerance.
/// Contacts between pieces do without such vertices: the other face yields to the nearest sample.
///
/// Phyxels lie inside the surface. Those of very soft material can pass through it and into a collider, which
/// no vertex shows. So the phyxels of elastic pieces touch colliders, too.
///
/// Only influences of vertices are kept between steps; they do not affect what is found.
class VertexContacts {
  public:
    struct Task {
        std::span<const BodyView> bodies;
        double dt = 0;  // s
        Vec3 gravity = Vec3::Zero();
        std::span<const double> max_displacement;  // m, per body, of a surface point in the step
    };
    /// Forgets the contacts.
    void begin(std::span<const BodyView> bodies);
    /// Adds the contacts with a collider. index: of the collider, for the keys.
    void meet(const Task& task, const Collider& collider, std::size_t index, const ColliderPoses& poses,
              const Parallel& parallel);
    /// Returns the contacts; `part` of their upper sides is the index of the body.
    std::span<const meshless::Contact> contacts() const { return contacts_; }

  private:
    /// Phyxels that move a vertex; valid while nothing that they follow from changes.
    struct Influence {
        std::uint32_t node = 0;
        std::int32_t piece = -1;
        std::uint64_t row = 0;       // NodeTracker::row_revision
        Vec3 rest = Vec3::Zero();    // m, rest space
        meshless::ContactSide side;  // no phyxels: not known yet
    };
    struct BodyCache {
        std::uint64_t revision = ~std::uint64_t{0};  // of the samples
        std::vector<std::uint8_t> sample;            // per vertex: 1 sample, 2 active sample
        std::vector<std::uint32_t> slot;             // per vertex: 1 + index of its influence; 0: none
        std::vector<Influence> influences;
    };
    /// Vertex near a collider.
    struct Near {
        std::uint64_t box;
        std::int32_t piece;
        std::uint32_t vertex;
        double distance;  // m
        bool is_sample;   // that touches the collider by itself
    };
    void list_near(const BodyView& body, const BodyCache& cache, const Collider& collider,
                   const ColliderPoses& poses, double max_displacement, const Parallel& parallel);
    const Influence& influence_of(const BodyView& body, std::uint32_t index, std::uint32_t vertex,
                                  std::int32_t piece);
    void meet_phyxels(const Task& task, std::uint32_t body_index, const Collider& collider, std::size_t index,
                      const ColliderPoses& poses);
    const Near* sample_near(const Near& vertex, double tolerance) const;
    SurfacePoint point_of(const Task& task, std::uint32_t body_index, const Near& near);
    void add_contact(const Task& task, std::uint32_t body_index, const Near& near, const SurfacePoint& point,
                     const Collider& collider, std::size_t index, const ColliderPoses& poses);

    std::vector<BodyCache> caches_;         // per body
    std::vector<std::vector<Near>> found_;  // per range of vertices
    std::vector<Near> near_;                // of a body, by piece and box
    std::vector<meshless::Contact> contacts_;
};

}  // namespace splitcubes::body
