// All problems of a scene are reported at once: faults inserted into valid scenes are reported, each on its
// line and no other line.
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/recording.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <scene/full_scene.h>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

namespace splitcubes::scene {
namespace {

using Json = nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> out;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) out.push_back(line);
    return out;
}

template <class Read>
std::vector<std::string> problems_of(const Read& read) {
    try {
        read();
    } catch (const InputError& error) {
        return lines_of(error.what());
    }
    return {};
}

std::vector<std::string> problems(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return problems_of([&] { parse_scene_text(text, "x.json", SPLITCUBES_SCENES, overrides); });
}

// A position where a fault can be inserted.
struct Spot {
    Json::json_pointer path;
    bool leaf = false;
};

void list_spots(const Json& json, const Json::json_pointer& path, std::vector<Spot>& out) {
    const bool inner = json.is_object() || json.is_array();
    out.push_back({path, !inner});
    if (json.is_object())
        for (const auto& item : json.items()) list_spots(item.value(), path / item.key(), out);
    if (json.is_array())
        for (std::size_t k = 0; k < json.size(); ++k) list_spots(json[k], path / k, out);
}

// Returns the same object with another name for one key.
Json renamed(const Json& object, const std::string& key, const std::string& as) {
    Json out = Json::object();
    for (const auto& item : object.items()) out[item.key() == key ? as : item.key()] = item.value();
    return out;
}

// Replaces a leaf by an invalid value. Returns a text that no other line has.
std::string plant_value(Json& leaf, int number, Random& random) {
    if (leaf.is_string()) {
        leaf = 77700 + number;
    } else if (leaf.is_number() && random.unit() < 0.5) {
        leaf = (number + 1) * 1e200;
    } else {
        leaf = "planted-" + std::to_string(number);
    }
    return leaf.dump();
}

// Inserts k faults in separate values. Returns the texts that mark their lines.
std::vector<std::string> plant(Json& scene, int k, Random& random) {
    std::vector<Spot> spots;
    list_spots(scene, Json::json_pointer(), spots);
    std::vector<std::string> marks;
    std::vector<std::pair<Json::json_pointer, std::string>> renames;
    std::set<std::size_t> used;
    while (static_cast<int>(marks.size()) < k) {
        const std::size_t at = static_cast<std::size_t>(random.unit() * static_cast<double>(spots.size()));
        if (!used.insert(at).second) continue;
        const int number = static_cast<int>(marks.size());
        Json& value = scene[spots[at].path];
        const std::string name = std::to_string(number);
        if (value.is_object() && random.unit() < 0.5) {
            value["zzqqkk" + name] = 0;
            marks.push_back("\"zzqqkk" + name);
        } else if (!spots[at].path.empty() && scene[spots[at].path.parent_pointer()].is_object() &&
                   random.unit() < 0.3) {
            // Last, as renaming changes the path to inner values.
            renames.emplace_back(spots[at].path, spots[at].path.back() + name);
            marks.push_back("\"" + renames.back().second + "\"");
        } else if (spots[at].leaf) {
            marks.push_back(plant_value(value, number, random));
        }
    }
    std::sort(renames.begin(), renames.end(), [](const auto& a, const auto& b) {
        return a.first.to_string().size() > b.first.to_string().size();  // innermost first
    });
    for (const auto& [path, as] : renames) {
        Json& parent = scene[path.parent_pointer()];
        parent = renamed(parent, path.back(), as);
    }
    return marks;
}

int line_with(const std::vector<std::string>& lines, const std::string& mark) {
    const auto found = std::find_if(lines.begin(), lines.end(), [&](const std::string& line) {
        return line.find(mark) != std::string::npos;
    });
    EXPECT_NE(found, lines.end()) << mark;
    return static_cast<int>(found - lines.begin()) + 1;
}

std::string read_file(const std::filesystem::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
}

void expect_planted_faults_are_found(const std::string& text, int repetitions, std::uint64_t seed) {
    const Json scene = Json::parse(text, nullptr, true, true);
    ASSERT_THAT(problems(scene.dump(1)), IsEmpty());
    Random random(seed);
    for (int round = 0; round < repetitions; ++round) {
        Json faulty = scene;
        const int k = 1 + round % 8;
        const std::vector<std::string> marks = plant(faulty, k, random);
        const std::string written = faulty.dump(1);
        const std::vector<std::string> lines = lines_of(written);
        std::vector<int> expected;
        for (const std::string& mark : marks) expected.push_back(line_with(lines, mark));
        std::sort(expected.begin(), expected.end());
        const std::vector<std::string> found = problems(written);
        ASSERT_THAT(found, SizeIs(marks.size())) << testing::PrintToString(found) << '\n' << written;
        for (std::size_t i = 0; i < found.size(); ++i)
            ASSERT_THAT(found[i], StartsWith("x.json:" + std::to_string(expected[i]) + ": "))
                << testing::PrintToString(found) << '\n'
                << written;
    }
}

TEST(SceneProblems, each_inserted_fault_is_reported_with_its_line_and_nothing_else) {
    expect_planted_faults_are_found(full_scene, 400, 1);
}

TEST(SceneProblems, faults_in_shipped_scenes_are_reported_too) {
    std::uint64_t seed = 2;
    for (const auto& entry : std::filesystem::directory_iterator(SPLITCUBES_SCENES))
        if (entry.path().extension() == ".json" && entry.path().stem() != "schema")
            expect_planted_faults_are_found(read_file(entry.path()), 24, seed++);
}

const std::string two_bodies = R"json({
  "bodies": [
    {"name": "a", "shape": {"sphere": {"radius": 1}}},
    {"name": "b", "shape": {"sphere": {"radius": 1}}}
  ],
  "constraints": [{"body": "b", "kind": "hold", "region": {"sphere": {"center": [0, 0, 0], "radius": 1}}}]
})json";

std::string with_line(const std::string& old_text, const std::string& new_text) {
    std::string text = two_bodies;
    return text.replace(text.find(old_text), old_text.size(), new_text);
}

TEST(SceneProblems, consequences_of_a_fault_are_not_reported) {
    EXPECT_THAT(problems(two_bodies), IsEmpty());
    // A misspelt key is unknown and missing; the name of a body is also used elsewhere.
    EXPECT_THAT(
        problems(with_line("\"radius\": 1", "\"size\": 1")),
        ElementsAre(HasSubstr("unknown key 'size'; 'radius' is needed and missing; known here: radius")));
    EXPECT_THAT(problems(with_line("\"name\": \"b\"", "\"name\": 3")), SizeIs(1));
    EXPECT_THAT(problems(with_line("\"name\": \"b\"", "\"nmae\": \"b\"")),
                ElementsAre(HasSubstr("did you mean 'name'?")));
    EXPECT_THAT(problems(with_line("\"sphere\": {\"radius\": 1}", "\"ball\": {\"radius\": 1}")), SizeIs(1));
    EXPECT_THAT(problems(with_line("\"shape\": {\"sphere\": {\"radius\": 1}}", "\"shape\": []")), SizeIs(1));
    EXPECT_THAT(problems("[]"), SizeIs(1));
    EXPECT_THAT(problems("{}"), ElementsAre("x.json:1: the scene has no 'bodies'; add it, it is needed"));
    // Two faults in one object are two problems.
    EXPECT_THAT(problems(with_line("\"radius\": 1", "\"size\": 1, \"colour\": 2")), SizeIs(2));
}

TEST(SceneProblems, missing_files_are_reported_together) {
    const std::string mesh = R"("shape": {"mesh": {"file": "missing.obj"}})";
    const std::string sphere = R"("shape": {"sphere": {"radius": 1}})";
    std::string text = with_line(sphere, mesh);
    text.replace(text.find(sphere), sphere.size(), mesh);
    EXPECT_THAT(problems(text), ElementsAre(HasSubstr("bodies[0].shape.mesh.file is \"missing.obj\""),
                                            HasSubstr("bodies[1].shape.mesh.file is \"missing.obj\"")));
}

TEST(SceneProblems, options_are_reported_after_the_lines_of_the_file) {
    EXPECT_THAT(problems(with_line("\"hold\"", "\"holt\""),
                         {"bodies[7].cells=3", "time_step=0", "no equals sign", "bodies[0].cels=9"}),
                ElementsAre(StartsWith("x.json:6: constraints[0].kind"),
                            HasSubstr("--set time_step=0: time_step is 0"),
                            HasSubstr("--set bodies[0].cels=9: bodies[0] has the unknown key 'cels'"),
                            HasSubstr("there is no element [7]"), HasSubstr("has no '='")));
    // An invalid override changes nothing.
    EXPECT_THAT(problems(two_bodies, {"camera.eye.deeper[2]=1"}), SizeIs(1));
}

TEST(SceneProblems, at_most_twenty_are_shown_and_the_others_counted) {
    Json scene = Json::parse(two_bodies);
    for (int k = 0; k < 998; ++k) scene["bodies"].push_back({{"name", k}});
    const std::vector<std::string> found = problems(scene.dump(1));
    ASSERT_THAT(found, SizeIs(21));
    EXPECT_EQ(found.back(), "x.json: and 980 more, at least");
    scene["bodies"].erase(scene["bodies"].begin() + 17, scene["bodies"].end());
    EXPECT_EQ(problems(scene.dump(1)).back(), "x.json: and 10 more");
    // Too many bodies are one problem, and none of them is read.
    for (int k = 0; k < 1000; ++k) scene["bodies"].push_back({{"name", k}});
    EXPECT_THAT(problems(scene.dump(1)), SizeIs(1));
}

TEST(SceneProblems, many_of_one_kind_do_not_hide_the_others) {
    Json scene = Json::parse(two_bodies);
    for (int k = 0; k < 300; ++k)
        scene["bodies"].push_back(
            {{"name", "n" + std::to_string(k)}, {"shape", {{"sphere", {{"radius", -1 - k}}}}}, {"kind", k}});
    scene["constraints"][0]["kind"] = "holt";
    scene["camera"] = {{"width", 3}};
    const std::vector<std::string> found = problems(scene.dump(1), {"time_step=7"});
    ASSERT_THAT(found, SizeIs(21)) << testing::PrintToString(found);
    EXPECT_THAT(found, testing::Contains(HasSubstr("constraints[0].kind")));
    EXPECT_THAT(found, testing::Contains(HasSubstr("camera.width")));
    EXPECT_THAT(found, testing::Contains(HasSubstr("--set time_step=7")));
    EXPECT_THAT(found, testing::Contains(HasSubstr("out of range (and 291 more like it); give a number")));
    EXPECT_THAT(found, testing::Contains(HasSubstr("unknown key 'kind' (and 292 more like it); known here")));
    EXPECT_EQ(found.back(), "x.json: and 583 more");
}

TEST(SceneProblems, numbers_out_of_double_range_are_problems_of_their_keys) {
    EXPECT_THAT(
        problems(with_line("\"radius\": 1", "\"radius\": 1e999, \"colour\": 2")),
        ElementsAre(StartsWith("x.json:3: bodies[0].shape.sphere.radius is 1e999, which is out of range"),
                    HasSubstr("unknown key 'colour'")));
    EXPECT_THAT(problems(with_line("[0, 0, 0]", "[0, -2e400, 1e-999]")),
                ElementsAre(HasSubstr("x.json:6: constraints[0].region.sphere.center[1] is -2e400"),
                            HasSubstr("center[2] is 1e-999, which is out of range")));
    // An override replaces it.
    EXPECT_THAT(
        problems(with_line("\"radius\": 1", "\"radius\": 1e999"), {"bodies[0].shape.sphere.radius=2"}),
        IsEmpty());
    EXPECT_THAT(problems("1e999"), SizeIs(1));
    // Only the first of very many are reported.
    std::string many = "[1e999";
    for (int k = 0; k < 5000; ++k) many += ",\n1e999";
    const std::vector<std::string> found = problems(with_line("[0, 0, 0]", many + "]"));
    ASSERT_THAT(found, SizeIs(21));
    EXPECT_THAT(found[0], StartsWith("x.json:6: constraints[0].region.sphere.center[0] is 1e999"));
    EXPECT_THAT(found[19], HasSubstr("center[19] is 1e999, which is out of range (and 980 more like it)"));
    EXPECT_THAT(problems_of([&] { parse_path_text(R"({"tools": [], "name": 1e999})", "x.json"); }),
                SizeIs(2));
}

TEST(SceneProblems, syntax_has_line_and_column) {
    EXPECT_THAT(problems("{\n  \"bodies\": [1 2]}"),
                ElementsAre(StartsWith("x.json:2:16: ',' or ']' is missing")));
    EXPECT_THAT(problems("{\"n\u00e9\": 01}"), ElementsAre(StartsWith("x.json:1:8: '01' is not a number")));
}

// No exponent if the user wrote none.
TEST(SceneProblems, numbers_are_shown_in_plain_notation) {
    const auto has_exponent = [](const std::string& text) {
        for (std::size_t k = 1; k + 1 < text.size(); ++k)
            if ((text[k] == 'e' || text[k] == 'E') && std::isdigit(static_cast<unsigned char>(text[k - 1])) &&
                (std::isdigit(static_cast<unsigned char>(text[k + 1])) || text[k + 1] == '+' ||
                 text[k + 1] == '-'))
                return true;
        return false;
    };
    const Json scene = Json::parse(full_scene);
    std::vector<Spot> spots;
    list_spots(scene, Json::json_pointer(), spots);
    std::size_t reported = 0;
    for (const Spot& spot : spots) {
        if (!spot.leaf || !scene[spot.path].is_number()) continue;
        // Out of range for almost every number of a scene, or for some.
        for (const double value : {-123456789012345.5, 20000000.0, 0.00002, -0.00001, 98765432.1}) {
            Json faulty = scene;
            faulty[spot.path] = value;
            for (const std::string& line : problems(faulty.dump(1))) {
                ++reported;
                EXPECT_FALSE(has_exponent(line)) << line;
            }
        }
    }
    EXPECT_GT(reported, 500U);
    EXPECT_THAT(problems(with_line("\"radius\": 1", "\"radius\": 20000000")),
                ElementsAre(HasSubstr(
                    "radius is 20000000, which is out of range; give a number above 0 to 10000000")));
    EXPECT_THAT(problems(with_line("[0, 0, 0]", "[0.00001, 0]")), ElementsAre(HasSubstr("[0.00001,0]")));
}

TEST(SceneProblems, path_files_and_recordings_too) {
    const std::string path = R"json({"tools": [
      {"name": "a", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 0, "x"]}}], "bodies": ["a"],
       "motion": {"path": {"keyframes": []}}},
      {"name": "b", "blades": [{"arc": {"radius": -1, "start_angle_degrees": 5, "end_angle_degrees": 5}}],
       "motion": {"path": {"keyframes": [{"time": 1}, {"time": 0}]}}}]})json";
    EXPECT_THAT(problems_of([&] { parse_path_text(path, "x.json"); }),
                ElementsAre(HasSubstr("a path has no bodies"), HasSubstr("x.json:2: tools[0].blades[0]"),
                            StartsWith("x.json:3: tools[0].motion.path.keyframes has 0 elements"),
                            HasSubstr("tools[1].blades[0].arc.radius"),
                            HasSubstr("tools[1].blades[0].arc has no length"),
                            StartsWith("x.json:5: tools[1].motion.path.keyframes[1].time")));
    const std::string recording = R"json({"format": "splitcubes recording 2", "frames": 0,
      "scene": )json" + two_bodies +
                                  R"json(,
      "tracks": [{"tool": "a", "times": [0, "x"], "places": [[1], [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]]}]})json";
    EXPECT_THAT(problems_of([&] { parse_recording(recording, "x.json", "."); }), SizeIs(4));
}

}  // namespace
}  // namespace splitcubes::scene
