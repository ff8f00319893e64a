// Fonts and colours of the panels.
#pragma once

namespace splitcubes::view {

/// For the current ImGui context; scale: of displays of high resolution.
void set_interface_style(float scale);

}  // namespace splitcubes::view
