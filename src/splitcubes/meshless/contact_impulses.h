// Contacts as impulses on the phyxels, for explicit steps.
#pragma once

#include <splitcubes/meshless/contact.h>
#include <splitcubes/meshless/contact_forces.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// One contact after the other, in their order: points that have passed each other are
/// put apart by inverse mass, then what is left of their approach is taken, and of the
/// sliding at most friction times that. Momentum goes from one side to the other
/// exactly; energy is only taken, but for the lift of an overlap.
class ContactImpulses {
  public:
    struct Part {
        std::span<const Vec3> start;             // m, positions before the step
        std::span<const double> effective_mass;  // kg
        std::span<const std::uint8_t> fixed;     // per phyxel: 1: its motion is prescribed
    };
    void begin(const ContactInput& input, std::span<const Part> parts, double dt);
    /// done: share of the step that is over. Moves positions; notes who touches.
    void separate_points(Field position, double done);
    /// Changes the velocities of those that the last separate_points found touching.
    void stop(Field velocity);
    /// Writes the memory (mean force of the step); marks phyxels that touch or have touched.
    void finish(std::span<const std::span<std::uint8_t>> touching);
    /// Adds the pulls' forces at these places, N.
    void add_handle_springs(ConstField position, Field force);

  private:
    struct Row {
        std::uint32_t contact = 0;
        Vec3 start = Vec3::Zero();     // m, upper less lower before the step
        double mobility = 0;           // 1/kg
        Vec3 impulse = Vec3::Zero();   // N s, of the step so far
        double max_depenetration = 0;  // m, of the whole step; none where nothing pressed before
        bool touches = false;
        bool touched = false;
    };
    void push(const Row& row, const Vec3& impulse, Field field) const;

    ContactInput input_;
    double dt_ = 0;
    std::vector<Part> parts_;
    std::vector<Row> rows_;
    std::vector<CachedContact> next_;
};

}  // namespace splitcubes::meshless
