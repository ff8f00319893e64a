// Tools in other units.
#pragma once

#include <splitcubes/scene/description.h>

namespace splitcubes::scene {

/// The tool with all its lengths times `factor`, above zero: blades, motion and sides. Times and angles
/// stay. It sweeps what the tool sweeps, as much larger about the origin.
ToolDescription scaled(ToolDescription tool, double factor);

}  // namespace splitcubes::scene
