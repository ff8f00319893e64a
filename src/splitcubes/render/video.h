// Pictures to a video file, by the ffmpeg program.
#pragma once

#include <splitcubes/render/picture.h>

#include <filesystem>
#include <memory>
#include <string>

namespace splitcubes::render {

struct VideoOptions {
    int width = 1280;  // pixels of the pictures that will come
    int height = 720;  // an odd last row or column is left out of the video
    double frames_per_second = 25;
    int quality = 18;                // x264's constant rate factor: 0 lossless .. 51 worst
    std::string program = "ffmpeg";  // looked up on PATH
};

/// Encodes H.264 (libx264, 4:2:0). The same pictures and options give the same
/// file byte for byte with the same ffmpeg. The file appears under its name only
/// when finish() succeeds, in place of an older one; before that, and after any
/// failure, nothing of it is left.
class VideoWriter {
  public:
    /// The format follows from the name's ending (.mp4, .mkv, .mov). Throws
    /// InputError on options out of range, JobError when ffmpeg cannot be started.
    VideoWriter(const std::filesystem::path& path, const VideoOptions& options);
    /// Abandons the video unless it is finished.
    ~VideoWriter();
    VideoWriter(VideoWriter&&) noexcept;
    VideoWriter& operator=(VideoWriter&&) noexcept;

    /// Throws InputError when the size differs from the options', JobError with
    /// ffmpeg's own words when it has given up.
    void add(const Picture& picture);
    /// Waits for ffmpeg and puts the file in place. Throws JobError when there is
    /// no frame or ffmpeg failed. Nothing can be added afterwards.
    void finish();

    int frame_count() const;

    /// For another thread, when the program is about to end in the midst of the work: ends ffmpeg and takes
    /// its unfinished file away. Nothing else may be called afterwards.
    void kill_now() const noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace splitcubes::render
