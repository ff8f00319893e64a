// Tools in other units of length.
#pragma once

#include <splitcubes/scene/description.h>

namespace splitcubes::scene {

/// Returns the tool with all lengths (blades, motion, sides) times `factor` > 0; times and angles are
/// unchanged. The swept surface is scaled about the origin.
ToolDescription scaled(ToolDescription tool, double factor);

}  // namespace splitcubes::scene
