#include "interrupts.h"

#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>
#include <mutex>
#include <thread>
#include <utility>

namespace splitcubes::app {

namespace {

std::atomic<bool> is_interrupted{false};
std::atomic<bool> is_reported{false};
std::atomic<int> patient{0};

// Never destroyed: the signal thread outlives main.
struct Acts {
    std::mutex mutex;
    std::list<std::function<void()>> list;
};
Acts& acts() {
    static Acts* const all = new Acts;
    return *all;
}

sigset_t watched_signals() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    return set;
}

[[noreturn]] void end_at_once() {
    {
        const std::lock_guard lock(acts().mutex);
        for (const std::function<void()>& act : acts().list) act();
    }
    _exit(end_interrupted());
}

// Returns whether a second signal arrives within the time.
bool comes_again(const sigset_t& set, long milliseconds) {
    const timespec time{milliseconds / 1000, milliseconds % 1000 * 1000000};
    int got = 0;
    do {
        got = sigtimedwait(&set, nullptr, &time);
    } while (got < 0 && errno == EINTR);
    return got > 0;
}

// One request may arrive as several signals: `timeout` sends one to the process and one to its group.
void let_signals_pass(const sigset_t& set, long milliseconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    while (comes_again(set, 0)) continue;
}

void wait_for_signals() {
    constexpr long settling = 250, grace = 450;  // ms
    const sigset_t set = watched_signals();
    int signal_number = 0;
    while (sigwait(&set, &signal_number) != 0) continue;
    is_interrupted = true;
    let_signals_pass(set, settling);
    while (!comes_again(set, grace) && patient > 0) continue;
    end_at_once();
}

}  // namespace

void watch_interrupts() {
    // Also if a shell that started the program in the background set the signals to be ignored.
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    const sigset_t set = watched_signals();
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    acts();
    std::thread(wait_for_signals).detach();
}

bool interrupted() {
    return is_interrupted;
}

int end_interrupted(const char* what) {
    if (is_reported.exchange(true)) return 1;
    // Avoids streams: another thread may hold their lock.
    [[maybe_unused]] const ssize_t count = ::write(STDERR_FILENO, what, std::strlen(what));
    return 1;
}

Patience::Patience() {
    ++patient;
}
Patience::~Patience() {
    --patient;
}

AtEnd::AtEnd(std::function<void()> act) {
    const std::lock_guard lock(acts().mutex);
    entry_ = acts().list.insert(acts().list.end(), std::move(act));
}
AtEnd::~AtEnd() {
    const std::lock_guard lock(acts().mutex);
    acts().list.erase(entry_);
}

}  // namespace splitcubes::app
