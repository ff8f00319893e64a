// A run as one animated GLB: the structure that the glTF 2.0 specification demands.
#include <gmock/gmock.h>
#include <splitcubes/core/error.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_animation.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <set>

#include "gltf_check.h"
#include "mesh_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using ::testing::HasSubstr;

namespace {

struct Glb {
    nlohmann::json json;
    std::string binary;

    explicit Glb(const std::string& bytes) {
        std::uint32_t json_bytes = 0;
        std::memcpy(&json_bytes, bytes.data() + 12, 4);
        json = nlohmann::json::parse(bytes.substr(20, json_bytes));
        if (bytes.size() > 20 + json_bytes) binary = bytes.substr(28 + json_bytes);
    }
    std::vector<float> numbers(std::size_t accessor) const {
        const auto& a = json["accessors"][accessor];
        EXPECT_EQ(a["componentType"], 5126);
        const auto& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
        std::vector<float> out(view["byteLength"].get<std::size_t>() / 4);
        std::memcpy(out.data(), binary.data() + view["byteOffset"].get<std::size_t>(), 4 * out.size());
        return out;
    }
    // Value of a node's scale at a time, by the rules of STEP.
    double scale_of(std::size_t node, double time) const {
        for (const auto& channel : json["animations"][0]["channels"]) {
            if (channel["target"]["node"] != node || channel["target"]["path"] != "scale") continue;
            const auto& sampler = json["animations"][0]["samplers"][channel["sampler"].get<std::size_t>()];
            EXPECT_EQ(sampler["interpolation"], "STEP");
            const std::vector<float> times = numbers(sampler["input"]), values = numbers(sampler["output"]);
            EXPECT_EQ(values.size(), 3 * times.size());
            std::size_t k = 0;
            while (k + 1 < times.size() && static_cast<double>(times[k + 1]) <= time) ++k;
            return static_cast<double>(values[3 * k]);
        }
        ADD_FAILURE() << "node " << node << " has no scale";
        return -1;
    }
};

TEST(WriteAnimation, OneFrameIsVisibleAtATime) {
    const TemporaryFolder folder;
    AnimationWriter writer(folder.path() / "run.glb");
    const std::vector<double> times = {0, 0.1, 0.25, 0.4};
    for (std::size_t k = 0; k < times.size(); ++k) writer.add_frame(times[k], box_surface(k));
    writer.finish();
    const Glb glb(folder.content("run.glb"));
    ASSERT_EQ(glb.json["nodes"].size(), 4u);
    for (const double t : {0.0, 0.05, 0.12, 0.3, 0.4, 9.0}) {
        double visible = 0;
        for (std::size_t n = 0; n < 4; ++n) {
            const bool is_its_turn = times[n] <= t && (n == 3 || t < times[n + 1]);
            EXPECT_EQ(glb.scale_of(n, t + 1e-6), is_its_turn ? 1 : 0) << n << " at " << t;
            visible += glb.scale_of(n, t + 1e-6);
        }
        EXPECT_EQ(visible, 1) << t;
    }
    EXPECT_FALSE(glb.json["nodes"][0].contains("scale")) << "it is what still pictures show";
    for (const auto& sampler : glb.json["animations"][0]["samplers"]) {
        const auto& input = glb.json["accessors"][sampler["input"].get<std::size_t>()];
        EXPECT_TRUE(input.contains("min") && input.contains("max"));
        EXPECT_EQ(input["count"], glb.json["accessors"][sampler["output"].get<std::size_t>()]["count"]);
    }
    EXPECT_EQ(glb.json["materials"].size(), 2u) << "those of all frames are the same";
    EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
    for (const auto& view : glb.json["bufferViews"]) {
        EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
        EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(),
                  glb.binary.size());
    }
    // A reader of meshes takes the first frame at its size, the others at none.
    EXPECT_EQ(read_mesh(folder.path() / "run.glb").positions.size(), 32u);
}

// Random runs: surfaces with and without attributes and triangles, solids that move, stand or have one frame.
TEST(WriteAnimation, FilesKeepToTheSpecification) {
    Random random(5);
    for (int n = 0; n < 40; ++n) {
        const TemporaryFolder folder;
        AnimationWriter writer(folder.path() / "run.glb");
        std::vector<double> times;
        const std::size_t frames = 1 + random.below(5);
        for (std::size_t k = 0; k < frames; ++k) {
            times.push_back((k == 0 ? 0 : times.back()) + random.uniform(1e-9, 0.5));
            geometry::SurfaceMesh surface = random.below(2) ? box_surface(n) : textured_surface(n + k);
            if (random.below(4) == 0) surface = {};
            writer.add_frame(times.back(), surface);
        }
        for (std::uint64_t s = random.below(3); s > 0; --s) {
            std::vector<Isometry> motion;
            for (std::size_t k = 0; k < frames; ++k) {
                Isometry frame = Isometry::Identity();
                frame.linear() =
                    Eigen::AngleAxisd(random.uniform(-4, 4),
                                      (Vec3::UnitX() + random.uniform(0, 1) * Vec3::UnitY()).normalized())
                        .toRotationMatrix();
                frame.translation() = Vec3(random.uniform(-1, 1), random.uniform(-1, 1), 0);
                motion.push_back(frame);
            }
            const std::size_t given = random.below(2) ? frames : 1;
            motion.resize(given);
            geometry::Material material;
            material.name = "solid";
            writer.add_solid("solid", box_mesh(), material,
                             {times.begin(), times.begin() + static_cast<std::ptrdiff_t>(given)}, motion);
        }
        writer.finish();
        EXPECT_EQ(GltfCheck(folder.content("run.glb")).faults(), "") << n;
    }
}

TEST(WriteAnimation, SolidsMoveAsTheyDid) {
    const TemporaryFolder folder;
    AnimationWriter writer(folder.path() / "run.glb");
    writer.add_frame(0, box_surface(0));
    writer.add_frame(1, box_surface(1));
    std::vector<Isometry> frames(2, Isometry::Identity());
    frames[1].translation() = Vec3(1, 2, 3);
    frames[1].linear() = Eigen::AngleAxisd(1.2, Vec3(1, 2, 2).normalized()).toRotationMatrix();
    geometry::Material steel;
    steel.name = "steel";
    steel.metalness = 1.0F;
    writer.add_solid("knife", box_mesh(), steel, {0, 1}, frames);
    writer.finish();
    const Glb glb(folder.content("run.glb"));
    const auto& node = glb.json["nodes"][2];
    EXPECT_EQ(node["name"], "knife");
    EXPECT_EQ(glb.json["materials"].back()["pbrMetallicRoughness"]["metallicFactor"], 1.0);
    for (const auto& channel : glb.json["animations"][0]["channels"]) {
        if (channel["target"]["node"] != 2) continue;
        const auto& sampler = glb.json["animations"][0]["samplers"][channel["sampler"].get<std::size_t>()];
        const std::vector<float> values = glb.numbers(sampler["output"].get<std::size_t>());
        if (channel["target"]["path"] == "translation") {
            EXPECT_EQ(std::vector<float>(values.begin() + 3, values.end()), (std::vector<float>{1, 3, -2}));
        } else {
            // A corner of the file, turned by the file's rotation, is the corner that the solid has.
            const Quat turn(values[7], values[4], values[5], values[6]);
            EXPECT_NEAR(turn.norm(), 1, 1e-6);
            const Vec3 corner(0.3, -0.2, 0.5), now = frames[1].linear() * corner;
            const Vec3 in_file = turn * Vec3(corner.x(), corner.z(), -corner.y());
            EXPECT_LT((in_file - Vec3(now.x(), now.z(), -now.y())).norm(), 1e-6);
        }
    }
}

TEST(WriteAnimation, WhatCannotBeWrittenIsRefused) {
    const TemporaryFolder folder;
    EXPECT_THROW(AnimationWriter(folder.path() / "none" / "run.glb"), InputError);
    AnimationWriter empty(folder.path() / "run.glb");
    EXPECT_THROW(empty.finish(), InputError);
    empty.add_frame(1, box_surface(0));
    EXPECT_THROW(empty.add_frame(1, box_surface(0)), InputError);
    EXPECT_EQ(folder.file_count(), 0u) << "nothing is written before the end";
    empty.add_frame(2, geometry::SurfaceMesh());
    empty.finish();
    EXPECT_EQ(Glb(folder.content("run.glb")).json["nodes"].size(), 1u) << "a frame without triangles";
}

}  // namespace
