// A small world that has every kind of state that a checkpoint stores.
#pragma once

#include <splitcubes/world/world.h>

#include <memory>

namespace splitcubes::body::busy {

/// small: the smallest number of nodes that still exercises everything.
enum class Size { usual, small };

std::unique_ptr<World> make(meshless::SolverKind solver, Size size = Size::usual, int thread_count = 1);

}  // namespace splitcubes::body::busy
