#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <tetrahedra/cases.h>
#include <validation.h>

#include <filesystem>
#include <map>

namespace {

using namespace splitcubes;
using namespace splitcubes::tetrahedra;
using testing::HasSubstr;

const app::TetrahedraResults& written_results() {
    static const app::TetrahedraResults results = app::read_tetrahedra(SPLITCUBES_TETRAHEDRA_RESULTS);
    return results;
}

// A file in the folder of temporary files that goes with it.
struct TemporaryFile {
    TemporaryFile(const std::string& name, const std::string& text)
        : path(std::filesystem::path(testing::TempDir()) / name) {
        write_file(path, text);
    }
    ~TemporaryFile() { std::filesystem::remove(path); }
    std::filesystem::path path;
};

app::ValidationPoint point_of(const std::string& test, int across) {
    app::ValidationPoint point{test, across, 48, 1.5, 1, "m"};
    point.free = 40;
    return point;
}

// The coarse meshes of all cases. Fitted meshes are indifferent to rotation.
TEST(TetrahedraResults, AreThoseOfTheProgram) {
    std::map<std::string, double> error_of;
    for (const Case& item : validation_cases()) {
        if (item.across == 0) {
            EXPECT_EQ(written_results().fine.count(item.test), 1U) << item.test;
            continue;
        }
        const auto written = written_results().points.find({item.test, item.across});
        ASSERT_NE(written, written_results().points.end()) << item.test << ' ' << item.across;
        if (item.free_phyxels > 350) continue;
        for (const Order order : {Order::linear, Order::quadratic}) {
            const app::TetrahedraResults::Mesh& mesh =
                order == Order::linear ? written->second.linear : written->second.quadratic;
            const Outcome outcome = item.run(order, item.free_phyxels);
            EXPECT_NEAR(outcome.error(), mesh.error, 1e-8) << item.test << ' ' << item.across;
            EXPECT_EQ(outcome.free_nodes, mesh.free_nodes);
            EXPECT_NEAR(static_cast<double>(outcome.free_nodes), item.free_phyxels, 0.17 * item.free_phyxels);
            if (order == Order::linear) error_of[item.test + std::to_string(item.across)] = outcome.error();
        }
    }
    for (const char* across : {"3", "4"})
        EXPECT_NEAR(error_of[std::string("rotated cantilever") + across],
                    error_of[std::string("cantilever") + across], 1e-10);
}

// The finest meshes confirm what theory says, as far as it neglects neither ends nor edges.
TEST(TetrahedraResults, FineMeshesAgreeWithTheory) {
    for (const auto& [test, mesh] : written_results().fine)
        EXPECT_NEAR(mesh.error, 0, test.starts_with("cantilever nu") ? 0.06 : 0.04) << test;
}

TEST(ValidationTable, StandsInThePlaceOfTheOldOne) {
    const TemporaryFile document(
        "splitcubes_validation.md",
        "# Title\n\n| test | what |\n|---|---|\n\n| test | across | old |\n|---|---|---|\n"
        "| a | 2 | b |\n\nText.\n");
    const app::TableRows rows =
        app::validation_table({point_of("cantilever", 2), point_of("unknown", 2)}, written_results());
    const std::string text = app::with_table(document.path, rows);
    EXPECT_TRUE(text.starts_with("# Title\n\n| test | what |\n|---|---|\n\n| test | across | phyxels |"))
        << text;
    EXPECT_TRUE(text.ends_with(" |\n\nText.\n")) << text;
    EXPECT_THAT(
        text,
        HasSubstr("\n| cantilever | 2 | 48 | 40 | 1.5 | 1 | m | +50.0 | | 40 | -65.6 | 36 | -13.5 | 2 |\n"
                  "| cantilever | fine | | | | | | | | | | 11830 | -1.8 | |\n"
                  "| unknown | 2 | 48 | 40 | 1.5 | 1 | m | +50.0 | | | | | | |\n"));
    EXPECT_EQ(app::with_table(document.path, rows), text);
    EXPECT_THAT(app::table_text(rows, true), HasSubstr("| unknown    |      2 |"));
    EXPECT_EQ(app::validation_table({point_of("cantilever", 2)}, {}).back().size(), 9U);
}

TEST(ValidationTable, TwiceAsSoftIsAsFarOffAsTwiceAsStiff) {
    EXPECT_DOUBLE_EQ(app::deviation(2), 1);
    EXPECT_DOUBLE_EQ(app::deviation(0.5), 1);
    EXPECT_EQ(app::deviation(1), 0);
    EXPECT_GT(app::deviation(-0.1), 1e9);  // no positive ratio is as bad
}

TEST(ValidationTable, OtherFilesAreRefused) {
    const TemporaryFile document("splitcubes_other.md", "# Title\n");
    EXPECT_THROW(app::with_table(document.path, {{"test"}}), InputError);
    EXPECT_THROW(app::with_table(document.path / "missing", {{"test"}}), InputError);
    const TemporaryFile json("splitcubes_other.json", R"({"points": [{"test": "tension"}], "fine": []})");
    EXPECT_THROW(app::read_tetrahedra(json.path), InputError);
    EXPECT_THROW(app::read_tetrahedra(document.path), InputError);
}

TEST(ValidationPlot, HasALineForPhyxelsAndEachElement) {
    const std::vector<app::ValidationPoint> points{point_of("cantilever", 2), point_of("cantilever", 3)};
    const auto circles = [&](const app::TetrahedraResults& results) {
        const std::string svg = app::error_plot(points, results);
        std::size_t count = 0;
        for (std::size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1))
            ++count;
        return count;
    };
    EXPECT_EQ(circles({}), 2U + 2);  // two in the legend for each line
    EXPECT_EQ(circles(written_results()), 6U + 6);
}

}  // namespace
