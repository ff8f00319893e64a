#include "film_maker.h"

#include <splitcubes/core/atomic_file.h>

#include <algorithm>
#include <filesystem>

namespace splitcubes::view {

namespace {

// s, until the next state; of an undo, which goes back in time, one picture.
double time_between(const std::vector<State>& states, std::size_t k) {
    if (k + 1 == states.size()) return 1 / film_rate;
    const double out = states[k + 1]->time - states[k]->time;
    return out >= 0 ? std::min(out, 1.0) : 1 / film_rate;
}

}  // namespace

std::string FilmMaker::start(const std::string& file, int width, int height, Quality quality) {
    if (video_) return "another film is being made";
    const std::string ending = std::filesystem::path(file).extension().string();
    if (ending != ".mp4" && ending != ".mkv" && ending != ".mov")
        return file + ": has an unknown ending; give FILE.mp4, .mkv or .mov";
    file_ = file;
    quality_ = quality;
    // H.264 has no odd sizes.
    width_ = width & ~1;
    height_ = height & ~1;
    done_ = drawn_ = 0;
    problem_.clear();
    has_time_ = false;
    try {
        check_file_target(file);
        render::VideoOptions options;
        options.width = width_;
        options.height = height_;
        options.frames_per_second = film_rate;
        video_.emplace(file, options);
        renderer_.emplace(context_);
    } catch (const std::exception& error) {
        video_.reset();
        return error.what();
    }
    return {};
}

std::string FilmMaker::make(const std::string& file, std::vector<State> states, const Viewer& viewer,
                            int width, int height, Quality quality) {
    if (states.empty()) return "there is nothing to film yet: play first";
    if (const std::string problem = start(file, width, height, quality); !problem.empty()) return problem;
    is_recording_ = false;
    viewer_.emplace(viewer);
    viewer_->take({.kind = InputKind::resize, .x = 1.0 * width_, .y = 1.0 * height_});
    viewer_->take({.kind = InputKind::key, .name = "escape"});
    frames_.clear();
    double clock = 0;  // s, of the film
    for (std::size_t k = 0; k < states.size(); ++k) {
        const double next = clock + time_between(states, k);
        while (static_cast<double>(frames_.size()) / film_rate < next - 1e-9) frames_.push_back(states[k]);
        clock = next;
    }
    return {};
}

std::string FilmMaker::record(const std::string& file, const Viewer& viewer, int width, int height,
                              Quality quality) {
    if (!viewer.state() || viewer.state()->bodies.empty())
        return "there is nothing to film yet: open a scene or a mesh first";
    const std::string problem = start(file, width, height, quality);
    if (!problem.empty()) return problem;
    frames_.clear();
    is_recording_ = true;
    observe(viewer);
    return {};
}

void FilmMaker::add(const Viewer& viewer, std::size_t times) {
    if (times == 0) return;
    try {
        const render::Picture picture = renderer_->picture(viewer, width_, height_, quality_);
        ++drawn_;
        for (; times > 0; --times, ++done_) video_->add(picture);
    } catch (const std::exception& error) {
        problem_ = error.what();
    }
}

std::string FilmMaker::advance() {
    if (!is_making()) return {};
    if (done_ < frames_.size() && problem_.empty()) {
        const State& shown = frames_[done_];
        std::size_t times = 1;
        while (done_ + times < frames_.size() && frames_[done_ + times] == shown) ++times;
        viewer_->show(shown);
        add(*viewer_, times);
        if (problem_.empty() && done_ < frames_.size()) return {};
    }
    return stop();
}

// After an undo time goes on from where it is.
void FilmMaker::observe(const Viewer& viewer) {
    if (!is_recording() || !viewer.state() || viewer.state()->bodies.empty() || !problem_.empty()) return;
    const double time = viewer.state()->time;
    if (!has_time_ || time < next_time_ - 2 / film_rate) next_time_ = time;
    has_time_ = true;
    // A window that is slow owes several pictures of what it shows: to draw each would make it slower still.
    std::size_t times = 0;
    for (; next_time_ <= time + 1e-9; next_time_ += 1 / film_rate) ++times;
    add(viewer, times);
}

std::string FilmMaker::stop() {
    if (!video_) return {};
    std::string out = problem_;
    if (out.empty()) try {
            video_->finish();
            out = "saved " + std::filesystem::absolute(file_).lexically_normal().string() + ", " +
                  std::to_string(done_) + (done_ == 1 ? " picture" : " pictures");
        } catch (const std::exception& error) {
            out = error.what();
        }
    video_.reset();
    renderer_.reset();
    viewer_.reset();
    frames_.clear();
    return out;
}

}  // namespace splitcubes::view
