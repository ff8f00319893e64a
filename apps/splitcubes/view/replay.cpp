#include "replay.h"

#include "simulation_loop.h"
#include "timeline.h"
#include "viewer.h"

namespace splitcubes::view {

ReplayResult replay_input(const ReplaySettings& settings,
                          const std::function<void(const Viewer& viewer, const std::string& picture)>& draw) {
    constexpr std::size_t timeline_bytes = std::size_t{256} << 20;
    SimulationLoop loop({.threads = settings.threads});
    loop.open(settings.file);
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
        timeline.add(state);
        const auto scrubbed = viewer.scrubbed();
        const State past = scrubbed ? timeline.at(*scrubbed) : nullptr;
        viewer.show(past ? past : state);
        const auto [act, text] = viewer.take_act();
        draw(viewer, act == WindowAct::save_picture ? text : std::string());
        if (act == WindowAct::quit) break;
    }
    Engine& engine = *loop.engine();
    return {engine.step_count(), engine.time(), engine.pieces(), engine.state_hash(), loop.publish()->notice};
}

}  // namespace splitcubes::view
