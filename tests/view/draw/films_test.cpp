// Films, and the pictures of the gallery.
#include "view/draw/drawn_sessions.h"

#include <splitcubes/view/draw/film_maker.h>
#include <splitcubes/view/draw/thumbnails.h>

#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <set>
#include <thread>

namespace splitcubes::view_tests {
namespace {

struct Films : DrawnSession {
    bool has_encoder() const { return std::system("ffmpeg -version >/dev/null 2>&1") == 0; }
};

TEST_F(Films, OfThePastHaveAPictureATwoSteps) {
    if (!has_encoder()) GTEST_SKIP() << "there is no ffmpeg";
    Timeline timeline(std::size_t{64} << 20);
    FilmMaker film(*context);
    const std::string file = folder.path / "past.mp4";
    EXPECT_THAT(film.make(file, timeline.states(), session->viewer, width, height),
                testing::HasSubstr("play first"));
    session->key("space");
    for (int k = 0; k < 10; ++k) {
        session->frame();
        timeline.add(session->viewer.state());
    }
    ASSERT_EQ(film.make(file, timeline.states(), session->viewer, width, height, Quality::quick), "");
    EXPECT_EQ(film.total(), 6U);
    EXPECT_NE(film.record(file, session->viewer, width, height), "") << "one at a time";
    std::string end;
    while (film.is_making()) end = film.advance();
    EXPECT_EQ(end, "saved " + file + ", 6 pictures");
    EXPECT_GT(std::filesystem::file_size(file), 1000U);
}

TEST_F(Films, OfWhatComesEndWhenTheyAreStopped) {
    if (!has_encoder()) GTEST_SKIP() << "there is no ffmpeg";
    FilmMaker film(*context);
    const std::string file = folder.path / "coming.mp4";
    ASSERT_EQ(film.record(file, session->viewer, width + 1, height, Quality::quick), "");
    session->key("space");
    for (int k = 0; k < 8; ++k) {
        session->frame();
        film.observe(session->viewer);
    }
    EXPECT_TRUE(film.is_recording());
    EXPECT_EQ(film.stop(), "saved " + file + ", 5 pictures");
    EXPECT_GT(std::filesystem::file_size(file), 1000U);
    EXPECT_EQ(film.stop(), "");
    // However soon it ends.
    ASSERT_EQ(film.record(file, session->viewer, width, height, Quality::quick), "");
    EXPECT_EQ(film.stop(), "saved " + file + ", 1 picture");
}

TEST_F(Films, OfASlowWindowDrawEachStateOnce) {
    if (!has_encoder()) GTEST_SKIP() << "there is no ffmpeg";
    FilmMaker film(*context);
    Timeline timeline(std::size_t{64} << 20);
    ASSERT_EQ(film.record(folder.path / "slow.mp4", session->viewer, width, height, Quality::quick), "");
    session->key("space");
    for (int k = 0; k < 3; ++k) {
        session->frame(12);
        timeline.add(session->viewer.state());
        film.observe(session->viewer);
    }
    EXPECT_EQ(film.done(), 19U) << "0.6 s, and the first picture";
    EXPECT_EQ(film.drawn(), 4U);
    film.stop();
    ASSERT_EQ(film.make(folder.path / "past.mp4", timeline.states(), session->viewer, width, height,
                        Quality::quick),
              "");
    while (film.is_making()) film.advance();
    EXPECT_EQ(film.done(), 13U);
    EXPECT_EQ(film.drawn(), 3U);
}

TEST_F(Films, WrongNamesAreALine) {
    FilmMaker film(*context);
    EXPECT_NE(film.record(folder.path / "film.docx", session->viewer, width, height), "");
    EXPECT_NE(film.record("/nowhere/film.mp4", session->viewer, width, height), "");
    EXPECT_FALSE(film.is_recording());
}

TEST(Gallery, BeginsWithMeshesAndHasWhatCanBeSimulated) {
    const std::vector<GalleryItem> items = gallery_items(SPLITCUBES_SCENES);
    ASSERT_GT(items.size(), 20U);
    EXPECT_EQ(items[0].file.filename(), "liver.obj");
    std::set<std::string> names;
    for (const GalleryItem& item : items) {
        EXPECT_FALSE(item.title.empty());
        names.insert(item.file.filename().string());
    }
    EXPECT_TRUE(names.contains("bread_sliced.json"));
    EXPECT_FALSE(names.contains("free_form_twist.json")) << "a lattice moves it";
    EXPECT_TRUE(gallery_items("/nowhere").empty());
}

TEST_F(Films, ThumbnailsAreDrawnOnceAndKept) {
    const std::string cache = folder.path / "cache";
    setenv("XDG_CACHE_HOME", cache.c_str(), 1);
    const std::filesystem::path wrong = folder.path / "wrong.json";
    std::ofstream(wrong) << "{}";
    const std::vector<GalleryItem> items = {{folder.path / "block.json", "Block"}, {wrong, "Wrong"}};
    Thumbnails first(*context, items, true);
    EXPECT_EQ(first.picture(0), nullptr);
    for (int k = 0; k < 2000 && !first.is_complete(); ++k) {
        first.advance();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_NE(first.picture(0), nullptr);
    EXPECT_EQ(first.picture(1), nullptr);
    const Thumbnails second(*context, items, false);
    ASSERT_NE(second.picture(0), nullptr);
    EXPECT_EQ(second.picture(0)->rgb, first.picture(0)->rgb);
    unsetenv("XDG_CACHE_HOME");
}

}  // namespace
}  // namespace splitcubes::view_tests
