// Contacts as impulses on the phyxels, for explicit steps.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/contact/response/contact_forces.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Sequential impulses: contacts are handled one after the other, in their order. Points that have passed
/// each other are separated in proportion to their inverse masses; then their remaining approach velocity is
/// removed, and of the sliding velocity at most friction times that. Momentum is transferred exactly between
/// the sides; energy only decreases, except for removing an initial overlap.
class ContactImpulses {
  public:
    struct Part {
        std::span<const Vec3> start;             // m, positions before the step
        std::span<const double> effective_mass;  // kg
        std::span<const std::uint8_t> fixed;     // per phyxel; 1: motion is prescribed
    };
    void begin(const ContactInput& input, std::span<const Part> parts, double dt);
    /// Separates points that have passed each other by moving positions, and notes which contacts touch.
    /// done: share of the step that is over.
    void separate_points(Field position, double done);
    /// Applies velocity impulses at the contacts that the last separate_points found touching.
    void stop(Field velocity);
    /// Writes the cached contacts (mean force of the step) and marks the phyxels that touched during the
    /// step.
    void finish(std::span<const std::span<std::uint8_t>> touching);
    /// Adds the forces of the attachment springs at the given positions, N.
    void add_handle_springs(ConstField position, Field force);

  private:
    struct ImpulseRow {
        std::uint32_t contact = 0;
        Vec3 start = Vec3::Zero();     // m, upper minus lower point before the step
        double mobility = 0;           // 1/kg
        Vec3 impulse = Vec3::Zero();   // N s, accumulated over the step
        double max_depenetration = 0;  // m, over the whole step; 0 for a contact that is not cached
        bool touches = false;
        bool touched = false;
    };
    void apply_impulse(const ImpulseRow& row, const Vec3& impulse, Field field) const;

    ContactInput input_;
    double dt_ = 0;
    std::vector<Part> parts_;
    std::vector<ImpulseRow> rows_;
    std::vector<CachedContact> next_;
};

}  // namespace splitcubes::meshless
