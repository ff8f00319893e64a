// Films of what the viewer shows: of the states that are kept, or of all that comes from now on.
#pragma once

#include "state_renderer.h"

#include <splitcubes/render/video.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace splitcubes::view {

inline constexpr double film_rate = 30;  // pictures a second, of simulated time at its real speed

/// One film at a time. What goes wrong comes out as a line.
class FilmMaker {
  public:
    /// The context must outlive it and be current in all calls.
    explicit FilmMaker(const gl::Context& context) : context_(context) {}

    /// Begins a film of states, ascending in time, as the viewer shows them now. Returns what went wrong;
    /// empty: nothing.
    std::string make(const std::string& file, std::vector<State> states, const Viewer& viewer, int width,
                     int height, Quality quality = Quality::fine);
    /// Begins a film of the state that the viewer shows and of those that are observed from now on.
    std::string record(const std::string& file, const Viewer& viewer, int width, int height,
                       Quality quality = Quality::fine);
    /// Draws a picture of a film of states. Returns the line that tells the user of its end; empty before.
    std::string advance();
    /// Adds the state that a viewer shows, as often as its time asks for.
    void observe(const Viewer& viewer);
    /// Ends what is recorded. Returns the line that tells the user.
    std::string stop();

    bool is_making() const { return video_ && !is_recording_; }
    bool is_recording() const { return video_ && is_recording_; }
    /// Pictures that it has, and that it will have; 0: not known.
    std::size_t done() const { return done_; }
    std::size_t total() const { return frames_.size(); }
    /// Pictures that it drew: those that show the same are drawn once.
    std::size_t drawn() const { return drawn_; }

  private:
    std::string start(const std::string& file, int width, int height, Quality quality);
    void add(const Viewer& viewer, std::size_t times);

    const gl::Context& context_;
    std::optional<StateRenderer> renderer_;
    std::optional<render::VideoWriter> video_;
    std::optional<Viewer> viewer_;
    std::vector<State> frames_;  // one a picture
    std::string file_, problem_;
    int width_ = 0, height_ = 0;
    Quality quality_ = Quality::fine;
    bool is_recording_ = false;
    std::size_t done_ = 0, drawn_ = 0;
    double next_time_ = 0;  // s, simulated, of the next picture that is recorded
    bool has_time_ = false;
};

}  // namespace splitcubes::view
