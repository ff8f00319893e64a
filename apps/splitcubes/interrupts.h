// The user's wish to stop: SIGINT and SIGTERM.
#pragma once

#include <functional>
#include <list>

namespace splitcubes::app {

/// To be called before any thread is started. From then on a first signal makes interrupted() true. Work
/// that does not come to its end within about a second, and any work at a second signal, is ended where it
/// is with exit code 1: files get their names when they are whole, so none is left in part.
void watch_interrupts();
bool interrupted();
/// Says so on standard error, once; returns the exit code.
int end_interrupted(const char* what = "splitcubes: interrupted; the files written are complete\n");

/// While it lives, work is given the time it takes to end in order after the first signal.
class Patience {
  public:
    Patience();
    ~Patience();
    Patience(const Patience&) = delete;
    Patience& operator=(const Patience&) = delete;
};

/// While it lives, what has to be done before the program ends in the midst of work. It is called on
/// another thread than the work's.
class AtEnd {
  public:
    explicit AtEnd(std::function<void()> act);
    ~AtEnd();
    AtEnd(const AtEnd&) = delete;
    AtEnd& operator=(const AtEnd&) = delete;

  private:
    std::list<std::function<void()>>::iterator place_;
};

}  // namespace splitcubes::app
