#include <splitcubes/core/error.h>
#include <splitcubes/geometry/length_unit.h>

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace splitcubes::geometry {
namespace {

TEST(LengthUnit, HasTheRightFactor) {
    EXPECT_DOUBLE_EQ(length_unit("mm").to_metres(1), 1e-3);
    EXPECT_DOUBLE_EQ(length_unit("cm").to_metres(1), 1e-2);
    EXPECT_DOUBLE_EQ(length_unit("inch").to_metres(1), 0.0254);
    EXPECT_DOUBLE_EQ(length_unit("mm").volume_from_metres(1), 1e9);
    EXPECT_DOUBLE_EQ(length_unit("cm").area_from_metres(1), 1e4);
    EXPECT_TRUE(length_units().front().is_metre());
    std::set<std::string_view> names;
    for (const LengthUnit& unit : length_units()) {
        names.insert(unit.name);
        EXPECT_EQ(&length_unit(unit.name), &unit);
        EXPECT_EQ(unit.is_metre(), unit.name == "m");
        EXPECT_DOUBLE_EQ(unit.volume_to_metres(unit.volume_from_metres(0.7)), 0.7);
    }
    EXPECT_EQ(names.size(), length_units().size());
    EXPECT_THROW(length_unit("foot"), InputError);
    EXPECT_THROW(length_unit(""), InputError);
}

TEST(LengthUnit, ConversionsRoundTrip) {
    for (const LengthUnit& unit : length_units()) {
        SurfaceMesh surface;
        for (int k = 0; k < 1000; ++k) surface.mesh.positions.emplace_back(0.1 * k, -k / 7.0, 1e6 / (1 + k));
        surface.rest = surface.mesh.positions;
        const std::vector<Vec3> before = surface.rest;
        to_metres(surface.mesh, unit);
        EXPECT_DOUBLE_EQ(surface.mesh.positions[3][0], unit.to_metres(before[3][0]));
        surface.rest = surface.mesh.positions;
        from_metres(surface, unit);
        for (std::size_t k = 0; k < before.size(); ++k)
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_NEAR(surface.mesh.positions[k][axis], before[k][axis],
                            3e-16 * std::abs(before[k][axis]));
                EXPECT_EQ(surface.rest[k][axis], surface.mesh.positions[k][axis]);
            }
        if (unit.is_metre()) {
            EXPECT_EQ(surface.rest, before);
        }
    }
}

TEST(LengthUnit, AFactorScales) {
    TriangleMesh mesh{{{1, -2, 3}}, {}};
    scale(mesh, 1);
    EXPECT_EQ(mesh.positions[0], Vec3(1, -2, 3));
    scale(mesh, 2.5);
    EXPECT_EQ(mesh.positions[0], Vec3(2.5, -5, 7.5));
}

}  // namespace
}  // namespace splitcubes::geometry
