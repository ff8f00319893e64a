// Pictures and videos on disk: round trips, and failures leave nothing.
#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/render/image.h>
#include <splitcubes/render/video.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace {

using namespace splitcubes;
using namespace splitcubes::render;
namespace fs = std::filesystem;

class FilesTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "splitcubes-test-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder = pattern;
    }
    void TearDown() override { fs::remove_all(folder); }
    bool folder_is_empty() const { return fs::is_empty(folder); }
    fs::path folder;
};

Picture noise(int width, int height, std::uint64_t seed) {
    Picture picture{.width = width, .height = height, .rgb = {}};
    Random random(seed);
    picture.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (std::uint8_t& value : picture.rgb) value = static_cast<std::uint8_t>(random.below(256));
    return picture;
}

/// Returns the standard output of a command; empty if it failed.
std::string output_of(const std::string& command) {
    FILE* pipe = ::popen(command.c_str(), "r");
    if (pipe == nullptr) return {};
    std::string text;
    std::array<char, 256> buffer{};
    while (std::fgets(buffer.data(), static_cast<int>(buffer.size()), pipe) != nullptr) text += buffer.data();
    return ::pclose(pipe) == 0 ? text : std::string();
}

bool has_ffmpeg() {
    return !output_of("ffmpeg -version 2>/dev/null").empty();
}

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void write_video(const fs::path& path, const VideoOptions& options, int frame_count) {
    VideoWriter writer(path, options);
    for (int i = 0; i < frame_count; ++i) {
        writer.add(noise(options.width, options.height, static_cast<std::uint64_t>(i)));
    }
    EXPECT_EQ(writer.frame_count(), frame_count);
    EXPECT_FALSE(fs::exists(path)) << "a video under its name is a whole one";
    writer.finish();
}

TEST_F(FilesTest, PngRoundTripKeepsThePicture) {
    for (const auto& [width, height] : {std::pair{1, 1}, std::pair{37, 21}, std::pair{256, 3}}) {
        const Picture picture = noise(width, height, 5);
        write_png(folder / "a.png", picture);
        const Picture back = read_png(folder / "a.png");
        EXPECT_EQ(back.width, width);
        EXPECT_EQ(back.height, height);
        EXPECT_EQ(back.rgb, picture.rgb);
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST_F(FilesTest, PngFailuresLeaveNothing) {
    EXPECT_THROW(write_png(folder / "a.png", Picture{}), InputError);
    Picture wrong = noise(4, 4, 1);
    wrong.rgb.pop_back();
    EXPECT_THROW(write_png(folder / "a.png", wrong), InputError);
    EXPECT_THROW(write_png(folder / "no-such-folder" / "a.png", noise(4, 4, 1)), InputError);
    EXPECT_TRUE(folder_is_empty());
    fs::create_directory(folder / "taken.png");
    EXPECT_THROW(write_png(folder / "taken.png", noise(4, 4, 1)), InputError);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
    EXPECT_THROW(read_png(folder / "absent.png"), InputError);
    std::ofstream(folder / "text.png") << "not a picture";
    EXPECT_THROW(read_png(folder / "text.png"), InputError);
}

TEST_F(FilesTest, VideoHasItsFramesSizeAndRate) {
    if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg here";
    const fs::path path = folder / "a b.mp4";
    write_video(path, {.width = 65, .height = 49, .frames_per_second = 12.5}, 10);
    const std::string said = output_of(
        "ffprobe -v error -count_frames -select_streams v -show_entries "
        "stream=codec_name,pix_fmt,width,height,r_frame_rate,nb_read_frames -of csv=p=0 '" +
        path.string() + "'");
    EXPECT_EQ(said, "h264,64,48,yuv420p,25/2,10\n");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST_F(FilesTest, LinksStayAndTheirTargetsAreReplaced) {
    fs::create_directory(folder / "far");
    std::ofstream(folder / "far" / "a.png") << "old";
    fs::create_symlink("far/a.png", folder / "link.png");
    write_png(folder / "link.png", noise(4, 4, 1));
    EXPECT_TRUE(fs::is_symlink(folder / "link.png"));
    EXPECT_EQ(read_png(folder / "far" / "a.png").rgb, noise(4, 4, 1).rgb);
    if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg here";
    fs::create_symlink("far/film.bin", folder / "film.mp4");  // the given name decides the format
    {
        VideoWriter writer(folder / "film.mp4", {.width = 32, .height = 32});
        writer.add(noise(32, 32, 2));
        writer.finish();
    }
    EXPECT_TRUE(fs::is_symlink(folder / "film.mp4"));
    EXPECT_EQ(bytes_of(folder / "far" / "film.bin").substr(4, 4), "ftyp");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "far"), fs::directory_iterator()), 2);
}

TEST_F(FilesTest, VideoKeepsColors) {
    if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg here";
    Picture plain{.width = 32, .height = 32, .rgb = {}};
    for (int i = 0; i < 32 * 32; ++i) plain.rgb.insert(plain.rgb.end(), {200, 60, 40});
    VideoWriter writer(folder / "a.mp4", {.width = 32, .height = 32});
    writer.add(plain);
    writer.finish();
    ASSERT_EQ(std::system(("ffmpeg -v error -i '" + (folder / "a.mp4").string() + "' '" +
                           (folder / "f.png").string() + "'")
                              .c_str()),
              0);
    const Picture back = read_png(folder / "f.png");
    EXPECT_NEAR(back.pixel(16, 16)[0], 200, 4);
    EXPECT_NEAR(back.pixel(16, 16)[1], 60, 4);
    EXPECT_NEAR(back.pixel(16, 16)[2], 40, 4);
}

TEST_F(FilesTest, SameFramesGiveTheSameVideo) {
    if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg here";
    const VideoOptions options{.width = 160, .height = 120};
    write_video(folder / "a.mp4", options, 10);
    write_video(folder / "b.mp4", options, 10);
    EXPECT_FALSE(bytes_of(folder / "a.mp4").empty());
    EXPECT_EQ(bytes_of(folder / "a.mp4"), bytes_of(folder / "b.mp4"));
}

TEST_F(FilesTest, VideoFailuresSayWhyAndLeaveNothing) {
    const VideoOptions size{.width = 64, .height = 48};
    EXPECT_THROW(VideoWriter(folder / "a.mp4", {.width = 0, .height = 48}), InputError);
    EXPECT_THROW(VideoWriter(folder / "a.mp4", {.width = 64, .height = 48, .frames_per_second = 0}),
                 InputError);
    EXPECT_THROW(VideoWriter(folder / "noending", size), InputError);
    try {
        VideoWriter(folder / "a.mp4", {.width = 64, .height = 48, .program = "no-such-program-here"});
        FAIL() << "started";
    } catch (const JobError& error) {
        EXPECT_NE(std::string(error.what()).find("no-such-program-here"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("install ffmpeg"), std::string::npos);
    }
    // Programs that end at once, with and without success, without reading a frame.
    for (const char* program : {"false", "true"}) {
        VideoOptions options = size;
        options.program = program;
        EXPECT_THROW(
            {
                VideoWriter writer(folder / "a.mp4", options);
                for (int i = 0; i < 200; ++i) writer.add(noise(64, 48, 1));
                writer.finish();
            },
            JobError)
            << program;
    }
    EXPECT_TRUE(folder_is_empty());
}

TEST_F(FilesTest, VideoThatIsNotFinishedLeavesNothing) {
    if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg here";
    const VideoOptions size{.width = 64, .height = 48};
    {
        VideoWriter abandoned(folder / "a.mp4", size);
        abandoned.add(noise(64, 48, 1));
        EXPECT_THROW(abandoned.add(noise(32, 48, 1)), InputError);
    }
    EXPECT_TRUE(folder_is_empty());
    VideoWriter empty(folder / "a.mp4", size);
    EXPECT_THROW(empty.finish(), JobError);
    EXPECT_TRUE(folder_is_empty());
    EXPECT_THROW(empty.add(noise(64, 48, 1)), JobError);
    EXPECT_THROW(empty.finish(), JobError);
    // ffmpeg's own message is part of the error.
    try {
        VideoWriter writer(folder / "no-such-folder" / "a.mp4", size);
        for (int i = 0; i < 200; ++i) writer.add(noise(64, 48, 1));
        writer.finish();
        FAIL() << "written";
    } catch (const JobError& error) {
        EXPECT_NE(std::string(error.what()).find("No such file or directory"), std::string::npos)
            << error.what();
    }
    EXPECT_TRUE(folder_is_empty());
}

}  // namespace
