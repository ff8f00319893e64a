// What a Simulation is made of: the session, its history, and the gate in front of both.
#pragma once

#include <splitcubes/api/internal/calls.h>
#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/history.h>
#include <splitcubes/api/internal/session.h>
#include <splitcubes/api/internal/step_events.h>
#include <splitcubes/api/simulation.h>
#include <splitcubes/body/body.h>

#include <memory>
#include <string>
#include <utility>

namespace splitcubes {

class Simulation::Impl {
  public:
    explicit Impl(const SimulationSettings& settings)
        : session_(api::world_settings_of(settings), std::make_shared<const Parallel>(settings.thread_count)),
          history_(settings.history) {}

    template <class Work>
    auto read(const Work& work) const {
        return api::run_call(gate_, false, [&] {
            require_whole();
            return work(session_);
        });
    }
    template <class Work>
    auto write(const Work& work) {
        return api::run_call(gate_, true, [&] {
            require_whole();
            return work(session_);
        });
    }
    /// For what cannot be left half done.
    template <class Work>
    auto whole(const Work& work) {
        broken_ = true;
        auto out = work();
        broken_ = false;
        return out;
    }
    StepResult step();
    void mark() { history_.mark(session_.snapshot()); }
    bool go(bool back);
    void load(const std::string& file);
    void restore(const api::Snapshot& kept);
    void forget_history() {
        api::run_call(gate_, true, [&] { history_.clear(); });
    }
    /// Makes everything again from the present state, changed by `edit`.
    template <class Edit>
    void remake(const Edit& edit) {
        write([&](api::Session& session) {
            api::Snapshot now = session.snapshot();
            edit(session, now);
            become(api::Session(now, session.shared_parallel()));
        });
    }
    template <class Edit>
    void remake_body(BodyId body, const Edit& edit) {
        remake([&](const api::Session& session, api::Snapshot& now) {
            api::BodyEntry& entry = now.things.bodies[body];
            body::BodySettings settings = entry.source->settings;
            edit(settings, "body '" + session.body(body).name() + "'");
            entry.source = std::make_shared<const api::BodySource>(
                api::BodySource{entry.source->model, std::move(settings), entry.source->transfer});
        });
    }
    template <class Work>
    auto history(const Work& work) const {
        return api::run_call(gate_, false, [&] { return work(history_); });
    }
    void mark_cut() {
        if (history_.is_automatic()) mark();
    }

  private:
    void require_whole() const {
        if (broken_)
            throw Error(ErrorKind::broken, "simulation: a step has failed half way; undo, or load a state");
    }
    api::Session session_of(const api::Snapshot& read, const std::string& file) const;
    void become(api::Session next);

    mutable api::Gate gate_;
    api::Session session_;
    api::History history_;
    api::StepEvents events_;
    bool broken_ = false;
};

}  // namespace splitcubes
