// Graphs of the last steps.
#pragma once

#include <splitcubes/view/step_history.h>

namespace splitcubes::view {

/// Milliseconds by stage, stacked, a column a step; a line at the time step's length.
void draw_stage_graph(const StepHistory& history, double step_length_ms, float width, float height);
/// Median, 99th percentile and worst of the stages that take time.
void draw_stage_table(const StepHistory& history);
/// Kinetic and elastic energy.
void draw_energy_graph(const StepHistory& history, float width, float height);
void draw_force_graph(const StepHistory& history, float width, float height);

}  // namespace splitcubes::view
