// What a Simulation is made of: the session, its history, and the gate in front of both.
#pragma once

#include <splitcubes/api/internal/calls.h>
#include <splitcubes/api/simulation.h>

#include <functional>
#include <memory>
#include <string>

namespace splitcubes {

namespace api {
class History;
class Session;
struct Snapshot;
class StepEvents;
}  // namespace api

class Simulation::Impl {
  public:
    explicit Impl(const SimulationSettings& settings);
    ~Impl();

    template <class Work>
    auto read(const Work& work) const {
        return api::run_call(gate_, false, [&] {
            require_whole();
            return work(*session_);
        });
    }
    template <class Work>
    auto write(const Work& work) {
        return api::run_call(gate_, true, [&] {
            require_whole();
            return work(*session_);
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
    void mark();
    bool go(bool back);
    void load(const std::string& file);
    void restore(const api::Snapshot& kept);
    void forget_history();
    /// Makes everything again from the present state, changed by `edit`.
    void remake(const std::function<void(const api::Session&, api::Snapshot&)>& edit);
    template <class Work>
    auto history(const Work& work) const {
        return api::run_call(gate_, false, [&] { return work(*history_); });
    }
    void mark_cut();

  private:
    void require_whole() const {
        if (broken_)
            throw Error(ErrorKind::broken, "simulation: a step has failed half way; undo, or load a state");
    }
    api::Session session_of(const api::Snapshot& read, const std::string& file) const;
    void become(api::Session next);

    mutable api::Gate gate_;
    std::unique_ptr<api::Session> session_;
    std::unique_ptr<api::History> history_;
    std::unique_ptr<api::StepEvents> events_;
    bool broken_ = false;
};

}  // namespace splitcubes
