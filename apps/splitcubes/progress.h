// Progress on standard error: a bar on a terminal, plain lines otherwise. What is
// over within a second shows none.
#pragma once

#include <splitcubes/core/monitor.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <string>
#include <thread>

namespace splitcubes::app {

/// As a monitor it shows the stages of work, and ends it when the user wants so. It looks at the work from
/// a thread of its own: what says nothing for long is seen to go on.
class Progress : public Monitor {
  public:
    /// total: of show(); 0 where the work is told by stages.
    explicit Progress(std::string what, std::size_t total = 0);
    ~Progress() override;

    /// Shows that `done` of the total are done; `detail` stands behind the bar.
    void show(std::size_t done, const std::string& detail = "");
    /// Ends the bar's line; nothing is shown any more.
    void finish();

    void begin(const std::string& stage) override;
    void advance(std::size_t done, std::size_t total) override;
    bool cancelled() const override;

  private:
    using Clock = std::chrono::steady_clock;
    void watch();
    void draw_bar();
    void write_line();
    double share() const;  // of the stage's work that is done; negative: unknown

    std::string what_;
    bool terminal_;
    Clock::time_point start_ = Clock::now();
    std::atomic<std::size_t> done_{0}, total_{0};

    std::mutex mutex_;  // of what follows
    std::condition_variable ended_;
    bool is_over_ = false;
    std::string stage_, detail_;
    std::string told_;  // what the last line told, but for details
    Clock::time_point line_time_ = start_;

    std::thread thread_;
};

/// Before anything else is written to standard error: takes the bar away, which comes back.
void clear_bar();

}  // namespace splitcubes::app
