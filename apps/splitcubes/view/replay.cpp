#include "replay.h"

#include "simulation_loop.h"
#include "timeline.h"

#include <algorithm>

namespace splitcubes::view {

namespace {

ReplayResult result_of(SimulationLoop& loop) {
    const State last = loop.publish();
    ReplayResult out{.step = last->step, .time = last->time, .notice = last->notice};
    for (const BodyState& body : last->bodies) out.pieces += body.pieces;
    if (loop.engine() != nullptr) out.state_hash = loop.engine()->state_hash();
    return out;
}

}  // namespace

ReplayResult replay_input(const ReplaySettings& settings,
                          const std::function<void(const ReplayFrame& frame)>& draw) {
    constexpr std::size_t timeline_bytes = std::size_t{256} << 20;
    SimulationLoop loop({.threads = settings.threads});
    if (!settings.file.empty()) loop.open(settings.file);
    Timeline timeline(timeline_bytes);
    Viewer viewer;
    viewer.take({.kind = InputKind::resize, .x = settings.size.width, .y = settings.size.height});
    viewer.show(loop.publish());
    std::size_t next = 0;
    for (int frame = 0; frame < settings.frames; ++frame) {
        for (; next < settings.inputs.size() && settings.inputs[next].frame <= frame; ++next)
            viewer.take(settings.inputs[next]);
        loop.take(viewer.take_commands());
        for (int k = 0; k < settings.steps_per_frame; ++k)
            if (loop.is_playing() || loop.single_steps() > 0) loop.step();
        const State state = loop.publish();
        if (loop.is_open()) timeline.add(state);
        loop.fill_timeline(timeline, [] { return true; });
        const auto scrubbed = viewer.scrubbed();
        const State past = scrubbed ? timeline.at(*scrubbed) : nullptr;
        viewer.show(past ? past : state);
        ReplayFrame drawn{frame, viewer, timeline, {}};
        for (auto act = viewer.take_act(); act.first != WindowAct::none; act = viewer.take_act())
            drawn.acts.push_back(act);
        draw(drawn);
        if (std::any_of(drawn.acts.begin(), drawn.acts.end(),
                        [](const auto& act) { return act.first == WindowAct::quit; }))
            break;
    }
    return result_of(loop);
}

}  // namespace splitcubes::view
