#include "progress.h"

#include "interrupts.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace splitcubes::app {

namespace {

using namespace std::chrono_literals;
constexpr auto quiet_time = 1s;  // work that ends earlier shows nothing
constexpr auto line_pause = 1s;  // between two lines
// Longest time without a line, however little has changed: from five seconds in work of minutes to a minute
// in work of hours.
constexpr auto min_silence = 5s, max_silence = 60s;

std::atomic<bool> bar_is_open{false};

}  // namespace

void clear_bar() {
    if (bar_is_open.exchange(false)) std::fputs("\r\x1b[K", stderr);
}

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) == 1),
      total_(total),
      thread_([this] { watch(); }) {}

Progress::~Progress() {
    finish();
}

void Progress::finish() {
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
    }
    ended_.notify_all();
    if (thread_.joinable()) thread_.join();
    clear_bar();
}

void Progress::show(std::size_t done, const std::string& detail) {
    const std::lock_guard lock(mutex_);
    done_ = done;
    detail_ = detail;
}

void Progress::begin(const std::string& stage) {
    const std::lock_guard lock(mutex_);
    stage_ = stage;
    done_ = total_ = 0;
}

void Progress::advance(std::size_t done, std::size_t total) {
    done_.store(done, std::memory_order_relaxed);
    total_.store(total, std::memory_order_relaxed);
}

bool Progress::cancelled() const {
    return interrupted();
}

double Progress::share() const {
    const std::size_t total = total_;
    if (total == 0) return -1;
    return std::min(1.0, static_cast<double>(done_) / static_cast<double>(total));
}

void Progress::watch() {
    std::unique_lock lock(mutex_);
    if (ended_.wait_until(lock, start_ + quiet_time, [this] { return is_over_; })) return;
    const auto pause = terminal_ ? 100ms : 200ms;
    do {
        if (terminal_)
            draw_bar();
        else
            write_line();
    } while (!ended_.wait_for(lock, pause, [this] { return is_over_; }));
}

void Progress::draw_bar() {
    constexpr int width = 30;
    const double part = share();
    std::string bar;
    if (part >= 0) {
        const int filled = static_cast<int>(part * width);
        bar = " [" + std::string(static_cast<std::size_t>(filled), '#') +
              std::string(static_cast<std::size_t>(width - filled), '.') + "]";
    }
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - start_).count();
    bar_is_open = true;
    const std::string what = stage_.empty() ? detail_ : stage_;
    std::fprintf(stderr, "\r%s%s %s, %lld s\x1b[K", what_.c_str(), bar.c_str(), what.c_str(),
                 static_cast<long long>(seconds));
    std::fflush(stderr);
}

namespace {

// Formats a percentage, with two decimals if `finely`: for shares below a tenth, which may last.
std::string percent_of(double part, bool finely) {
    char text[16];
    std::snprintf(text, sizeof text, "%.*f %%", finely && part < 0.1 ? 2 : 0, std::floor(part * 1e4) / 100);
    return text;
}

}  // namespace

// Writes a line at each stage and each tenth of it, at most one a second, and after a long silence.
void Progress::write_line() {
    const Clock::time_point now = Clock::now();
    const auto since = now - line_time_;
    if (!last_text_.empty() && since < line_pause) return;
    const double part = share();
    std::string current_text = stage_;
    if (part >= 0)
        current_text += (current_text.empty() ? "" : ", ") + percent_of(std::floor(part * 10) / 10, false);
    const bool is_silent =
        since >= std::clamp<Clock::duration>((now - start_) / 20, min_silence, max_silence);
    if (current_text == last_text_ && !is_silent) return;
    std::string line = current_text;
    if (current_text == last_text_) {
        line = stage_;
        if (part >= 0) line += (line.empty() ? "" : ", ") + percent_of(part, true);
        line += (line.empty() ? "" : ", ") +
                std::to_string(std::chrono::duration_cast<std::chrono::seconds>(now - start_).count()) + " s";
    }
    last_text_ = current_text;
    line_time_ = now;
    std::fprintf(stderr, "%s: %s%s\n", what_.c_str(), line.c_str(),
                 detail_.empty() ? "" : (", " + detail_).c_str());
}

}  // namespace splitcubes::app
