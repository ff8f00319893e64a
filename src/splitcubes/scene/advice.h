// Notes for the user about a world before its first step, one line each; empty if nothing needs attention.
#pragma once

#include <splitcubes/world/world.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

using Notes =
    std::vector<std::pair<std::string, std::string>>;  // subject (name of a body or the scene) and note

/// Notes bodies of which a part has too few phyxels across to bend accurately.
void note_few_phyxels(const body::World& world, Notes& notes);
/// Notes bodies whose slowest vibration is slow enough to be visible but is damped away by the time step.
void note_damping_step(const body::World& world, Notes& notes);
/// Notes bodies that overlap at the start, if contact between them is enabled, and bodies inside colliders.
/// prescribed: 1 per body that is moved by its keyframes only.
void note_overlaps(const body::World& world, std::span<const std::uint8_t> prescribed, Notes& notes);

/// Returns the share of a vibration's amplitude (angular frequency in rad/s) that an implicit integrator
/// keeps per period.
double kept_per_period(double angular_frequency, double time_step, meshless::TimeScheme scheme);

}  // namespace splitcubes::scene
