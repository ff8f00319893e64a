// What long work tells of how far it has come, and how it hears that nobody wants it any more.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace splitcubes {

/// Thrown by work that is not wanted any more. What it was to make is gone; its input is as it was.
class Cancelled : public std::runtime_error {
  public:
    Cancelled() : std::runtime_error("cancelled") {}
};

/// Given to work by Parallel::watch.
class Monitor {
  public:
    Monitor() = default;
    virtual ~Monitor() = default;
    Monitor(const Monitor&) = delete;
    Monitor& operator=(const Monitor&) = delete;

    /// Another stage of the work begins.
    virtual void begin(const std::string& stage) = 0;
    /// Some of a loop's chunks are done. Called often and on any thread.
    virtual void advance(std::size_t done, std::size_t total) = 0;
    /// Whether to end. Called often and on any thread.
    virtual bool cancelled() const = 0;
};

}  // namespace splitcubes
