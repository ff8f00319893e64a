// Progress reports and cancellation of long work.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace splitcubes {

/// Thrown by cancelled work. Its results are discarded; its input is unchanged.
class Cancelled : public std::runtime_error {
  public:
    Cancelled() : std::runtime_error("cancelled") {}
};

/// Receives the progress of work and can cancel it; see Parallel::watch.
class Monitor {
  public:
    Monitor() = default;
    virtual ~Monitor() = default;
    Monitor(const Monitor&) = delete;
    Monitor& operator=(const Monitor&) = delete;

    /// Called when another stage of the work begins.
    virtual void begin(const std::string& stage) = 0;
    /// Called when chunks of a loop are done: often, on any thread.
    virtual void advance(std::size_t done, std::size_t total) = 0;
    /// Returns whether to end the work. Called often and on any thread.
    virtual bool cancelled() const = 0;
};

}  // namespace splitcubes
