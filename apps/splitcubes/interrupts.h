// Requests to stop: SIGINT and SIGTERM.
#pragma once

#include <functional>
#include <list>

namespace splitcubes::app {

/// Must be called before any thread is started. Afterwards the first signal makes interrupted() true. If the
/// work does not end within about a second, or a second signal arrives, the process exits with code 1: files
/// get their names only once complete, so no partial file remains.
void watch_interrupts();
bool interrupted();
/// Reports the interruption on standard error, once; returns the exit code.
int end_interrupted(const char* what = "splitcubes: interrupted; the files written are complete\n");

/// During its lifetime work may take any time to end in order after the first signal.
class Patience {
  public:
    Patience();
    ~Patience();
    Patience(const Patience&) = delete;
    Patience& operator=(const Patience&) = delete;
};

/// During its lifetime registers a clean-up function for a forced exit. It is called on another thread than
/// the work's.
class AtEnd {
  public:
    explicit AtEnd(std::function<void()> act);
    ~AtEnd();
    AtEnd(const AtEnd&) = delete;
    AtEnd& operator=(const AtEnd&) = delete;

  private:
    std::list<std::function<void()>>::iterator entry_;
};

}  // namespace splitcubes::app
