#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <iterator>
#include <set>
#include <string>

namespace splitcubes::io {
namespace {

namespace fs = std::filesystem;

class WholeFile : public testing::Test {
  protected:
    WholeFile() {
        std::string name = (fs::temp_directory_path() / "splitcubes-io-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        folder_ = name;
    }
    ~WholeFile() override {
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

TEST_F(WholeFile, IsThereAfterTheCommitOnly) {
    AtomicFile file(folder_ / "a");
    file.write("new");
    file.stream().flush();
    EXPECT_FALSE(names().contains("a"));
    file.commit();
    EXPECT_EQ(names(), std::set<std::string>{"a"});
    EXPECT_EQ(text_of("a"), "new");
}

TEST_F(WholeFile, ReplacesAndLeavesNothingElse) {
    put("a", "an old and long one");
    put("a", "new");
    EXPECT_EQ(names(), std::set<std::string>{"a"});
    EXPECT_EQ(text_of("a"), "new");
}

TEST_F(WholeFile, WithoutCommitWhatWasThereStays) {
    put("a", "old");
    { AtomicFile(folder_ / "a").write("new"); }
    { AtomicFile(folder_ / "b").write("new"); }
    EXPECT_EQ(names(), std::set<std::string>{"a"});
    EXPECT_EQ(text_of("a"), "old");
}

TEST_F(WholeFile, TwoWritersDoNotMix) {
    AtomicFile one(folder_ / "a"), two(folder_ / "a");
    one.write("one");
    two.write("second");
    one.commit();
    EXPECT_EQ(text_of("a"), "one");
    two.commit();
    EXPECT_EQ(text_of("a"), "second");
    EXPECT_EQ(names(), std::set<std::string>{"a"});
}

// What an earlier kill left behind is in nobody's way.
TEST_F(WholeFile, PassesALeftOver) {
    std::ofstream(folder_ / ".splitcubes-0.tmp") << "left";
    put("a", "new");
    EXPECT_EQ(text_of("a"), "new");
    EXPECT_EQ(text_of(".splitcubes-0.tmp"), "left");
}

// In a process that ends without a destructor.
TEST_F(WholeFile, AKillLeavesWhatWasThere) {
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

TEST_F(WholeFile, ReadableAsOtherNewFiles) {
    put("a", "new");
    std::ofstream(folder_ / "b") << "plain";
    EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::status(folder_ / "b").permissions());
}

TEST_F(WholeFile, AFolderIsRefused) {
    fs::create_directory(folder_ / "f");
    EXPECT_THROW(AtomicFile(folder_ / "f"), InputError);
    EXPECT_THROW(AtomicFile(folder_ / "nowhere" / "a"), InputError);
}

}  // namespace
}  // namespace splitcubes::io
