// The gate that keeps calls of the public interface apart, and the translation of their errors.
#pragma once

#include <splitcubes/api/error.h>

#include <atomic>

namespace splitcubes::api {

/// One writer or any number of readers; who comes too much is refused, not kept waiting.
class Gate {
  public:
    /// Throws Error (busy).
    void enter(bool is_writer);
    void leave(bool is_writer) noexcept;

  private:
    std::atomic<int> users_ = 0;  // readers; -1: a writer
};

/// Throws what is being handled as an Error.
[[noreturn]] void rethrow_as_error();

/// Runs a call's work between enter and leave. Every exception becomes an Error.
template <class Work>
auto run_call(Gate& gate, bool is_writer, const Work& work) {
    gate.enter(is_writer);
    struct Leave {
        Gate& gate;
        bool is_writer;
        ~Leave() { gate.leave(is_writer); }
    } leave{gate, is_writer};
    try {
        return work();
    } catch (...) {
        rethrow_as_error();
    }
}

}  // namespace splitcubes::api
