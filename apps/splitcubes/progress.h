// Progress on standard error: a bar on a terminal, plain lines otherwise. Work that ends within a second
// shows none.
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

/// Shows the stages of work as a Monitor, and cancels it on an interrupt. It polls the work from its own
/// thread, so that work without reports is shown as alive.
class Progress : public Monitor {
  public:
    /// total: of show(); 0 if the work reports stages.
    explicit Progress(std::string what, std::size_t total = 0);
    ~Progress() override;

    /// Shows that `done` of the total are done, with `detail` behind the bar.
    void show(std::size_t done, const std::string& detail = "");
    /// Ends the bar's line; nothing is shown afterwards.
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

    std::mutex mutex_;  // protects the following members
    std::condition_variable ended_;
    bool is_over_ = false;
    std::string stage_, detail_;
    std::string last_text_;  // text of the last line, without details
    Clock::time_point line_time_ = start_;

    std::thread thread_;
};

/// Removes the bar before other output to standard error; it is drawn again later.
void clear_bar();

}  // namespace splitcubes::app
