// Video files from pictures, by the ffmpeg program.
#pragma once

#include <splitcubes/render/picture.h>

#include <filesystem>
#include <memory>
#include <string>

namespace splitcubes::render {

struct VideoOptions {
    int width = 1280;  // pixels of the pictures to come
    int height = 720;  // an odd last row or column is left out of the video
    double frames_per_second = 25;
    int quality = 18;                // x264's constant rate factor: 0 lossless .. 51 worst
    std::string program = "ffmpeg";  // searched on PATH
};

/// Encodes H.264 (libx264, 4:2:0). The same pictures and options give the same file byte for byte with the
/// same ffmpeg. The file gets its name only when finish() succeeds, and then replaces an older one; before
/// that, and after any failure, nothing is left of it.
class VideoWriter {
  public:
    /// Starts ffmpeg. The extension selects the format (.mp4, .mkv, .mov). Throws InputError for options out
    /// of range, JobError if ffmpeg cannot be started.
    VideoWriter(const std::filesystem::path& path, const VideoOptions& options);
    /// Discards the video unless it is finished.
    ~VideoWriter();
    VideoWriter(VideoWriter&&) noexcept;
    VideoWriter& operator=(VideoWriter&&) noexcept;

    /// Adds a frame. Throws InputError if its size differs from the options', JobError with ffmpeg's message
    /// if ffmpeg has stopped.
    void add(const Picture& picture);
    /// Waits for ffmpeg and renames the file to its name. Throws JobError if there is no frame or ffmpeg
    /// failed. Nothing can be added afterwards.
    void finish();

    int frame_count() const;

    /// Kills ffmpeg and removes its unfinished file; for another thread, when the program is about to exit
    /// during the work. No other function may be called afterwards.
    void kill_now() const noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace splitcubes::render
