#include "progress.h"

#include <unistd.h>

#include <csignal>
#include <cstdio>

namespace splitcubes::app {

namespace {

volatile std::sig_atomic_t interrupt_count = 0;

extern "C" void on_interrupt(int signal_number) {
    interrupt_count = interrupt_count + 1;
    if (interrupt_count > 1) {
        std::signal(signal_number, SIG_DFL);
        std::raise(signal_number);
    }
}

}  // namespace

void watch_interrupts() {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
    return interrupt_count > 0;
}

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)), total_(total), terminal_(isatty(STDERR_FILENO) == 1) {}

void Progress::show(std::size_t done, const std::string& detail) {
    const double share = total_ > 0 ? static_cast<double>(done) / static_cast<double>(total_) : 1;
    if (terminal_) {
        constexpr int width = 30;
        const int filled = static_cast<int>(share * width);
        const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                                std::string(static_cast<std::size_t>(width - filled), '.');
        std::fprintf(stderr, "\r%s [%s] %zu/%zu %s\x1b[K", what_.c_str(), bar.c_str(), done, total_,
                     detail.c_str());
        std::fflush(stderr);
        open_line_ = true;
        return;
    }
    const int tenth = static_cast<int>(share * 10);
    if (tenth == last_tenth_) return;
    last_tenth_ = tenth;
    std::fprintf(stderr, "%s %zu/%zu %s\n", what_.c_str(), done, total_, detail.c_str());
}

void Progress::finish() {
    if (open_line_) std::fprintf(stderr, "\n");
    open_line_ = false;
}

}  // namespace splitcubes::app
