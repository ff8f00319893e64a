#include <gtest/gtest.h>
#include <splitcubes/core/parallel.h>

#include <atomic>
#include <map>
#include <mutex>

using namespace splitcubes;

namespace {

class Counter : public Monitor {
  public:
    void begin(const std::string& stage) override { stages.push_back(stage); }
    void advance(std::size_t done, std::size_t total) override {
        ++advances;
        max_done = std::max(max_done.load(), done);
        of = total;
    }
    bool cancelled() const override { return advances >= limit; }

    std::vector<std::string> stages;
    std::atomic<std::size_t> advances{0}, max_done{0}, of{0};
    std::size_t limit = 1000000;
};

// Records the progress of each stage by name.
class Recorder : public Monitor {
  public:
    void begin(const std::string& stage) override {
        const std::lock_guard lock(mutex_);
        stage_ = stage;
    }
    void advance(std::size_t done, std::size_t total) override {
        const std::lock_guard lock(mutex_);
        const double now = static_cast<double>(done) / static_cast<double>(total);
        backwards += now < part[stage_];
        part[stage_] = now;
    }
    bool cancelled() const override { return false; }

    std::map<std::string, double> part;
    int backwards = 0;

  private:
    std::mutex mutex_;
    std::string stage_;
};

}  // namespace

TEST(Monitor, ProgressOfAStageNeverDecreases) {
    for (const int threads : {1, 4}) {
        Recorder recorder;
        Parallel parallel(threads);
        parallel.watch(&recorder);
        for (const char* stage : {"a", "b", "a"}) {
            parallel.begin(stage);
            for (int loop = 0; loop < 3; ++loop)
                parallel.for_each(200, 1, [&](std::size_t i) {
                    if (i % 50 == 0) parallel.for_each(50, 1, [](std::size_t) {});
                });
            parallel.for_each(7, 1, [](std::size_t) {});
        }
        EXPECT_EQ(recorder.backwards, 0);
        std::vector<std::string> names;
        for (const auto& [name, part] : recorder.part) {
            names.push_back(name);
            EXPECT_EQ(part, 1) << name;
        }
        EXPECT_EQ(names, (std::vector<std::string>{"a", "a, pass 2", "a, pass 3", "a, pass 4", "a, pass 5",
                                                   "a, pass 6", "b", "b, pass 2", "b, pass 3"}));
    }
}

TEST(Monitor, ReceivesStagesAndEveryChunk) {
    for (const int threads : {1, 3}) {
        Counter counter;
        Parallel parallel(threads);
        parallel.watch(&counter);
        parallel.begin("first");
        parallel.for_each(1000, 10, [](std::size_t) {});
        EXPECT_EQ(counter.stages, std::vector<std::string>{"first"});
        EXPECT_EQ(counter.advances, 100U);
        EXPECT_EQ(counter.max_done, 100U);
        EXPECT_EQ(counter.of, 100U);
        parallel.watch(nullptr);
        parallel.begin("second");
        parallel.for_each(1000, 10, [](std::size_t) {});
        EXPECT_EQ(counter.stages.size(), 1U);
        EXPECT_EQ(counter.advances, 100U);
    }
}

TEST(Monitor, EndsALoopAtTheNextChunk) {
    for (const int threads : {1, 3}) {
        Counter counter;
        counter.limit = 20;
        Parallel parallel(threads);
        parallel.watch(&counter);
        std::atomic<std::size_t> visited{0};
        EXPECT_THROW(parallel.for_each(100000, 10, [&](std::size_t) { ++visited; }), Cancelled);
        EXPECT_LE(visited, 10 * (counter.limit + static_cast<std::size_t>(threads)));
        EXPECT_THROW(parallel.begin("next"), Cancelled);
        EXPECT_THROW(parallel.check(), Cancelled);
        EXPECT_TRUE(counter.stages.empty());
        // The same threads can be used again.
        parallel.watch(nullptr);
        visited = 0;
        parallel.for_each(1000, 10, [&](std::size_t) { ++visited; });
        EXPECT_EQ(visited, 1000U);
    }
}
