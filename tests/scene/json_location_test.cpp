#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/scene/json_location.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <scene/full_scene.h>
#include <algorithm>
#include <nlohmann/json.hpp>

namespace splitcubes::scene {
namespace {

std::string json_error_of(std::string_view text, int max_depth = 32) {
    try {
        check_json(text, "file", max_depth);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

// Writes a random value with random line breaks and comments, and records the line of every member and
// element.
class RandomText {
  public:
    explicit RandomText(std::uint64_t seed) : random_(seed) {
        space();
        value({}, 0);
        space();
    }

    std::string text;
    std::vector<std::pair<JsonPath, int>> lines;

  private:
    void space() {
        static const std::vector<std::string> pieces = {"",     " ",           "\n", "\t", "/* { \n \" */",
                                                        "\r\n", "// [ \" : \n"};
        for (std::uint32_t n = random_.below(3); n > 0; --n) add(pieces[random_.below(7)]);
    }
    void add(const std::string& piece) {
        text += piece;
        line_ += static_cast<int>(std::count(piece.begin(), piece.end(), '\n'));
    }
    void leaf() {
        static const std::vector<std::string> leaves = {
            "1",    "-0.5e-3",    "true",        "null", "[]",
            "\"\"", "\"a\\\"{\"", "\"\\u00e9\"", "{ }",  "\"\\ud83d\\ude00\""};
        add(leaves[random_.below(10)]);
    }
    void value(const JsonPath& path, int depth) {
        const std::uint32_t kind = depth > 4 ? 2 : random_.below(3);
        if (kind == 2) return leaf();
        const std::uint32_t count = 1 + random_.below(4);
        for (std::uint32_t i = 0; i < count; ++i) {
            add(i > 0 ? "," : kind == 0 ? "{" : "[");
            space();
            const std::string key = "k" + std::to_string(i);
            JsonPath inner = path;
            inner.push_back(kind == 0 ? PathStep{key, -1} : PathStep{"", static_cast<int>(i)});
            lines.emplace_back(inner, line_);
            if (kind == 0) {
                add("\"" + key + "\"");
                space();
                add(":");
                space();
            }
            value(inner, depth + 1);
            space();
        }
        add(kind == 0 ? "}" : "]");
    }

    Random random_;
    int line_ = 1;
};

TEST(JsonLocation, finds_the_line_of_every_value) {
    std::size_t checked = 0;
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        const RandomText random(seed);
        ASSERT_EQ(json_error_of(random.text), "") << random.text;
        ASSERT_TRUE(nlohmann::json::accept(random.text, true)) << random.text;
        for (const auto& [path, line] : random.lines) {
            ASSERT_EQ(line_of(random.text, path), line) << to_string(path) << "\n" << random.text;
            ++checked;
        }
    }
    EXPECT_GT(checked, 1000u);
}

TEST(JsonLocation, missing_values_have_the_line_of_the_enclosing_value) {
    const std::string text = "{\n\"a\": {\n\"b\": [\n1,\n2]}}";
    EXPECT_EQ(line_of(text, parse_path("a.b[1]", "")), 5);
    EXPECT_EQ(line_of(text, parse_path("a.b[2]", "")), 3);
    EXPECT_EQ(line_of(text, parse_path("a.c", "")), 2);
    EXPECT_EQ(line_of(text, parse_path("c", "")), 1);
}

// The check accepts nothing that the JSON library refuses, and refuses nothing that it accepts, apart from
// the stricter rules.
TEST(JsonLocation, agrees_with_the_json_library_on_damaged_texts) {
    const std::string good = full_scene;
    const std::string alphabet = "{}[]\",:-+.eE019tfn\\u/* \n\x01\x80\xC3\xE2\xF0";
    Random random(7);
    int accepted = 0;
    int refused = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        std::string text = good;
        for (std::uint64_t n = 1 + random.bits() % 3; n > 0; --n) {
            const std::size_t at = random.bits() % text.size();
            const char put = alphabet[random.bits() % alphabet.size()];
            const std::uint64_t how = random.bits() % 4;
            if (how == 0) text.erase(at, 1);
            if (how == 1) text.insert(at, 1, put);
            if (how == 2) text[at] = put;
            if (how == 3 && random.bits() % 8 == 0) text.resize(at + 1);
        }
        const std::string error = json_error_of(text);
        const bool library = nlohmann::json::accept(text, true);
        const bool stricter =
            error.find("twice") != std::string::npos || error.find("deep") != std::string::npos;
        ASSERT_TRUE((error.empty() == library) || stricter) << error << "\n" << text;
        ++(error.empty() ? accepted : refused);
    }
    EXPECT_GT(accepted, 1000);
    EXPECT_GT(refused, 1000);
}

TEST(JsonLocation, names_line_problem_and_remedy) {
    using testing::HasSubstr;
    EXPECT_THAT(json_error_of("{\n\"a\": 1\n\"b\": 2}"),
                HasSubstr("file:3:1: ',' or '}' is missing before '\"'"));
    EXPECT_THAT(json_error_of("{\"a\": 1,\n}"), HasSubstr("file:2"));
    EXPECT_THAT(json_error_of("{\"a\": 1,\n}"), HasSubstr("remove the comma"));
    EXPECT_THAT(json_error_of("[1,\n]"), HasSubstr("remove the comma"));
    EXPECT_THAT(json_error_of("{\"a\":1,\n\n\"a\":2}"),
                HasSubstr("file:3:1: key 'a' stands twice in one object, first on line 1"));
    EXPECT_THAT(json_error_of("\n[01]"), HasSubstr("file:2:2: '01' is not a number"));
    EXPECT_THAT(json_error_of("[1e999]"), HasSubstr("number 1e999 is out of range"));
    EXPECT_THAT(json_error_of("[yes]"), HasSubstr("there is 'yes'"));
    EXPECT_THAT(json_error_of("/* \n"), HasSubstr("a comment that is not closed"));
    EXPECT_THAT(json_error_of("[\"abc\n"), HasSubstr("not closed by a quote"));
    EXPECT_THAT(json_error_of("[\"\x80\"]"), HasSubstr("not UTF-8"));
    EXPECT_THAT(json_error_of(""), HasSubstr("no JSON value"));
    EXPECT_THAT(json_error_of("{} 3"), HasSubstr("after the end"));
}

TEST(JsonLocation, escaped_keys_are_the_same_key) {
    EXPECT_NE(json_error_of(R"({"a": 1, "\u0061": 2})"), "");
}

TEST(JsonLocation, nesting_is_bounded) {
    const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
    EXPECT_EQ(json_error_of(nested(33)), "");
    EXPECT_THAT(json_error_of(nested(34)), testing::HasSubstr("32 deep"));
    EXPECT_NE(json_error_of(std::string(1000000, '[')), "");
    std::string keys = "{\"x\":0";
    for (int i = 0; i < 2000; ++i) keys += ",\"" + std::to_string(i) + "\":0";
    EXPECT_THAT(json_error_of(keys + "}"), testing::HasSubstr("more than 1000 keys"));
    const auto long_key = [](std::size_t length) { return "{\n\"" + std::string(length, 'k') + "\": 1}"; };
    EXPECT_EQ(json_error_of(long_key(1000)), "");
    EXPECT_THAT(json_error_of(long_key(1001)), testing::HasSubstr("file:2:1: a key has 1001 bytes"));
}

TEST(JsonPath, round_trips) {
    for (const std::string text : {"a", "a.b", "bodies[0].shape", "a[12][3].c-d._e", "$schema"}) {
        EXPECT_EQ(to_string(parse_path(text, "w")), text);
    }
}

TEST(JsonPath, refuses_invalid_paths) {
    for (const std::string text : {"", ".", "a.", "a..b", "[0]", "a[", "a[]", "a[-1]", "a[1", "a[1]b", "a b",
                                   ".a", "a[99999999999]", "a[1x]"}) {
        EXPECT_THROW(parse_path(text, "w"), InputError) << text;
    }
}

}  // namespace
}  // namespace splitcubes::scene
