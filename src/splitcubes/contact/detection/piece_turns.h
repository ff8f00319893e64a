// Rotation of pieces that touch nothing but each other.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/phyxels.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

struct ContactIsland;

/// The frames in which contacts between pieces are measured (Contact::turn_displacement). The two points of a
/// contact are means of phyxels, and lie apart where these are few: pieces that rotate together change the
/// vector between them, although they do not slide on each other.
///
/// Pieces that touch nothing but each other have their angular momentum restored together after a step, so
/// they are measured in the frame that rotates with all of them: what the forces at points that lie apart do
/// to the rotation, and so its work in that frame, is undone. Pieces that anything else touches, holds or
/// pulls are measured at rest, where forces do the work that the motion of their points shows, and no more.
///
/// This object holds buffers only.
class PieceTurns {
  public:
    /// Sets the turn_displacement of contacts. dt: s.
    void turn(std::span<const BodyView> bodies, double dt, const Parallel& parallel,
              std::span<ContactIsland> islands);

  private:
    /// Piece of a set that is free.
    struct Free {
        std::uint32_t root, slot;
        meshless::Momenta momenta;
    };
    std::uint32_t slot(std::uint32_t part, std::int32_t piece) const;
    std::uint32_t slot(std::span<const BodyView> bodies, const ContactIsland& island,
                       const meshless::ContactSide& side) const;
    void group(std::span<const BodyView> bodies, const ContactIsland& island);
    void measure(std::span<const BodyView> bodies, const ContactIsland& island, double dt,
                 const Parallel& parallel);

    std::vector<std::uint32_t> first_;             // per body of an island: slot of its first piece
    DisjointSets sets_;                            // of slots
    std::vector<std::span<const Vec3>> position_;  // m, per body of an island and phyxel
    std::vector<std::uint8_t> is_bound_;           // per slot, of its set at the root
    std::vector<Vec3> angle_;                      // rad, times the unit axis; per slot, at the root
    std::vector<meshless::Momenta> momenta_, sums_, group_;  // of pieces; buffer; of a set's pieces
    std::vector<Free> free_;
};

}  // namespace splitcubes::body
