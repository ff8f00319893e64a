#include "simulation_loop.h"

#include <splitcubes/core/error.h>

#include <algorithm>
#include <utility>

namespace splitcubes::view {

namespace {

using Seconds = std::chrono::duration<double>;

// Simulated time catches up with what slow steps lost, up to this.
constexpr Seconds max_delay{0.25};
// The real-time factor is measured over this time.
constexpr Seconds factor_window{0.5};

Recording scripted(const std::filesystem::path& file) {
    return is_recording(file) ? read_session_recording(file) : Recording{};
}

}  // namespace

void SimulationLoop::open(const std::filesystem::path& file) {
    if (is_run(file)) {
        auto run = std::make_unique<RunPlayer>(file);
        run->publish();  // throws where the first frame cannot be read
        run_ = std::move(run);
        last_of_run_.reset();
        engine_.reset();
        run_notice_.clear();
        for (const std::string& note : run_->notes()) notify(note);
    } else {
        const Recording script = scripted(file);
        engine_ = std::make_unique<Engine>(open_source(script.scene.empty() ? file : script.scene), settings_,
                                           script);
        run_.reset();
    }
    ++scene_;
    single_steps_ = 0;
}

void SimulationLoop::take(const std::vector<Command>& commands) {
    for (std::size_t k = 0; k < commands.size(); ++k) {
        const Command& command = commands[k];
        const bool is_overwritten = command.kind == CommandKind::set_parameter && k + 1 < commands.size() &&
                                    commands[k + 1].kind == CommandKind::set_parameter &&
                                    commands[k + 1].name == command.name;
        if (!is_overwritten) take_one(command);
        taken_ = std::max(taken_, command.number);
    }
}

void SimulationLoop::take_one(const Command& command) {
    if (command.kind == CommandKind::play || command.kind == CommandKind::single_step ||
        command.kind == CommandKind::restart || command.kind == CommandKind::resume_at ||
        command.kind == CommandKind::open)
        sought_.reset();
    switch (command.kind) {
        case CommandKind::play:
            playing_ = true;
            if (run_ && run_->is_at_end()) run_->seek(0);
            return;
        case CommandKind::pause:
            playing_ = false;
            return;
        case CommandKind::single_step:
            playing_ = false;
            ++single_steps_;
            return;
        case CommandKind::set_speed:
            speed_ = std::clamp(command.value, 0.01, 4.0);
            return;
        case CommandKind::open:
            try {
                open(command.name);
            } catch (const std::exception& error) {
                is_open() ? notify(error.what()) : void(failure_ = error.what());
            }
            return;
        case CommandKind::resume_at:
            playing_ = false;
            break;
        case CommandKind::restart:
            if (run_) return run_->seek(0);
            ++scene_;
            break;
        case CommandKind::seek:
            if (run_) run_->seek(static_cast<std::int64_t>(command.value));
            if (engine_) sought_ = static_cast<std::int64_t>(command.value);
            return;
        default:
            break;
    }
    if (engine_) engine_->apply(command);
    if (run_ && command.kind != CommandKind::show_field)
        notify("a run is played back; to cut, open its scene");
}

void SimulationLoop::notify(const std::string& text) {
    if (engine_) return engine_->notify(text);
    run_notice_ = text;
    ++run_notices_;
}

double SimulationLoop::step_length() const {
    if (engine_) return engine_->step_length();
    return run_ ? run_->frame_length() : 0;
}

void SimulationLoop::step() {
    if (engine_) engine_->step();
    if (run_) {
        run_->step();
        playing_ = playing_ && !run_->is_at_end();
    }
    single_steps_ = std::max(0, single_steps_ - 1);
}

// A frame that cannot be read leaves the one before.
std::shared_ptr<PublishedState> SimulationLoop::run_state() {
    try {
        if (!last_of_run_ || last_of_run_->step != run_->frame()) last_of_run_ = run_->publish();
    } catch (const std::exception& error) {
        playing_ = false;
        notify(error.what());
    }
    auto out = std::make_shared<PublishedState>(last_of_run_ ? *last_of_run_ : PublishedState());
    out->notice = run_notice_;
    out->notices = run_notices_;
    return out;
}

void SimulationLoop::complete(PublishedState& state) const {
    state.scene = scene_;
    state.commands = taken_;
    state.playing = playing_;
    state.speed = speed_;
}

void SimulationLoop::fill_timeline(Timeline& timeline, const std::function<bool()>& is_wanted) {
    if (!sought_) return;
    const std::int64_t step = *std::exchange(sought_, std::nullopt);
    const State known = timeline.at(step);
    if (!engine_ || (known && known->step == step)) return;
    const auto state = engine_->look_back(step, is_wanted);
    if (!state) {
        if (!is_wanted()) sought_ = step;  // after what came in between
        return;
    }
    complete(*state);
    timeline.insert(state);
}

std::shared_ptr<PublishedState> SimulationLoop::publish() {
    auto out = engine_ ? engine_->publish() : run_ ? run_state() : std::make_shared<PublishedState>();
    complete(*out);
    if (!is_open() && !failure_.empty()) {
        out->notice = failure_;
        out->notices = 1;
    }
    return out;
}

SimulationThread::SimulationThread(const EngineSettings& settings, std::size_t timeline_bytes)
    : loop_(settings), timeline_(timeline_bytes), thread_([this] { run(); }) {}

SimulationThread::~SimulationThread() {
    {
        const std::lock_guard lock(mutex_);
        quits_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

std::uint64_t SimulationThread::send(Command command) {
    std::uint64_t number = 0;
    {
        const std::lock_guard lock(mutex_);
        command.number = number = ++sent_;
        inbox_.push_back(std::move(command));
    }
    wake_.notify_one();
    return number;
}

State SimulationThread::newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
}

void SimulationThread::publish() {
    auto state = loop_.publish();
    state->real_time_factor = loop_.is_playing() ? factor_ : 0;
    State next = std::move(state);
    if (loop_.is_open()) timeline_.add(next);
    const std::lock_guard lock(mutex_);
    newest_.swap(next);
}

bool SimulationThread::has_work() const {
    return quits_ || !inbox_.empty();
}

void SimulationThread::wait_for_work(Clock::time_point until) {
    std::unique_lock lock(mutex_);
    const auto comes = [this] { return has_work(); };
    if (loop_.is_playing())
        wake_.wait_until(lock, until, comes);
    else
        wake_.wait(lock, comes);
}

bool SimulationThread::is_due(Clock::time_point now) {
    if (loop_.single_steps() > 0) return true;
    return loop_.is_playing() && loop_.is_open() && now >= next_step_;
}

void SimulationThread::run() {
    window_start_ = Clock::now();
    for (;;) {
        std::vector<Command> commands;
        {
            const std::lock_guard lock(mutex_);
            if (quits_) return;
            commands.swap(inbox_);
        }
        loop_.take(commands);
        loop_.fill_timeline(timeline_, [this] {
            const std::lock_guard lock(mutex_);
            return !has_work();
        });
        // The timeline begins with the first step.
        const bool opened = loop_.scene() != scene_;
        if (opened) publish();
        scene_ = loop_.scene();
        const Clock::time_point now = Clock::now();
        // Nothing was lost while it paused or opened a file.
        if (!plays_ || opened) next_step_ = now;
        plays_ = loop_.is_playing() && loop_.is_open();
        const bool due = is_due(now);
        if (due) {
            const double step = loop_.step_length();
            loop_.step();
            window_time_ += step;
            next_step_ = std::max(
                next_step_ + std::chrono::duration_cast<Clock::duration>(Seconds(step / loop_.speed())),
                now - std::chrono::duration_cast<Clock::duration>(max_delay));
        }
        if (const Seconds window = now - window_start_; window > factor_window) {
            factor_ = window_time_ / window.count();
            window_time_ = 0;
            window_start_ = now;
        }
        if (due || !commands.empty()) publish();
        if (!due) wait_for_work(next_step_);
    }
}

}  // namespace splitcubes::view
