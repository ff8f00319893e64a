// Which phyxels stand for a point of the skin.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/meshless/contact.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Changes the weights so that the side's point goes where every affine motion of the body takes
/// `place` (linear reproduction, as in moving least squares: weights times a linear function). The
/// mean of the phyxels lies up to a spacing off the skin: a push there would have another arm than
/// the skin's own motion, and make energy where a body rolls. rest: m, of the body's phyxels; place: m,
/// rest space; spacing: m.
void reproduce_affine_motion(std::span<const Vec3> rest, const Vec3& place, double spacing,
                             meshless::ContactSide& side);

/// A side between several sides, with the memory that finding it takes.
class SideBetween {
  public:
    bool empty() const { return shares_.empty(); }
    /// For how many phyxels there is memory.
    std::size_t room() const { return slots_.size() / 2; }
    /// For at least so many.
    void make_room(std::size_t phyxels);
    /// A side of the body and how much it counts, > 0. All that is added until take is of one body.
    void add(const meshless::ContactSide& side, double weight);
    /// Of the phyxels that the added sides share, the heaviest, so that they carry `place` exactly; no
    /// phyxels where none was added. Forgets what was added. Arguments as of reproduce_affine_motion.
    meshless::ContactSide take(std::span<const Vec3> rest, const Vec3& place, double spacing);

  private:
    struct Share {
        std::uint32_t phyxel, slot;
        double weight;
    };
    struct Slot {
        std::uint32_t phyxel = 0, number = 0;  // of its share, from 1; 0: none
    };
    std::size_t slot_of(std::uint32_t phyxel) const;

    std::vector<Share> shares_;  // in the order of adding
    // By the phyxels' indices, open addressing: few lines of memory, however many phyxels there are.
    std::vector<Slot> slots_;
    std::uint32_t part_ = 0;
};

}  // namespace splitcubes::body
