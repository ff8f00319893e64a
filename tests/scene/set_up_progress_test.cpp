// Progress that a monitor receives during the construction of a world.
#include <splitcubes/core/random.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <mutex>

namespace splitcubes::scene {
namespace {

class StageRecorder : public Monitor {
  public:
    void begin(const std::string& stage) override {
        const std::lock_guard lock(mutex_);
        stage_ = stage;
    }
    void advance(std::size_t done, std::size_t total) override {
        const std::lock_guard lock(mutex_);
        const double now = static_cast<double>(done) / static_cast<double>(total);
        if (now < part_[stage_]) backwards += stage_ + "; ";
        part_[stage_] = now;
        ++heard;
    }
    bool cancelled() const override { return false; }

    std::string backwards;
    int heard = 0;

  private:
    std::mutex mutex_;
    std::string stage_;
    std::map<std::string, double> part_;
};

std::string random_body(Random& random, int number) {
    const auto length = [&] { return std::to_string(random.uniform(0.3, 1)); };
    const char* const closed[] = {R"({"box": {"size": [LENGTH, LENGTH, LENGTH]}})",
                                  R"({"sphere": {"radius": LENGTH}})",
                                  R"({"implicit": {"cells": 25, "smoothness": 0.1, "parts": [
            {"ball": {"center": [0, 0, 0], "radii": [LENGTH, LENGTH, LENGTH], "colour": [1, 0, 0]}},
            {"ball": {"center": [0.2, 0, 0], "radii": [LENGTH, LENGTH, LENGTH], "colour": [0, 1, 0]}}]}})"};
    std::string shape = closed[number % 3];
    for (std::size_t at = shape.find("LENGTH"); at != std::string::npos; at = shape.find("LENGTH"))
        shape.replace(at, 6, length());
    return R"({"name": "b)" + std::to_string(number) + R"(", "shape": )" + shape + R"(, "cells": )" +
           std::to_string(static_cast<int>(random.uniform(12, 30))) + R"(, "phyxel_count": )" +
           std::to_string(static_cast<int>(random.uniform(50, 2000))) + "}";
}

TEST(SetUpProgress, NoStageGoesBackwards) {
    Random random(5);
    for (const int threads : {1, 3}) {
        std::string bodies;
        for (int k = 0; k < 6; ++k) bodies += (k > 0 ? "," : "") + random_body(random, k);
        StageRecorder recorder;
        const auto parallel = std::make_shared<Parallel>(threads);
        parallel->watch(&recorder);
        BuildReport report;
        build_world(parse_scene_text("{\"bodies\": [" + bodies + "]}", "x.json", "/"), parallel, report);
        EXPECT_EQ(recorder.backwards, "");
        EXPECT_GT(recorder.heard, 100);
    }
}

}  // namespace
}  // namespace splitcubes::scene
