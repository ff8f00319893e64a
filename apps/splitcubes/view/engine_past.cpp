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
    if (at_once) ++past_.count;
    if (at_once || statistics_.new_cut_edges > 0) note_births();
    past_.kept.push_back({step_, simulation_->keep(), pulls_,
                          driver_ ? std::make_shared<const SceneDriver>(*driver_) : nullptr, recorded_.size(),
                          step_ + past_.count, edge_times()});
    std::uint64_t bytes = 0;
    for (const Kept& kept : past_.kept) bytes += kept.state.bytes();
    while (past_.kept.size() > 2 && bytes > settings_.timeline_bytes) {
        const std::size_t k = least_missed(past_.kept, [](const Kept& kept) { return kept.number; });
        bytes -= past_.kept[k].state.bytes();
        past_.kept.erase(past_.kept.begin() + static_cast<std::ptrdiff_t>(k));
    }
}

std::vector<Engine::EdgeTimes> Engine::edge_times() const {
    std::vector<EdgeTimes> out;
    for (const BodyRecord& record : records_) out.push_back(record.edge_times);
    return out;
}

void Engine::set_edge_times(const std::vector<EdgeTimes>& times) {
    for (std::size_t b = 0; b < std::min(records_.size(), times.size()); ++b)
        records_[b].edge_times = times[b];
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
    set_edge_times(kept.edge_times);
    script_.clear();
}

// Commands that the state after so many steps contains. Those of its own step come after it, but for undo
// and redo, which lead from one state to another.
std::size_t Engine::commands_until(std::int64_t step) const {
    const auto end = std::partition_point(recorded_.begin(), recorded_.end(),
                                          [&](const RecordedCommand& one) { return one.step < step; });
    auto out = static_cast<std::size_t>(end - recorded_.begin());
    for (const Travel& travel : past_.travels)
        if (travel.command >= out && recorded_[travel.command].step == step) out = travel.command + 1;
    return out;
}

// From the end: back to the last kept state or, where an undo or redo came after that, to the state to which
// it led, which is one of before. Empty: there is no way.
std::vector<Engine::Leg> Engine::way_to(std::int64_t step) const {
    std::vector<Leg> out;
    for (Mark to{commands_until(step), step};;) {
        const auto travel = std::find_if(past_.travels.rbegin(), past_.travels.rend(),
                                         [&](const Travel& one) { return one.command < to.command; });
        const bool travelled = travel != past_.travels.rend();
        const auto kept = std::find_if(past_.kept.rbegin(), past_.kept.rend(), [&](const Kept& one) {
            return one.step <= to.step && one.commands <= to.command;
        });
        if (kept != past_.kept.rend() && (!travelled || kept->commands > travel->command)) {
            out.insert(out.begin(), {&*kept, nullptr, kept->commands, to.command, to.step});
            return out;
        }
        if (!travelled) return {};
        out.insert(out.begin(), {nullptr, &*travel, travel->command + 1, to.command, to.step});
        to = travel->to;
    }
}

// Leads on from the state to which the travel led, as it did.
void Engine::repeat_travel(const Travel& travel) {
    log_.go_back(simulation_->time());
    strokes_.clear();
    if (travel.is_undo && driver_) driver_->go_back(*simulation_);
    pulls_.become(travel.pulls);
    remove_unowned();
    step_ = recorded_[travel.command].step;
    note_births();
}

// Returns whether it came to the end.
bool Engine::go(const std::vector<Leg>& way, const std::function<bool()>& is_wanted) {
    for (const Leg& leg : way) {
        if (leg.kept != nullptr) {
            become(*leg.kept);
            log_.go_back(simulation_->time());
            log_.forget_undone();
        } else {
            repeat_travel(*leg.travel);
        }
        std::size_t next = leg.command;
        const auto carry_out_those_of_now = [&] {
            for (; next < leg.commands && recorded_[next].step == step_; ++next)
                apply(recorded_[next].command);
        };
        while (step_ < leg.step) {
            carry_out_those_of_now();
            if (!is_wanted()) return false;
            this->step();
            // Each cut has its own time, though nobody sees it now.
            if (statistics_.new_cut_edges > 0) note_births();
        }
        carry_out_those_of_now();
    }
    return true;
}

// What is recorded until then stays, so that the recording comes to this state as well.
void Engine::resume_at(std::int64_t step) {
    const std::vector<Leg> way = way_to(step);
    if (way.empty()) return notify("that step cannot be made again");
    const std::size_t commands = commands_until(step);
    past_.is_shown = true;
    try {
        go(way, [] { return true; });
    } catch (const std::exception& error) {
        notify(std::string(error.what()) + "; the scene starts again");
        return start();
    }
    past_.is_shown = false;
    recorded_.resize(commands);
    while (past_.kept.size() > 1 &&
           (past_.kept.back().step > step || past_.kept.back().commands > recorded_.size()))
        past_.kept.pop_back();
    std::erase_if(past_.travels, [&](const Travel& one) { return one.command >= recorded_.size(); });
    past_.marks.clear();
    past_.undone.clear();
    simulation_->forget_history();
    log_.forget_undone();
    played_ = {};
    apply({.kind = CommandKind::drop});
}

// To be called before the travel is recorded.
void Engine::note_travel(bool back, std::shared_ptr<const SceneDriver> left) {
    const Mark here{recorded_.size(), step_};
    Mark to{};
    if (back) {
        to = past_.marks.back();
        past_.marks.pop_back();
        past_.undone.push_back({std::move(left), here, to, edge_times()});
        if (driver_) driver_->go_back(*simulation_);
    } else {
        const Undone undone = past_.undone.back();
        past_.undone.pop_back();
        past_.marks.push_back(undone.mark);
        to = undone.undo;
        set_edge_times(undone.edge_times);
        if (undone.driver) driver_ = std::make_unique<SceneDriver>(*undone.driver);
    }
    forget_gestures();
    past_.travels.push_back({here.command, to, back, pulls_});
}

std::shared_ptr<PublishedState> Engine::look_back(std::int64_t step, const std::function<bool()>& is_wanted) {
    if (step >= step_ || step < 0) return nullptr;
    const std::vector<Leg> way = way_to(step);
    if (way.empty()) return nullptr;
    Present present(*this);
    std::shared_ptr<PublishedState> out;
    past_.is_shown = true;
    try {
        if (go(way, is_wanted)) out = publish();
    } catch (const std::exception&) {
        out = nullptr;
    }
    past_.is_shown = false;
    present.come_back(*this);
    return out;
}

}  // namespace splitcubes::view
