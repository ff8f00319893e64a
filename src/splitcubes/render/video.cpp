#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <splitcubes/render/video.h>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

extern char** environ;

namespace splitcubes::render {

namespace {

/// A file descriptor that is closed with its owner.
class Descriptor {
  public:
    explicit Descriptor(int value = -1) : value_(value) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int value() const { return value_; }
    void close() {
        if (value_ >= 0) ::close(value_);
        value_ = -1;
    }
    void take(int value) {
        close();
        value_ = value;
    }

  private:
    int value_;
};

std::string number_text(double value) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(10);
    text << value;
    return text.str();
}

std::vector<std::string> arguments(const VideoOptions& options, const std::filesystem::path& output) {
    const std::string size = std::to_string(options.width) + "x" + std::to_string(options.height);
    return {options.program, "-hide_banner", "-loglevel", "error", "-nostdin", "-y",
            // Input: raw frames.
            "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", size, "-framerate",
            number_text(options.frames_per_second), "-i", "pipe:0",
            // 4:2:0 needs even sizes; explicit colour tags spare players a guess.
            "-vf",
            "crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
            "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709",
            // A fixed thread count, because x264's result depends on it, and no dates or versions.
            "-c:v", "libx264", "-preset", "medium", "-crf", std::to_string(options.quality), "-threads", "4",
            "-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart",
            // The prefix protects names with a colon or a leading dash.
            "file:" + output.string()};
}

}  // namespace

struct VideoWriter::Impl {
    std::filesystem::path path;     // as the caller names it
    std::filesystem::path target;   // path with symbolic links followed
    std::filesystem::path partial;  // temporary file beside the target
    VideoOptions options;
    Descriptor frames;    // to ffmpeg's standard input
    Descriptor messages;  // ffmpeg's standard error: an unlinked file
    std::atomic<pid_t> process{-1};
    int frame_count = 0;

    Impl(std::filesystem::path to, VideoOptions wanted) : path(std::move(to)), options(std::move(wanted)) {}
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() { abandon(); }

    std::string name() const { return printable(path.string(), 300); }
    void start();
    int wait();
    void abandon() noexcept;
    std::string last_messages() const;
    [[noreturn]] void fail(const std::string& why);
};

void VideoWriter::Impl::start() {
    std::string pattern = (std::filesystem::temp_directory_path() / "splitcubes-XXXXXX").string();
    messages.take(::mkostemp(pattern.data(), O_CLOEXEC));
    if (messages.value() < 0)
        throw JobError(name() + ": no temporary file for ffmpeg's messages (" + std::strerror(errno) + ")");
    ::unlink(pattern.c_str());
    // A socket instead of a pipe, because send() can suppress SIGPIPE.
    std::array<int, 2> ends{-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
        throw JobError(name() + ": no connection to ffmpeg (" + std::strerror(errno) + ")");
    }
    frames.take(ends[0]);
    const Descriptor theirs(ends[1]);
    ::shutdown(frames.value(), SHUT_RD);

    std::vector<std::string> words = arguments(options, partial);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, theirs.value(), STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, messages.value(), STDERR_FILENO);
    // In its own process group ffmpeg does not receive the terminal's Ctrl-C; only this program ends it.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
    posix_spawnattr_setpgroup(&attributes, 0);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    pid_t child = -1;
    const int error =
        ::posix_spawnp(&child, options.program.c_str(), &actions, &attributes, pointers.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (error == 0) {
        process = child;
        return;
    }
    throw JobError(name() + ": the program '" + printable(options.program, 200) + "' cannot be started (" +
                   std::strerror(error) + "); install ffmpeg or write single pictures");
}

/// Returns ffmpeg's exit status, -1 if a signal ended it.
int VideoWriter::Impl::wait() {
    frames.close();
    int status = 0;
    // The process id stays reserved until waitpid, so kill_now cannot hit another process.
    siginfo_t info{};
    while (::waitid(P_PID, static_cast<id_t>(process.load()), &info, WEXITED | WNOWAIT) < 0 && errno == EINTR)
        continue;
    const pid_t child = process.exchange(-1);
    pid_t ended = -1;
    do {
        ended = ::waitpid(child, &status, 0);
    } while (ended < 0 && errno == EINTR);
    return ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void VideoWriter::Impl::abandon() noexcept {
    if (process > 0) {
        ::kill(process, SIGKILL);
        wait();
        std::error_code ignored;
        std::filesystem::remove(partial, ignored);
    }
}

/// Returns the end of ffmpeg's messages, on one line.
std::string VideoWriter::Impl::last_messages() const {
    std::array<char, 2000> buffer{};
    const off_t end = ::lseek(messages.value(), 0, SEEK_END);
    const off_t from = end > 2000 ? end - 2000 : 0;
    const ssize_t count = ::pread(messages.value(), buffer.data(), buffer.size(), from);
    std::string text(buffer.data(), count > 0 ? static_cast<std::size_t>(count) : 0);
    while (!text.empty() && text.back() == '\n') text.pop_back();
    for (char& c : text) {
        if (c == '\n') c = ' ';
    }
    return text.empty() ? "it said nothing" : printable(text, 2000);
}

void VideoWriter::Impl::fail(const std::string& why) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw JobError(name() + ": " + why);
}

VideoWriter::VideoWriter(const std::filesystem::path& path, const VideoOptions& options) {
    if (options.width < 2 || options.height < 2) {
        throw InputError("video size", "is less than two pixels (" + std::to_string(options.width) + " x " +
                                           std::to_string(options.height) + ")");
    }
    if (!(options.frames_per_second > 0 && options.frames_per_second <= 1000)) {
        throw InputError("video frames_per_second",
                         "is out of range (" + number_text(options.frames_per_second) + ")",
                         "choose up to 1000");
    }
    if (options.quality < 0 || options.quality > 51) {
        throw InputError("video quality", "is out of range (" + std::to_string(options.quality) + ")",
                         "choose 0 (lossless) to 51 (worst)");
    }
    if (!path.has_filename() || !path.has_extension()) {
        throw InputError(printable(path.string(), 300), "names no video format", "end the name in .mp4");
    }
    impl_ = std::make_unique<Impl>(path, options);
    impl_->target = link_target(path);
    // ffmpeg derives the format from the extension, so that stays last. The name is short because the video's
    // own name may have the maximum length of the file system.
    // Several films of a program may lie in one folder.
    static std::atomic<int> films{0};
    impl_->partial =
        impl_->target.parent_path() / (".splitcubes-" + std::to_string(::getpid()) + "-" +
                                       std::to_string(++films) + ".tmp" + path.extension().string());
    impl_->start();
}

VideoWriter::~VideoWriter() = default;
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;
VideoWriter& VideoWriter::operator=(VideoWriter&&) noexcept = default;

void VideoWriter::add(const Picture& picture) {
    const VideoOptions& options = impl_->options;
    if (picture.width != options.width || picture.height != options.height ||
        picture.rgb.size() !=
            3 * static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height)) {
        throw InputError(impl_->name(), "a frame of " + std::to_string(picture.width) + " x " +
                                            std::to_string(picture.height) + " does not fit a video of " +
                                            std::to_string(options.width) + " x " +
                                            std::to_string(options.height));
    }
    if (impl_->process < 0) throw JobError(impl_->name() + ": the video has ended, no frame can be added");
    std::size_t sent = 0;
    while (sent < picture.rgb.size()) {
        const ssize_t count =
            ::send(impl_->frames.value(), picture.rgb.data() + sent, picture.rgb.size() - sent, MSG_NOSIGNAL);
        if (count > 0) {
            sent += static_cast<std::size_t>(count);
        } else if (errno != EINTR) {
            impl_->wait();
            impl_->fail("ffmpeg stopped before the last frame (" + impl_->last_messages() + ")");
        }
    }
    ++impl_->frame_count;
}

void VideoWriter::finish() {
    if (impl_->process < 0) throw JobError(impl_->name() + ": the video has ended already");
    const int status = impl_->wait();
    if (status != 0) impl_->fail("ffmpeg failed (" + impl_->last_messages() + ")");
    if (impl_->frame_count == 0) impl_->fail("a video needs at least one frame");
    std::error_code error;
    std::filesystem::rename(impl_->partial, impl_->target, error);
    if (error) impl_->fail("cannot be put in place (" + error.message() + ")");
}

void VideoWriter::kill_now() const noexcept {
    const pid_t child = impl_->process;
    if (child <= 0) return;
    ::kill(child, SIGKILL);
    ::unlink(impl_->partial.c_str());
}

int VideoWriter::frame_count() const {
    return impl_->frame_count;
}

}  // namespace splitcubes::render
