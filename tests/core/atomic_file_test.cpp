#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <iterator>
#include <set>
#include <string>

namespace splitcubes {
namespace {

namespace fs = std::filesystem;

class AtomicFileTest : public testing::Test {
  protected:
    AtomicFileTest() {
        std::string name = (fs::temp_directory_path() / "splitcubes-core-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        folder_ = name;
    }
    ~AtomicFileTest() override {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
    }

    std::set<std::string> names() const {
        std::set<std::string> out;
        for (const auto& entry : fs::directory_iterator(folder_))
            out.insert(entry.path().filename().string());
        return out;
    }
    std::string text_of(const std::string& name) const {
        std::ifstream in(folder_ / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    void put(const std::string& name, const std::string& text) const {
        AtomicFile file(folder_ / name);
        file.write(text);
        file.commit();
    }

    fs::path folder_;
};

TEST_F(AtomicFileTest, AppearsOnlyAfterCommit) {
    AtomicFile file(folder_ / "a");
    file.write("new");
    file.stream().flush();
    EXPECT_FALSE(names().contains("a"));
    file.commit();
    EXPECT_EQ(names(), std::set<std::string>{"a"});
    EXPECT_EQ(text_of("a"), "new");
}

TEST_F(AtomicFileTest, ReplacesAndLeavesNothingElse) {
    put("a", "an old and long one");
    put("a", "new");
    EXPECT_EQ(names(), std::set<std::string>{"a"});
    EXPECT_EQ(text_of("a"), "new");
}

TEST_F(AtomicFileTest, WithoutCommitTheTargetIsUnchanged) {
    put("a", "old");
    { AtomicFile(folder_ / "a").write("new"); }
    { AtomicFile(folder_ / "b").write("new"); }
    EXPECT_EQ(names(), std::set<std::string>{"a"});
    EXPECT_EQ(text_of("a"), "old");
}

TEST_F(AtomicFileTest, TwoWritersDoNotMix) {
    AtomicFile one(folder_ / "a"), two(folder_ / "a");
    one.write("one");
    two.write("second");
    one.commit();
    EXPECT_EQ(text_of("a"), "one");
    two.commit();
    EXPECT_EQ(text_of("a"), "second");
    EXPECT_EQ(names(), std::set<std::string>{"a"});
}

// A temporary file that an earlier kill left behind does not disturb.
TEST_F(AtomicFileTest, IgnoresLeftoverTemporaryFiles) {
    std::ofstream(folder_ / ".splitcubes-0.tmp") << "left";
    put("a", "new");
    EXPECT_EQ(text_of("a"), "new");
    EXPECT_EQ(text_of(".splitcubes-0.tmp"), "left");
}

// The child process ends without running destructors.
TEST_F(AtomicFileTest, AKillLeavesTheTargetUnchanged) {
    put("a", "old");
    const pid_t child = fork();
    if (child == 0) {
        AtomicFile file(folder_ / "a");
        file.write(std::string(1 << 20, 'x'));
        file.stream().flush();
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(text_of("a"), "old");
    for (const std::string& name : names()) EXPECT_TRUE(name == "a" || name.ends_with(".tmp")) << name;
}

TEST_F(AtomicFileTest, ReadableAsOtherNewFiles) {
    put("a", "new");
    std::ofstream(folder_ / "b") << "plain";
    EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::status(folder_ / "b").permissions());
}

TEST_F(AtomicFileTest, AFolderIsRefused) {
    fs::create_directory(folder_ / "f");
    EXPECT_THROW(AtomicFile(folder_ / "f"), InputError);
    EXPECT_THROW(AtomicFile(folder_ / "nowhere" / "a"), InputError);
}

TEST_F(AtomicFileTest, AWholeChainOfLinksIsWrittenThrough) {
    fs::create_directories(folder_ / "far" / "off");
    put("far/off/real", "old");
    fs::create_symlink("off/real", folder_ / "far" / "second");  // relative to the link's folder
    fs::create_symlink(folder_ / "far" / "second", folder_ / "first");
    put("first", "new");
    EXPECT_EQ(text_of("far/off/real"), "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "first"));
    EXPECT_TRUE(fs::is_symlink(folder_ / "far" / "second"));
    EXPECT_EQ(names(), (std::set<std::string>{"far", "first"}));
}

TEST_F(AtomicFileTest, ALinkToNothingCreatesItsTargetIfTheFolderExists) {
    fs::create_directory(folder_ / "far");
    fs::create_symlink("far/new", folder_ / "link");
    put("link", "text");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(text_of("far/new"), "text");
    fs::create_symlink("nowhere/new", folder_ / "lost");
    try {
        AtomicFile file(folder_ / "lost");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("nowhere"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("lost is a link"), std::string::npos) << error.what();
    }
    EXPECT_TRUE(fs::is_symlink(folder_ / "lost"));
}

TEST_F(AtomicFileTest, CyclicLinksAreRefused) {
    fs::create_symlink("b", folder_ / "a");
    fs::create_symlink("a", folder_ / "b");
    EXPECT_THROW(AtomicFile(folder_ / "a"), InputError);
    EXPECT_EQ(names(), (std::set<std::string>{"a", "b"}));
}

TEST_F(AtomicFileTest, ALinkToAFolderOrADeviceIsRefused) {
    fs::create_directory(folder_ / "f");
    fs::create_symlink("f", folder_ / "folder");
    fs::create_symlink("/dev/null", folder_ / "device");
    EXPECT_THROW(AtomicFile(folder_ / "folder"), InputError);
    EXPECT_THROW(AtomicFile(folder_ / "device"), InputError);
    EXPECT_THROW(AtomicFile("/dev/null"), InputError);
}

TEST_F(AtomicFileTest, KeepsThePermissionsOfTheReplacedFile) {
    put("a", "old");
    fs::permissions(folder_ / "a", fs::perms::owner_read | fs::perms::owner_write);
    put("a", "new");
    EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(AtomicFileTest, UnwritableTargetsAreRefusedInAdvance) {
    put("a", "old");
    fs::create_symlink("nowhere/a", folder_ / "lost");
    for (const char* name : {"nowhere/a", "lost", "a/b", "."})
        EXPECT_THROW(check_file_target(folder_ / name), InputError) << name;
    EXPECT_THROW(check_file_target(folder_ / std::string(300, 'x')), InputError);
    EXPECT_THROW(check_file_target("/proc/a"), InputError);
    EXPECT_NO_THROW(check_file_target(folder_ / "a"));
    EXPECT_NO_THROW(check_file_target(folder_ / "b"));
    EXPECT_EQ(names(), (std::set<std::string>{"a", "lost"}));
}

TEST_F(AtomicFileTest, ANameThatIsTooLongIsBadInput) {
    EXPECT_THROW(AtomicFile(folder_ / std::string(300, 'x')), InputError);
    EXPECT_NO_THROW(AtomicFile(folder_ / std::string(255, 'x')).commit());
}

}  // namespace
}  // namespace splitcubes
