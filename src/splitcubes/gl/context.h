// OpenGL contexts: an interface, and a context that needs no window.
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace splitcubes::gl {

/// An OpenGL core context, version 3.3 or newer. Objects made in a context must be used and destroyed while
/// it is current, and must be destroyed before it.
class Context {
  public:
    virtual ~Context() = default;
    /// Makes this the calling thread's context. Throws JobError if the driver refuses.
    virtual void make_current() const = 0;
};

/// A context without a window, by EGL: tries each device of the machine in the driver's order, then Mesa's
/// surfaceless platform.
class HeadlessContext : public Context {
  public:
    /// Returns the first context that starts, made current, or nothing; then `why_not`, if given, receives
    /// one line with the attempts and their errors. Does not throw if the machine has no OpenGL.
    static std::optional<HeadlessContext> create(std::string* why_not = nullptr);

    ~HeadlessContext() override;
    HeadlessContext(HeadlessContext&&) noexcept;
    HeadlessContext& operator=(HeadlessContext&&) noexcept;

    void make_current() const override;

    const std::string& renderer() const;  // as reported by the driver, e.g. "llvmpipe (...)"
    const std::string& vendor() const;
    const std::string& version() const;
    const std::string& platform() const;  // "EGL device 0" or "EGL surfaceless"
    int major_version() const;
    int minor_version() const;

  private:
    struct Impl;
    explicit HeadlessContext(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Returns one line for people: the renderer found, or "none (reason)". Never throws; leaves no context
/// current.
std::string opengl_summary() noexcept;

}  // namespace splitcubes::gl
