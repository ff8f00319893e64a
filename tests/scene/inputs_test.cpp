#include <splitcubes/core/error.h>
#include <splitcubes/core/sha256.h>
#include <splitcubes/scene/inputs.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

namespace splitcubes::scene {
namespace {

namespace fs = std::filesystem;

class Inputs : public testing::Test {
  protected:
    Inputs() {
        std::string name = (fs::temp_directory_path() / "splitcubes-scene-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        folder_ = name;
        put("a.obj", "one");
        put("b.obj", "two");
        put("p.pgm", "picture");
    }
    ~Inputs() override {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
    }

    void put(const std::string& name, const std::string& text) const {
        fs::create_directories((folder_ / name).parent_path());
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    SceneDescription parse(const std::string& text, const std::vector<std::string>& overrides = {}) const {
        return parse_scene_text(text, "s.json", folder_, overrides);
    }
    SceneDescription found() const {
        SceneDescription out = parse(text_);
        find_inputs(out);
        return out;
    }
    static std::string refusal(const std::function<void()>& call) {
        try {
            call();
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    }

    const std::string text_ = R"({"bodies": [
        {"name": "x", "shape": {"mesh": {"file": "a.obj"}},
         "material": {"tearing": {"strength": 1, "strength_map": [{"paint": {"picture": "p.pgm"}}]}}},
        {"name": "y", "shape": {"box": {"size": [1, 1, 1]}}}],
        "colliders": [{"name": "z", "shape": {"mesh": {"file": "b.obj"}}}]})";
    fs::path folder_;
};

TEST_F(Inputs, AreIdentifiedByContent) {
    SceneDescription scene = found();
    const std::vector<Input> inputs = inputs_of(scene);
    ASSERT_EQ(inputs.size(), 3U);
    for (const Input& input : inputs) EXPECT_EQ(*input.sha256, sha256_of_file(*input.file));
    EXPECT_EQ(inputs[0].what, "the mesh of body 'x'");
    EXPECT_EQ(inputs[1].what, "the picture of the strength of body 'x'");
    EXPECT_EQ(inputs[2].what, "the mesh of collider 'z'");
    // They are unchanged after a round trip, in any folder.
    const std::string relative = resolved_scene(scene, folder_ / "deeper").dump();
    EXPECT_NE(relative.find("\"../a.obj\""), std::string::npos) << relative;
    EXPECT_EQ(relative.find(folder_.string()), std::string::npos);
    SceneDescription back = parse_scene_text(relative, "s.json", folder_ / "deeper");
    back.folder = scene.folder;
    EXPECT_EQ(back, scene);
}

TEST_F(Inputs, AreFoundUnderOtherNames) {
    const std::string text = resolved_scene(found(), folder_).dump();
    const std::string wanted = resolved_scene(without_file_names(found())).dump();
    put("else/where/renamed.obj", "one");
    put("else/a.obj", "another");
    put("else/b.obj", "two");
    put("else/p.pgm", "picture");
    for (const char* name : {"a.obj", "b.obj"}) fs::remove(folder_ / name);
    put("p.pgm", "another");
    const std::vector<fs::path> folders = {folder_ / "else/where", folder_ / "else"};
    SceneDescription scene = parse(text);
    find_inputs(scene, folders);
    EXPECT_EQ(std::get<MeshShape>(scene.bodies[0].shape).file, folder_ / "else/where/renamed.obj");
    EXPECT_EQ(*inputs_of(scene)[1].file, folder_ / "else/p.pgm");
    EXPECT_EQ(resolved_scene(without_file_names(scene)).dump(), wanted);
    // Only missing files are searched.
    put("b.obj", "two");
    scene = parse(text);
    find_inputs(scene, folders);
    EXPECT_EQ(*inputs_of(scene)[2].file, folder_ / "b.obj");
}

TEST_F(Inputs, MissingOrChangedOnesAreNamed) {
    const std::string text = resolved_scene(found(), folder_).dump();
    const std::string hash = sha256_of_file(folder_ / "a.obj");
    const auto look = [&](const std::vector<fs::path>& folders) {
        return refusal([&] {
            SceneDescription scene = parse(text);
            find_inputs(scene, folders);
        });
    };
    put("a.obj", "changed");
    EXPECT_NE(look({}).find("a.obj: has changed"), std::string::npos) << look({});
    fs::remove(folder_ / "a.obj");
    for (const std::string& part : {(folder_ / "a.obj").string() + ": there is no such file",
                                    std::string("the mesh of body 'x'"), hash, std::string("--inputs")})
        EXPECT_NE(look({}).find(part), std::string::npos) << look({});
    EXPECT_NE(look({folder_}).find("no file with the same content is in " + folder_.string()),
              std::string::npos);
    EXPECT_NE(look({folder_ / "nowhere"}).find("nowhere: there is no such folder"), std::string::npos);
    // Without a required SHA-256 a file must exist.
    EXPECT_NE(refusal([&] { parse(text_); }).find("a.obj"), std::string::npos);
    // A required SHA-256 does not apply to the file of an override.
    EXPECT_NE(refusal([&] { parse(text, {"bodies[0].shape.mesh.file=c.obj"}); }).find("c.obj"),
              std::string::npos);
    EXPECT_TRUE(
        std::get<MeshShape>(parse(text, {"bodies[0].shape.mesh.file=b.obj"}).bodies[0].shape).sha256.empty());
    EXPECT_EQ(
        std::get<MeshShape>(
            parse(text, {"bodies[0].shape={\"mesh\": {\"file\": \"b.obj\", \"sha256\": \"" + hash + "\"}}"})
                .bodies[0]
                .shape)
            .sha256,
        hash);
    EXPECT_NE(refusal([&] { parse(text, {"bodies[0].shape.mesh.sha256=abc"}); }).find("not a SHA-256"),
              std::string::npos);
}

}  // namespace
}  // namespace splitcubes::scene
