#include "space_mouse.h"

#include <algorithm>

#ifdef SPLITCUBES_WITH_SPNAV
#include <spnav.h>
#endif

namespace splitcubes::view {

#ifdef SPLITCUBES_WITH_SPNAV

SpaceMouse::SpaceMouse() : is_there_(spnav_open() == 0) {}

SpaceMouse::~SpaceMouse() {
    if (is_there_) spnav_close();
}

// The daemon sends changes: the last deflection counts until the next one.
void SpaceMouse::poll(double x, double y, double seconds, std::vector<ViewerInput>& out) {
    constexpr double full = 350;                         // of an axis
    constexpr double shift_rate = 0.4, turn_rate = 1.5;  // 1/s and rad/s at full deflection
    const double share = std::clamp(seconds, 0.0, 0.1) / full;
    spnav_event event;
    while (is_there_ && spnav_poll_event(&event) != 0) {
        if (event.type == SPNAV_EVENT_MOTION)
            axes_ = {event.motion.x,  event.motion.y,  event.motion.z,
                     event.motion.rx, event.motion.ry, event.motion.rz};
        if (event.type == SPNAV_EVENT_BUTTON)
            out.push_back(
                {.kind = event.button.press != 0 ? InputKind::press : InputKind::release, .x = x, .y = y});
    }
    if (std::all_of(axes_.begin(), axes_.end(), [](int axis) { return axis == 0; })) return;
    ViewerInput motion{.kind = InputKind::six_axis};
    for (std::size_t k = 0; k < 6; ++k)
        motion.axes[k] = (k < 3 ? shift_rate : turn_rate) * share * (k % 3 == 2 ? -1 : 1) * axes_[k];
    out.push_back(motion);
}

#else

SpaceMouse::SpaceMouse() = default;
SpaceMouse::~SpaceMouse() = default;
void SpaceMouse::poll(double, double, double, std::vector<ViewerInput>&) {}

#endif

}  // namespace splitcubes::view
