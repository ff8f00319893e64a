// Random scenes: the same everywhere, of the promised variety, and accepted by the program.
#include "hand_made_run.h"

#include "torture/generator.h"

#include <splitcubes/scene/parse.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace splitcubes::torture {
namespace {

namespace fs = std::filesystem;

Limits own_models() {
    Limits out;
    for (const char* name : {"liver.obj", "pear.obj"})
        out.models.push_back(fs::path(SPLITCUBES_MODEL_FOLDER) / name);
    return out;
}

// FNV-1a of the scene and its meshes.
std::uint64_t hash_of(const GeneratedScene& generated) {
    std::string text = generated.scene.dump();
    for (const auto& [name, content] : generated.files) text += name + content;
    std::uint64_t out = 0xcbf29ce484222325ULL;
    for (const char c : text) out = (out ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    return out;
}

TEST(Generator, TheSameSeedGivesTheSameScene) {
    std::set<std::uint64_t> hashes;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const std::uint64_t hash = hash_of(make_scene(seed, own_models()));
        EXPECT_EQ(hash, hash_of(make_scene(seed, own_models())));
        hashes.insert(hash);
    }
    EXPECT_EQ(hashes.size(), 20U);
}

// A change of the generator changes what seeds mean, in reports and in the corpus.
TEST(Generator, SeedsKeepTheirScenes) {
    std::uint64_t all = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) all = all * 31 + hash_of(make_scene(seed, own_models()));
    EXPECT_EQ(all, 7218472198581815074U);
}

TEST(Generator, ScenesAreValid) {
    const TemporaryFolder folder;
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        write_scene(make_scene(seed, own_models()), folder.path());
        try {
            scene::parse_scene_file(folder.path() / "scene.json");
        } catch (const std::exception& error) {
            ADD_FAILURE() << "seed " << seed << ": " << error.what();
        }
    }
}

TEST(Generator, ScenesAreAsVariedAsPromised) {
    constexpr int count = 600;
    int explicit_ = 0, contact = 0, corotated = 0, plastic = 0, tearing = 0, shaking = 0;
    std::vector<std::size_t> blades;
    std::set<std::string> features;
    for (std::uint64_t seed = 0; seed < count; ++seed) {
        const Json scene = make_scene(seed, own_models()).scene;
        const Json& material = scene["bodies"][0]["material"];
        EXPECT_GE(scene["frames"].get<int>(), 60);
        EXPECT_GE(scene["time_step"].get<double>(), 1e-3);
        EXPECT_LE(scene["time_step"].get<double>(), 1.0 / 30);
        EXPECT_GE(material["youngs_modulus"].get<double>(), 1e3);
        EXPECT_LT(material["youngs_modulus"].get<double>(), 1e8);
        blades.push_back(scene["tools"].size());
        explicit_ += scene["solver"]["kind"] == "explicit";
        contact += scene["contact"]["pieces"].get<bool>();
        corotated += material["model"] == "corotated";
        plastic += material.contains("plasticity");
        tearing += material.contains("tearing");
        if (scene.contains("constraints")) shaking += scene["constraints"][0]["kind"] == "move";
        for (const char* name : {"ground", "colliders", "handles", "constraints"})
            if (scene.contains(name)) features.insert(name);
    }
    std::sort(blades.begin(), blades.end());
    EXPECT_NEAR(static_cast<double>(blades[count / 2]), 40, 8);
    EXPECT_LE(blades.back(), 300U);
    EXPECT_NEAR(explicit_, count / 3, 40);
    EXPECT_NEAR(contact, count / 2, 40);
    EXPECT_NEAR(corotated, count * 3 / 5, 40);
    EXPECT_NEAR(plastic, count / 4, 40);
    EXPECT_NEAR(tearing, count / 5, 40);
    EXPECT_NEAR(shaking, count / 5, 40);
    EXPECT_EQ(features.size(), 4U);
}

TEST(Generator, LeavesOutWhatItIsTold) {
    Limits limits = own_models();
    for (const std::string& name : feature_names()) limits.without.insert(name);
    limits.max_blades = 3;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const Json scene = make_scene(seed, limits).scene;
        EXPECT_EQ(scene["bodies"].size(), 1U);
        EXPECT_LE(scene["tools"].size(), 3U);
        for (const char* name : {"ground", "colliders", "handles", "constraints"})
            EXPECT_FALSE(scene.contains(name)) << name;
        EXPECT_EQ(scene["solver"]["kind"], "implicit");
        EXPECT_FALSE(scene["contact"]["pieces"].get<bool>());
        for (const char* name : {"plasticity", "tearing"})
            EXPECT_FALSE(scene["bodies"][0]["material"].contains(name)) << name;
    }
}

}  // namespace
}  // namespace splitcubes::torture
