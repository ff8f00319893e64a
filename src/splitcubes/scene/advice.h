// What a user should know of a world before it is stepped: notes of one line, none where all is well.
#pragma once

#include <splitcubes/body/world.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

using Notes = std::vector<std::pair<std::string, std::string>>;  // what it is about, and the note

/// Bodies of which a part has too few phyxels across to bend rightly.
void note_few_phyxels(const body::World& world, Notes& notes);
/// Bodies whose slowest vibration, slow enough to be seen, the time step damps away.
void note_damping_step(const body::World& world, Notes& notes);
/// Bodies that begin inside each other, where they would push on each other, or inside colliders.
/// prescribed: per body, whether its keyframes alone move it.
void note_overlaps(const body::World& world, std::span<const std::uint8_t> prescribed, Notes& notes);

/// The share of the swing of a vibration (rad/s) that an implicit integrator leaves after a period.
double kept_per_period(double angular_frequency, double time_step, bool bdf2);

}  // namespace splitcubes::scene
