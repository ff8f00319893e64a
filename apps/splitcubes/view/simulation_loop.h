// Runs an engine: playing, pausing, slow motion, opening files. In a thread of its own, or by the caller's
// hand.
#pragma once

#include "engine.h"
#include "run_player.h"
#include "timeline.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace splitcubes::view {

/// A loop opens engines and runs them. For one thread.
class SimulationLoop {
  public:
    explicit SimulationLoop(const EngineSettings& settings) : settings_(settings) {}
    /// Throws InputError and Error; the present engine stays then.
    void open(const std::filesystem::path& file);
    /// Carries out commands in their order. Of a parameter that several set in a row the last value counts.
    void take(const std::vector<Command>& commands);
    void step();
    std::shared_ptr<PublishedState> publish();
    /// Makes the state of an earlier step that a command asked for and inserts it, if the timeline has none.
    /// Stops as soon as it is not wanted any more.
    void fill_timeline(Timeline& timeline, const std::function<bool()>& is_wanted);

    bool is_playing() const { return playing_; }
    /// Steps that were asked for one by one while pausing.
    int single_steps() const { return single_steps_; }
    double speed() const { return speed_; }
    /// Null where nothing or a run is open.
    Engine* engine() { return engine_.get(); }
    bool is_open() const { return engine_ || run_; }
    /// Goes up when another scene is opened, or the same one starts again.
    std::uint64_t scene() const { return scene_; }
    double step_length() const;

  private:
    void take_one(const Command& command);

    EngineSettings settings_;
    void notify(const std::string& text);
    std::shared_ptr<PublishedState> run_state();
    void complete(PublishedState& state) const;

    std::unique_ptr<Engine> engine_;
    std::unique_ptr<RunPlayer> run_;  // in place of an engine
    std::shared_ptr<const PublishedState> last_of_run_;
    std::string run_notice_;
    std::uint64_t run_notices_ = 0;
    bool playing_ = false;
    int single_steps_ = 0;
    std::optional<std::int64_t> sought_;  // step of the past
    double speed_ = 1;
    std::uint64_t scene_ = 0, taken_ = 0;
    std::string failure_;  // of opening, before there is an engine
};

/// A loop in its own thread. A step that takes longer than its time slows simulated time; the window only
/// ever takes the newest state, by a pointer.
class SimulationThread {
  public:
    SimulationThread(const EngineSettings& settings, std::size_t timeline_bytes);
    ~SimulationThread();
    SimulationThread(const SimulationThread&) = delete;
    SimulationThread& operator=(const SimulationThread&) = delete;

    /// Returns the number by which PublishedState::commands tells that it has been carried out.
    std::uint64_t send(Command command);
    /// Null until the first one.
    State newest() const;
    const Timeline& timeline() const { return timeline_; }

  private:
    using Clock = std::chrono::steady_clock;
    void run();
    void publish();
    void wait_for_work(Clock::time_point until);
    bool has_work() const;
    bool is_due(Clock::time_point now);

    SimulationLoop loop_;
    Timeline timeline_;
    mutable std::mutex mutex_;  // of the members up to the next empty line
    std::condition_variable wake_;
    std::vector<Command> inbox_;
    State newest_;
    std::uint64_t sent_ = 0;
    bool quits_ = false;

    Clock::time_point next_step_{};
    bool plays_ = false;       // when it looked last
    std::uint64_t scene_ = 0;  // that was published
    double factor_ = 0;        // of simulated time over the last half second
    double window_time_ = 0;
    Clock::time_point window_start_{};
    std::thread thread_;  // last: it uses all others
};

}  // namespace splitcubes::view
