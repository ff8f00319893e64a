#include "program.h"

#include <nlohmann/json.hpp>

#include <set>

namespace splitcubes::app_test {
namespace {

class ContactBench : public Program {};

// Every key that docs/reports.md lists, with consistent figures.
TEST_F(ContactBench, ReportsTheDocumentedKeys) {
    const Ended ended = run({"bench", "contact", "--world", "near its strength", "--runs", "1", "--threads",
                             "1", "--json", "contact.json"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const auto json = nlohmann::json::parse(text_of(in("contact.json")));
    EXPECT_EQ(json, nlohmann::json::parse(lines_of(ended.out).back()));
    EXPECT_EQ(json.at("bench"), "contact");
    EXPECT_EQ(json.at("threads"), 1);
    EXPECT_EQ(json.at("runs"), 1);
    ASSERT_EQ(json.at("worlds").size(), 1U);
    const nlohmann::json& world = json["worlds"][0];
    std::set<std::string> keys;
    for (const auto& [key, value] : world.items()) {
        keys.insert(key);
        EXPECT_TRUE(!value.is_number() || value.get<double>() >= 0) << key;
    }
    EXPECT_EQ(keys, (std::set<std::string>{"world", "phyxels", "pieces", "steps", "contacts_a_step",
                                           "torn_edges_a_step", "whole_median_ms", "stages",
                                           "contacts_in_integrate_median_ms", "contact_and_tearing_share",
                                           "whole_mean_ms", "mean_contact_and_tearing_share", "cutting_steps",
                                           "cutting_median_ms", "cutting_contact_and_tearing_share"}));
    EXPECT_EQ(world.at("world"), "near its strength");
    EXPECT_GT(world.at("contacts_a_step"), 0);
    double sum = 0;
    for (const auto& [name, stage] : world.at("stages").items()) {
        const double ms = stage.at("median_ms"), whole = world.at("whole_median_ms");
        EXPECT_NEAR(stage.at("share"), ms / whole, 1e-6) << name;
        sum += ms;
    }
    EXPECT_EQ(world["stages"].size(), 12U);
    EXPECT_GT(sum, 0);
    const double share = (world["stages"].at("detect_contacts").at("median_ms").get<double>() +
                          world["stages"].at("tear").at("median_ms").get<double>() +
                          world.at("contacts_in_integrate_median_ms").get<double>()) /
                         world.at("whole_median_ms").get<double>();
    EXPECT_NEAR(world.at("contact_and_tearing_share"), share, 1e-6);
    EXPECT_GT(world.at("whole_mean_ms"), 0);
    EXPECT_GT(world.at("mean_contact_and_tearing_share"), 0);
    EXPECT_LT(world.at("mean_contact_and_tearing_share"), 1);
    EXPECT_GT(world.at("cutting_steps"), 0);
    EXPECT_LT(world.at("cutting_steps"), world.at("steps"));
    EXPECT_GT(world.at("cutting_median_ms"), 0);
    EXPECT_LT(world.at("cutting_contact_and_tearing_share"), 1);
}

TEST_F(ContactBench, KnowsItsWorlds) {
    expect_refused({"bench", "contact", "--world", "somewhere"}, "somewhere");
}

}  // namespace
}  // namespace splitcubes::app_test
