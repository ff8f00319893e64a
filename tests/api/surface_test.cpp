// Laws of the surface stream: what the change ranges say is all that changes.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::api_tests {
namespace {

/// A copy that is only patched.
struct Copy {
    std::vector<std::int32_t> pieces, material, cuts, edges;
    std::vector<float> rest, uv;
    std::vector<std::uint32_t> triangles;
    std::vector<SurfaceOrigin> origins;
    std::size_t patched = 0;

    template <class T, class Values>
    static void patch(std::vector<T>& out, Values values, std::span<const Range> ranges, std::size_t each) {
        out.resize(values.size());
        for (const Range& r : ranges)
            std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(each * r.first), each * r.count,
                        out.begin() + static_cast<std::ptrdiff_t>(each * r.first));
    }
    void patch(const SurfaceView& s) {
        patch(pieces, s.pieces, s.changed_vertices, 1);
        patch(rest, s.rest_positions, s.changed_vertices, 3);
        patch(triangles, s.triangles, s.changed_triangles, 3);
        patch(origins, s.origins, s.changed_triangles, 1);
        patch(material, s.triangle_material, s.changed_triangles, 1);
        patch(cuts, s.cuts, s.changed_triangles, 1);
        patch(edges, s.edges, s.changed_triangles, 1);
        if (!s.corner_uv.empty()) patch(uv, s.corner_uv, s.changed_triangles, 6);
        for (const Range& r : s.changed_triangles) patched += r.count;
    }
    void expect_equal(const SurfaceView& s) const {
        EXPECT_TRUE(std::ranges::equal(pieces, s.pieces));
        EXPECT_TRUE(std::ranges::equal(rest, s.rest_positions));
        EXPECT_TRUE(std::ranges::equal(triangles, s.triangles));
        EXPECT_TRUE(std::ranges::equal(origins, s.origins));
        EXPECT_TRUE(std::ranges::equal(material, s.triangle_material));
        EXPECT_TRUE(std::ranges::equal(cuts, s.cuts));
        EXPECT_TRUE(std::ranges::equal(edges, s.edges));
        EXPECT_TRUE(std::ranges::equal(uv, s.corner_uv));
    }
};

// A slot that is used before and after and is not marked as new stands for the same vertex.
void expect_same_vertices(const Copy& before, const SurfaceView& after) {
    std::vector<std::uint8_t> is_new(after.vertex_slots(), 0);
    for (const Range& r : after.new_vertices)
        std::fill_n(is_new.begin() + static_cast<std::ptrdiff_t>(r.first), r.count, std::uint8_t{1});
    for (std::size_t v = 0; v < after.vertex_slots(); ++v) {
        const bool was = v < before.pieces.size() && before.pieces[v] >= 0, is = after.pieces[v] >= 0;
        if (!was && is) {
            EXPECT_EQ(is_new[v], 1) << v;
        }
        if (!was || !is || is_new[v]) continue;
        for (std::size_t k = 3 * v; k < 3 * v + 3; ++k)
            ASSERT_NEAR(before.rest[k], after.rest_positions[k], 0.021);
    }
}

void expect_ascending(std::span<const Range> ranges, std::size_t size) {
    std::size_t last = 0;
    for (const Range& r : ranges) {
        EXPECT_GT(r.count, 0U);
        EXPECT_GE(r.first, last);
        last = r.first + r.count;
    }
    EXPECT_LE(last, size);
}

// The material of each triangle by its own sign of x; textured by position.
struct Textured {
    BoxMesh box{0.2, 0.2, 0.2};
    std::vector<float> uv;
    std::vector<std::int32_t> material;

    Textured() {
        for (std::size_t t = 0; t < box.triangles.size() / 3; ++t) {
            material.push_back(static_cast<std::int32_t>(t % 2));
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t axis = 0; axis < 2; ++axis)
                    uv.push_back(
                        static_cast<float>(box.positions[3 * box.triangles[3 * t + k] + axis] * 5 + 0.5));
        }
    }
    MeshView view() const { return {box.positions, box.triangles, uv, material}; }
};

TEST(SurfaceView, APatchedCopyEqualsTheWhole) {
    SimulationSettings settings = in_free_space();
    settings.contact.pieces = true;
    Simulation simulation(settings);
    const Textured mesh;
    const BodyId block = simulation.add_body(mesh.view(), soft_block());
    Copy copy;
    copy.patch(simulation.surface(block));
    copy.expect_equal(simulation.surface(block));
    const std::size_t all = copy.patched;
    std::uint64_t revision = simulation.surface(block).revision;
    std::size_t largest = 0;
    const auto follow = [&](const StepResult&) {
        const SurfaceView surface = simulation.surface(block);
        expect_same_vertices(copy, surface);
        const bool changed = !surface.changed_triangles.empty();
        EXPECT_EQ(surface.revision, revision + changed);
        revision = surface.revision;
        expect_ascending(surface.changed_vertices, surface.vertex_slots());
        expect_ascending(surface.changed_triangles, surface.triangle_slots());
        expect_ascending(surface.new_vertices, surface.vertex_slots());
        copy.patched = 0;
        copy.patch(surface);
        largest = std::max(largest, copy.patched);
        copy.expect_equal(surface);
    };
    // Cuts that cross, so that vertices and quads are made again.
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
    simulation.lower_tool(knife);
    cut_through(simulation, knife, 0.003, 20, follow);
    simulation.remove_tool(knife);
    const std::array<Vector3, 2> edge{Vector3{-0.3, 0.003, 0}, Vector3{0.3, 0.03, 0}};
    const ToolId other = simulation.add_tool({edge}, {.pose = {{0, 0, 0.2}, {}}});
    simulation.lower_tool(other);
    cut_through(simulation, other, 0, 20, follow);
    EXPECT_GE(simulation.piece_count(block), 4U);
    EXPECT_LT(largest, all / 3) << "what a step changes is a part of the whole";
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.044).view());
    follow({});
}

TEST(SurfaceView, RevisionsShowWhatWasMissed) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const std::uint64_t before = simulation.surface(block).revision;
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.004).view());
    EXPECT_EQ(simulation.surface(block).revision, before + 1);
    simulation.step();
    EXPECT_EQ(simulation.surface(block).revision, before + 1);
    EXPECT_TRUE(simulation.surface(block).changed_triangles.empty());
}

TEST(SurfaceView, TexturesAndMaterialsGoAlong) {
    Simulation simulation(in_free_space());
    const Textured mesh;
    const BodyId block = simulation.add_body(mesh.view(), soft_block());
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.004).view());
    const std::vector<std::string> names = simulation.material_names(block);
    ASSERT_EQ(names.size(), 3U);
    EXPECT_EQ(names[2], "cut");
    const SurfaceView surface = simulation.surface(block);
    std::size_t cut = 0, boundary = 0;
    for (std::size_t t = 0; t < surface.triangle_slots(); ++t) {
        const std::uint32_t* v = &surface.triangles[3 * t];
        if (v[0] == v[1]) continue;
        if (surface.origins[t] == SurfaceOrigin::cut) {
            ++cut;
            EXPECT_EQ(surface.triangle_material[t], 2);
            continue;
        }
        ++boundary;
        EXPECT_LT(surface.triangle_material[t], 2);
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(surface.corner_uv[6 * t + 2 * k], surface.rest_positions[3 * v[k]] * 5 + 0.5, 0.06);
    }
    EXPECT_GT(cut, 100U);
    EXPECT_GT(boundary, 1000U);
}

TEST(SurfaceView, AFileHoldsAPieceOrAll) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.004).view());
    const std::string file = testing::TempDir() + "api_piece.ply";
    simulation.write_surface(block, file, 1);
    Simulation other(in_free_space());
    const BodyId piece = other.add_body(file, soft_block());
    EXPECT_EQ(other.piece_count(piece), 1U);
    EXPECT_EQ(kind_of_error([&] { simulation.write_surface(block, file, 2); }),
              static_cast<int>(ErrorKind::invalid_argument));
}

}  // namespace
}  // namespace splitcubes::api_tests
