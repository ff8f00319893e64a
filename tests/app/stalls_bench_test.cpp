#include "program.h"

#include <nlohmann/json.hpp>

#include <set>

namespace splitcubes::app_test {
namespace {

class StallsBench : public Program {};

// Every key that docs/reports.md lists, with consistent figures.
TEST_F(StallsBench, ReportsTheDocumentedKeys) {
    const Ended ended = run(
        {"bench", "stalls", "--world", "paper", "--runs", "2", "--threads", "1", "--json", "stalls.json"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const auto json = nlohmann::json::parse(text_of(in("stalls.json")));
    EXPECT_EQ(json, nlohmann::json::parse(lines_of(ended.out).back()));
    EXPECT_EQ(json.at("bench"), "stalls");
    EXPECT_EQ(json.at("threads"), 1);
    EXPECT_EQ(json.at("runs"), 2);
    ASSERT_EQ(json.at("worlds").size(), 1U);
    const nlohmann::json& world = json["worlds"][0];
    std::set<std::string> keys;
    for (const auto& [key, value] : world.items()) {
        keys.insert(key);
        EXPECT_TRUE(!value.is_number() || value.get<double>() >= 0) << key;
    }
    EXPECT_EQ(keys, (std::set<std::string>{"world", "phyxels", "pieces", "steps", "cutting_steps",
                                           "median_ms", "cutting_median_ms", "last_ms", "longest_step",
                                           "longest_ms", "longest_processor_ms", "stages"}));
    EXPECT_EQ(world.at("world"), "paper");
    EXPECT_GE(world.at("pieces"), 2);
    EXPECT_GT(world.at("cutting_steps"), 0);
    EXPECT_LT(world.at("cutting_steps"), world.at("steps"));
    EXPECT_LE(world.at("longest_step"), world.at("steps"));
    EXPECT_GE(world.at("longest_ms"), world.at("cutting_median_ms"));
    EXPECT_GE(world.at("longest_ms"), world.at("last_ms"));
    EXPECT_EQ(world.at("stages").size(), 12U);
    double sum = 0;
    for (const auto& [name, stage] : world["stages"].items()) {
        EXPECT_GE(stage.at("max_ms"), stage.at("in_longest_step_ms")) << name;
        sum += stage.at("in_longest_step_ms").get<double>();
    }
    EXPECT_NEAR(sum, world.at("longest_ms"), 1e-6 * sum);
}

TEST_F(StallsBench, KnowsItsWorlds) {
    expect_refused({"bench", "stalls", "--world", "somewhere"}, "somewhere");
}

}  // namespace
}  // namespace splitcubes::app_test
