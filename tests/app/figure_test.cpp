// figure: every drawing is written, is well-formed, and equals the one in the documents.
#include "app/program.h"

#include <cctype>
#include <cmath>
#include <cstdlib>

namespace splitcubes::app_test {
namespace {

class Figures : public Program {
  protected:
    std::vector<std::string> names() const {
        const Ended listed = run({"figure", "--list"});
        EXPECT_EQ(listed.code, 0) << listed.err;
        std::vector<std::string> out;
        for (const std::string& line : lines_of(listed.out))
            if (line.find("PNG") == std::string::npos) out.push_back(line.substr(0, line.find(':')));
        return out;
    }
    std::string drawn(const std::string& name) const {
        const Ended ended = run({"figure", name, "-o", name + ".svg"});
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(lines_of(ended.out).size(), 1U);
        return text_of(in(name + ".svg"));
    }
};

// Returns why the text is not well-formed XML, for the subset that the drawings use; empty if it is.
std::string malformed(const std::string& xml) {
    std::vector<std::string> open;
    std::size_t elements = 0;
    for (std::size_t at = 0; at < xml.size();) {
        if (xml[at] != '<') {
            if (xml[at] == '>') return "a bare >";
            if (xml[at] == '&' && xml.compare(at, 4, "&lt;") != 0 && xml.compare(at, 4, "&gt;") != 0 &&
                xml.compare(at, 5, "&amp;") != 0)
                return "a bare &";
            if (open.empty() && !std::isspace(static_cast<unsigned char>(xml[at]))) return "text outside";
            ++at;
            continue;
        }
        const std::size_t end = xml.find('>', at);
        if (end == std::string::npos) return "a tag that does not end";
        const std::string tag = xml.substr(at + 1, end - at - 1);
        at = end + 1;
        if (tag.empty() || tag.find('<') != std::string::npos) return "a < in a tag";
        if (std::count(tag.begin(), tag.end(), '"') % 2 != 0) return "an odd quote in " + tag;
        if (tag[0] == '/') {
            if (open.empty() || open.back() != tag.substr(1))
                return "</" + tag.substr(1) + "> closes nothing";
            open.pop_back();
            continue;
        }
        if (open.empty() && elements > 0) return "a second root";
        ++elements;
        if (tag.back() != '/') open.push_back(tag.substr(0, tag.find_first_of(" \n")));
    }
    if (!open.empty()) return open.back() + " is not closed";
    return elements == 0 ? "nothing" : "";
}

TEST(WellFormed, DetectsMalformedText) {
    EXPECT_EQ(malformed("<a b=\"1\"><c/>x &lt; y</a>\n"), "");
    for (const char* bad : {"", "<a>", "<a></b>", "<a/><a/>", "<a b=\"1/>", "<a>&nbsp;</a>", "x<a/>", "<a"})
        EXPECT_NE(malformed(bad), "") << bad;
}

TEST_F(Figures, AreWellFormedDrawings) {
    const std::vector<std::string> all = names();
    EXPECT_GE(all.size(), 5U);
    for (const std::string& name : all) {
        const std::string svg = drawn(name);
        EXPECT_EQ(malformed(svg), "") << name;
        EXPECT_EQ(svg.rfind("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", 0), 0U) << name;
        EXPECT_GT(lines_of(svg).size(), 30U) << name;
        for (const char* wrong : {"nan", "inf", "-0\"", "-0,"})
            EXPECT_EQ(svg.find(wrong), std::string::npos) << name << ": " << wrong;
        EXPECT_EQ(svg, drawn(name)) << name;
    }
    EXPECT_EQ(unfinished_files(), 0U);
}

// Splits a text into its numbers and the text between them.
void split(const std::string& text, std::vector<double>& numbers, std::string& between) {
    const char* at = text.c_str();
    while (*at != '\0') {
        const bool number = std::isdigit(static_cast<unsigned char>(*at)) ||
                            (*at == '-' && std::isdigit(static_cast<unsigned char>(at[1])));
        char* end = nullptr;
        if (number) {
            numbers.push_back(std::strtod(at, &end));
            between += '#';
            at = end;
        } else {
            between += *at++;
        }
    }
}

// Compares up to a last digit, which another maths library may round differently.
TEST_F(Figures, InTheDocumentsAreUpToDate) {
    for (const std::string& name : names()) {
        fs::path kept = fs::path(SPLITCUBES_DOCS) / "images" / "splitting-cubes" / (name + ".svg");
        if (!fs::exists(kept))
            kept = fs::path(SPLITCUBES_DOCS) / "images" / "occlusion-disks" / (name + ".svg");
        std::vector<double> new_numbers, old_numbers;
        std::string new_text, old_text;
        split(drawn(name), new_numbers, new_text);
        split(text_of(kept), old_numbers, old_text);
        const std::string remake = "remake it: splitcubes figure " + name + " -o " + kept.string();
        ASSERT_EQ(new_text, old_text) << remake;
        ASSERT_EQ(new_numbers.size(), old_numbers.size()) << remake;
        for (std::size_t i = 0; i < new_numbers.size(); ++i)
            ASSERT_LT(std::abs(new_numbers[i] - old_numbers[i]), 0.015) << remake;
    }
}

// Invariants of the numbers in the figure: zero beyond a complete cut; the kernel before it.
TEST_F(Figures, WeightsAsNumbers) {
#ifndef SPLITCUBES_WITH_RENDER
    GTEST_SKIP() << "built without pictures";
#endif
    const Ended ended = run({"figure", "weights", "-o", "weights.png", "--csv", "weights.csv"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const std::vector<std::string> rows = lines_of(text_of(in("weights.csv")));
    ASSERT_EQ(rows.size(), 1U + 3 * 4 * 61 * 61);
    std::size_t beyond = 0, before = 0;
    for (std::size_t k = 1; k < rows.size(); ++k) {
        std::istringstream row(rows[k]);
        std::string cut, criterion;
        char comma = ',';
        double x = 0, y = 0, weight = -1;
        std::getline(row, cut, ',');
        std::getline(row, criterion, ',');
        row >> x >> comma >> y >> comma >> weight;
        EXPECT_GE(weight, 0);
        EXPECT_LE(weight, 1);
        if (cut == "complete" && x > 0.51) {
            EXPECT_EQ(weight, 0) << rows[k];
            ++beyond;
        }
        if (x < -0.2 && criterion != "occlusion-disk") {
            const double h = 0.3 * (6 + 4 * std::sqrt(2.0)), r2 = x * x + y * y;
            EXPECT_NEAR(weight, r2 < h * h ? std::pow(1 - r2 / (h * h), 3) : 0, 1e-4) << rows[k];
            ++before;
        }
    }
    EXPECT_GT(beyond, 1000U);
    EXPECT_GT(before, 1000U);
}

TEST_F(Figures, RefusesUnknownNames) {
    expect_refused({"figure", "sketch", "-o", "a.svg"}, "sketch");
    expect_refused({"figure", "-o", "a.svg"}, "figure");
    expect_refused({"figure"}, "figure");
    expect_refused({"figure", "faces"}, "faces");
    expect_refused({"figure", "faces", "-o", "faces.png"}, "faces.png");
    expect_refused({"figure", "faces", "-o", "nowhere/faces.svg"}, "nowhere");
    expect_refused({"figure", "faces", "--list"}, "--list");
    expect_refused({"figure", "faces", "-o", "faces.svg", "--csv", "faces.csv"}, "--csv");
    expect_refused({"figure", "weights", "-o", "weights.svg"}, "weights.svg");
    EXPECT_FALSE(fs::exists(in("a.svg")));
    expect_refused({"figure", "weights", "-o", "weights.png", "--csv", "nowhere/weights.csv"}, "nowhere");
    EXPECT_FALSE(fs::exists(in("weights.png")));
    EXPECT_FALSE(fs::exists(in("faces.png")));
    EXPECT_EQ(unfinished_files(), 0U);
}

}  // namespace
}  // namespace splitcubes::app_test
