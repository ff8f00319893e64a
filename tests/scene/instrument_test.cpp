// Solids of tools.
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/motion.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace splitcubes::scene {
namespace {

Vec3 random_vector(Random& random) {
    return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

ToolDescription random_tool(Random& random) {
    ToolDescription out;
    out.name = "t";
    PolylineBlade line;
    const double length = std::pow(10.0, random.uniform(-2.5, 0.5));
    const int points = 2 + static_cast<int>(random.uniform(0, 5));
    Vec3 at = random_vector(random);
    for (int k = 0; k < points; ++k) {
        line.points.push_back(at);
        at += length *
              Vec3(1 + 0.3 * random.uniform(-1, 1), 0.5 * random.uniform(-1, 1), 0.5 * random.uniform(-1, 1));
    }
    out.blades = {line};
    KeyframeMotion motion;
    for (int k = 0; k < 3; ++k)
        motion.keyframes.push_back(
            {0.5 * k, length * random_vector(random), {random_vector(random), random.uniform(-90, 90)}});
    out.motion = motion;
    out.active_until = 1;
    return out;
}

BladeInstrument blade_of(BladeKind kind) {
    BladeInstrument out;
    out.kind = kind;
    return out;
}

std::vector<InstrumentDescription> kinds() {
    return {blade_of(BladeKind::knife), blade_of(BladeKind::scalpel), blade_of(BladeKind::scissors),
            WireInstrument{}, SpoonInstrument{}};
}

TEST(Instrument, PartsAreClosedSolids) {
    Random random(11);
    for (int n = 0; n < 40; ++n) {
        ToolDescription tool = random_tool(random);
        for (const InstrumentDescription& kind : kinds()) {
            tool.instrument = kind;
            const std::vector<InstrumentPart> parts = instrument_parts(tool);
            ASSERT_FALSE(parts.empty());
            for (const InstrumentPart& part : parts) {
                EXPECT_GT(part.mesh.volume(), 0) << n << " kind " << kind.index();
                const geometry::MeshCheck check = geometry::check_mesh(part.mesh);
                EXPECT_TRUE(check.closed()) << n << " kind " << kind.index();
                for (const Vec3& p : part.mesh.positions) EXPECT_TRUE(p.allFinite());
            }
        }
    }
}

// What is drawn cuts where the blade does: no point of the edge is far from the solid.
TEST(Instrument, TheEdgeLiesOnTheSolid) {
    Random random(12);
    for (int n = 0; n < 20; ++n) {
        ToolDescription tool = random_tool(random);
        const auto& line = std::get<PolylineBlade>(tool.blades[0]).points;
        double length = 0;
        for (std::size_t k = 0; k + 1 < line.size(); ++k) length += (line[k + 1] - line[k]).norm();
        for (const InstrumentDescription& kind : kinds()) {
            tool.instrument = kind;
            const geometry::NearestPoint nearest(instrument_mesh(tool));
            for (const Vec3& p : line)
                EXPECT_LT(nearest.at({.point = p}).distance, 0.025 * length) << n << " kind " << kind.index();
        }
    }
}

TEST(Instrument, AKnifeTrailsBehindItsEdge) {
    ToolDescription tool;
    tool.blades = {StraightBlade{Vec3(0, -0.1, 0), Vec3(0, 0.1, 0)}};
    KeyframeMotion down;
    down.keyframes = {{0, Vec3(0, 0, 1), {}}, {1, Vec3(0, 0, 0), {}}};
    tool.motion = down;
    tool.active_until = 1;
    tool.instrument = BladeInstrument{};
    for (const InstrumentPart& part : instrument_parts(tool))
        EXPECT_GT(part.mesh.bounds().min.z(), -1e-9) << "below the edge that goes down";
    BladeInstrument without_handle;
    without_handle.handle = 0;
    tool.instrument = without_handle;
    EXPECT_EQ(instrument_parts(tool).size(), 1u);
}

TEST(Instrument, AToolWithoutOneHasNoParts) {
    EXPECT_TRUE(instrument_parts(ToolDescription{}).empty());
}

}  // namespace
}  // namespace splitcubes::scene
