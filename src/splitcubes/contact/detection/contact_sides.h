// Phyxels and weights that represent a point of the surface.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Changes the weights so that the side's point follows every affine motion of the body like the material
/// point `rest_point` (linear reproduction, as in moving least squares: weights times a linear function). The
/// weighted mean of the phyxels lies up to a spacing off the surface: a force there would have another lever
/// arm than the motion of the surface, and create energy in a rolling body. rest: m, rest positions of the
/// body's phyxels; rest_point: m, rest space; spacing: m.
void reproduce_affine_motion(std::span<const Vec3> rest, const Vec3& rest_point, double spacing,
                             meshless::ContactSide& side);

/// Weighted blend of contact sides, with its work memory.
class SideBlend {
  public:
    bool empty() const { return shares_.empty(); }
    /// Number of phyxels that fit without allocation.
    std::size_t capacity() const { return slots_.size() / 2; }
    /// Allocates memory for at least this many phyxels.
    void reserve(std::size_t phyxel_count);
    /// Adds a side with its weight, > 0. All sides until the next take must be of one body.
    void add(const meshless::ContactSide& side, double weight);
    /// Returns the blend, reduced to the phyxels with the largest weights and corrected to reproduce
    /// `rest_point` exactly; without phyxels if nothing was added. Clears the blend. Arguments as in
    /// reproduce_affine_motion.
    meshless::ContactSide take(std::span<const Vec3> rest, const Vec3& rest_point, double spacing);

  private:
    struct Share {
        std::uint32_t phyxel, slot;
        double weight;
    };
    struct Slot {
        std::uint32_t phyxel = 0, share = 0;  // 1 + index of its share; 0: empty
    };
    std::size_t slot_of(std::uint32_t phyxel) const;

    std::vector<Share> shares_;  // in the order of adding
    // Hash table by phyxel, open addressing: its size depends on the blend, not on the body.
    std::vector<Slot> slots_;
    std::uint32_t part_ = 0;
};

}  // namespace splitcubes::body
