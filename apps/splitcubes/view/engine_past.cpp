// States that an engine keeps to go back to.
#include "engine.h"
#include "scene_driver.h"
#include "thinning.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes::view {

/// All that a look at the past changes.
struct Engine::Present {
    KeptState state;
    std::unique_ptr<SceneDriver> driver;
    Strokes strokes;
    Pulls pulls;
    StrokeLog log;
    SessionCurve curve;
    std::vector<ForceState> scene_forces;
    std::map<std::size_t, double> changed;
    std::vector<BodyRecord> records;
    StepStatistics statistics;
    std::int64_t step;
    std::vector<RecordedCommand> recorded;
    std::deque<RecordedCommand> script;
    std::string notice;
    std::uint64_t notices;

    explicit Present(const Engine& e)
        : state(e.simulation_->keep()),
          driver(e.driver_ ? std::make_unique<SceneDriver>(*e.driver_) : nullptr),
          strokes(e.strokes_),
          pulls(e.pulls_),
          log(e.log_),
          curve(e.curve_),
          scene_forces(e.scene_forces_),
          changed(e.changed_),
          records(e.records_),
          statistics(e.statistics_),
          step(e.step_),
          recorded(e.recorded_),
          script(e.script_),
          notice(e.notice_),
          notices(e.notices_) {}
    void come_back(Engine& e) {
        e.simulation_->restore(state);
        e.driver_ = std::move(driver);
        e.strokes_ = std::move(strokes);
        e.pulls_ = std::move(pulls);
        e.log_ = std::move(log);
        e.curve_ = std::move(curve);
        e.scene_forces_ = std::move(scene_forces);
        e.changed_ = std::move(changed);
        e.records_ = std::move(records);
        e.statistics_ = statistics;
        e.step_ = step;
        e.recorded_ = std::move(recorded);
        e.script_ = std::move(script);
        e.notice_ = std::move(notice);
        e.notices_ = notices;
    }
};

// A travel in time is a state of its own step: clocks of states count it as a step.
void Engine::keep_state(bool at_once) {
    if (past_.is_shown) return;
    const auto every =
        std::max<std::int64_t>(1, std::llround(settings_.keep_every / simulation_->time_step()));
    if (!at_once && !past_.kept.empty() && step_ < past_.kept.back().step + every) return;
    if (at_once) ++past_.travels;
    if (at_once || statistics_.new_cut_edges > 0) note_births();
    past_.kept.push_back({step_,
                          simulation_->keep(),
                          pulls_,
                          driver_ ? std::make_shared<const SceneDriver>(*driver_) : nullptr,
                          recorded_.size(),
                          step_ + past_.travels,
                          {}});
    for (const BodyRecord& record : records_) past_.kept.back().edge_times.push_back(record.edge_times);
    std::uint64_t bytes = 0;
    for (const Kept& kept : past_.kept) bytes += kept.state.bytes();
    while (past_.kept.size() > 2 && bytes > settings_.timeline_bytes) {
        const std::size_t k = least_missed(past_.kept, [](const Kept& kept) { return kept.number; });
        bytes -= past_.kept[k].state.bytes();
        past_.kept.erase(past_.kept.begin() + static_cast<std::ptrdiff_t>(k));
    }
}

void Engine::note_births() {
    for (std::size_t b = 0; b < bodies_.size(); ++b) body_state(b);
}

std::vector<std::int64_t> Engine::kept_steps() const {
    std::vector<std::int64_t> out;
    for (const Kept& kept : past_.kept) out.push_back(kept.step);
    return out;
}

void Engine::become(const Kept& kept) {
    simulation_->restore(kept.state);
    driver_ = kept.driver ? std::make_unique<SceneDriver>(*kept.driver) : nullptr;
    strokes_.clear();
    pulls_ = kept.pulls;
    step_ = kept.step;
    for (std::size_t b = 0; b < std::min(records_.size(), kept.edge_times.size()); ++b)
        records_[b].edge_times = kept.edge_times[b];
    script_.clear();
}

// Undo needs a history that is not there any more, so it is where a repetition stops. Returns whether it came
// to the step.
bool Engine::repeat(const std::vector<RecordedCommand>& commands, std::int64_t step,
                    const std::function<bool()>& is_wanted) {
    std::size_t next = 0;
    while (step_ < step) {
        for (; next < commands.size() && commands[next].step == step_; ++next) {
            const CommandKind kind = commands[next].command.kind;
            if (kind == CommandKind::undo || kind == CommandKind::redo) return false;
            apply(commands[next].command);
        }
        if (!is_wanted()) return false;
        this->step();
        // Each cut has its own time, though nobody sees it now.
        if (statistics_.new_cut_edges > 0) note_births();
    }
    return true;
}

void Engine::resume_at(std::int64_t step) {
    while (past_.kept.size() > 1 && past_.kept.back().step > step) past_.kept.pop_back();
    const Kept from = past_.kept.back();
    become(from);
    simulation_->forget_history();
    past_.undone.clear();
    log_.go_back(simulation_->time());
    log_.forget_undone();
    played_ = {};
    const std::vector<RecordedCommand> again(recorded_.begin() + static_cast<std::ptrdiff_t>(from.commands),
                                             recorded_.end());
    recorded_.resize(from.commands);
    if (!repeat(again, step, [] { return true; })) notify("goes on from before the undo");
    apply({.kind = CommandKind::drop});
}

std::shared_ptr<PublishedState> Engine::look_back(std::int64_t step, const std::function<bool()>& is_wanted) {
    if (step >= step_ || past_.kept.empty() || step < past_.kept.front().step) return nullptr;
    auto from = past_.kept.end() - 1;
    while (from->step > step) --from;
    Present present(*this);
    std::shared_ptr<PublishedState> out;
    past_.is_shown = true;
    try {
        become(*from);
        const std::vector<RecordedCommand> again(
            recorded_.begin() + static_cast<std::ptrdiff_t>(from->commands), recorded_.end());
        if (repeat(again, step, is_wanted)) out = publish();
    } catch (const std::exception&) {
        out = nullptr;
    }
    past_.is_shown = false;
    present.come_back(*this);
    return out;
}

}  // namespace splitcubes::view
