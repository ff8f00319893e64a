#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <scene/full_scene.h>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace splitcubes::scene {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Overrides = std::vector<std::string>;

const std::string small_scene = R"json({
  // a comment
  "bodies": [
    {"name": "a",
     "shape": {"box": {"size": [1, 1, 1]}},
     "material": {
       "poisson_ratio": 0.3
     }}
  ]
})json";

SceneDescription parse(const std::string& text, const Overrides& overrides = {}) {
    return parse_scene_text(text, "x.json", SPLITCUBES_SCENES, overrides);
}

std::string error_of(const std::string& text, const Overrides& overrides = {}) {
    try {
        parse(text, overrides);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

std::string with(const std::string& old_text, const std::string& new_text) {
    std::string text = full_scene;
    const std::size_t at = text.find(old_text);
    EXPECT_NE(at, std::string::npos) << old_text;
    return text.replace(at, old_text.size(), new_text);
}

TEST(ParseScene, reads_every_field) {
    const SceneDescription s = parse(full_scene);
    EXPECT_EQ(s.name, "Everything");
    EXPECT_EQ(s.folder, std::filesystem::path(SPLITCUBES_SCENES).lexically_normal());
    EXPECT_EQ(s.time_step, 0.01);
    EXPECT_EQ(s.frames, 7);
    EXPECT_EQ(s.threads, 2);
    EXPECT_EQ(s.gravity, Vec3(0.5, 0, -3.71));
    EXPECT_EQ(s.ground, (GroundDescription{-0.25, 0.7}));
    ASSERT_EQ(s.bodies.size(), 12u);
    const PlacementDescription placement{Vec3(1, 2, 3), {Vec3(1, 1, 0), 33.3}, Vec3::Constant(0.1)};
    const TearingDescription tearing{2e4,
                                     0.5,
                                     1.5,
                                     {StrengthPatch{SlabRegion{Vec3(1, 2, 3), Vec3(1, 0, 0), 0.1}, 0.5},
                                      StrengthPatch{CylinderRegion{Vec3(1, 2, 2), Vec3(1, 2, 4), 0.1}, 2}}};
    EXPECT_EQ(s.bodies[0], (BodyDescription{"a",
                                            BoxShape{Vec3(1, 2, 3)},
                                            placement,
                                            20,
                                            {},
                                            99,
                                            {},
                                            {MaterialModel::st_venant_kirchhoff, 900, 1.25e4, 0.45, 1e3, 0.1,
                                             0.2, 0.05, PlasticityDescription{0.1, 2, 0.3}, tearing, 150},
                                            {},
                                            s.bodies[0].appearance,  // appearance_test.cpp
                                            Vec3(1, 0, 0.1),
                                            Vec3(0, 2, 0)}));
    BodyDescription b;
    b.name = "b";
    b.shape = SphereShape{0.5};
    b.cells.reset();
    b.cell_size = 0.05;
    b.phyxel_count.reset();
    b.phyxel_spacing = 0.1;
    EXPECT_EQ(s.bodies[1], b);
    EXPECT_EQ(s.bodies[2].shape, Shape(CylinderShape{0.5, 2}));
    EXPECT_EQ(s.bodies[3].shape, Shape(TorusShape{0.5, 0.125}));
    EXPECT_EQ(s.bodies[4].shape, Shape(CapsuleShape{0.5, 2}));
    EXPECT_EQ(s.bodies[5].shape, Shape(PearShape{0.7, 0.05}));
    const std::string content = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
    EXPECT_EQ(s.bodies[6].shape, Shape(MeshShape{s.folder / "schema.json", content}));
    EXPECT_EQ(s.bodies[6].material.tearing,
              (TearingDescription{100,
                                  0.6,
                                  {},
                                  {StrengthPaint{0.5, 2, {}},
                                   StrengthPaint{0.1, 1, SPLITCUBES_SCENES "/schema.json", content}}}));
    EXPECT_EQ(s.bodies[7].shape,
              Shape(ImplicitShape{0.02,
                                  50,
                                  {{BallPart{Vec3(0, 0, 1), Vec3(1, 2, 3)}, Vec3(1, 0, 0.5)},
                                   {ConePart{Vec3(0, 0, 0), Vec3(0, 0, 2), 1, 0.5}, Vec3(0.2, 0.4, 0.6)}}}));
    const std::vector<LatticeKeyframeDescription> lattice = {{0.1, {}},
                                                             {2, {{Vec3i(1, 2, 3), Vec3(0.1, 0, 0)}}}};
    EXPECT_EQ(s.bodies[7].deformation, DeformationDescription(FreeFormDescription{Vec3i(1, 2, 3), lattice}));
    EXPECT_EQ(s.bodies[8].deformation, DeformationDescription(MassSpringDescription{}));
    ASSERT_EQ(s.constraints.size(), 3u);
    EXPECT_EQ(s.constraints[0], (ConstraintDescription{"a",
                                                       BoxRegion{Vec3(0, 0, 0), Vec3(1, 1, 2)},
                                                       ConstraintKind::hold,
                                                       {},
                                                       Vec3(0.1, 0.2, 0.3),
                                                       0.1,
                                                       2.5,
                                                       Condition{"a", 4, {}, {}},
                                                       Condition{"b", 2, {}, {}},
                                                       Carrier{CarrierKind::collider, "c2", {}}}));
    const std::vector<MotionKeyframe> path = {{0.25, Vec3(1, 0, 0), {Vec3(0, 1, 0), 12}},
                                              {0.5, Vec3(0, 0, 0), {}}};
    EXPECT_EQ(s.constraints[1], (ConstraintDescription{"b",
                                                       SphereRegion{Vec3(0, 1, 0), 0.3},
                                                       ConstraintKind::move,
                                                       path,
                                                       Vec3(0, 1, 0),
                                                       0,
                                                       {},
                                                       {},
                                                       {},
                                                       {}}));
    EXPECT_EQ(s.constraints[2].region, Region(HalfSpaceRegion{Vec3(0, 0, 1), Vec3(0, 0, 2)}));
    EXPECT_EQ(s.constraints[2].pivot, Vec3(0, 0, 1));
    ASSERT_EQ(s.tools.size(), 7u);
    const std::vector<BladeDescription> blades = {
        PolylineBlade{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0.1)}},
        StraightBlade{Vec3(0, 0, -1), Vec3(0, 0, 1)}, ArcBlade{Vec3(1, 0, 0), 2, Vec3(0, 1, 0), -10, 50, 9}};
    const KeyframeMotion motion{{{1, Vec3(0, 0, 1), {}}, {2, Vec3(0, 0, 0), {}}}, Interpolation::smooth};
    ToolDescription tool;
    tool.name = "t1";
    tool.blades = blades;
    tool.bodies = {"a", "c"};
    tool.motion = motion;
    tool.active_from = 0.5;
    tool.active_until = 3;
    tool.side = 0.02;
    tool.friction = 0.4;
    tool.instrument = BladeInstrument{BladeKind::knife, 0.1, 0.01, 0.5, Grip::start, Vec3(0, 0, 1)};
    tool.finish = *finish_of_kind("steel");
    tool.grip_finish = geometry::Finish{};
    tool.grip_finish->colour = Vec3(0.1, 0.1, 0.1);
    tool.solid = SolidDescription{0.2};
    EXPECT_EQ(s.tools[0], tool);
    const CircularMotion circle{Vec3(0, 0, 1), Vec3(0, 0, -1), 0.4, 90, -1.5, 0.2, 1.2, false};
    EXPECT_EQ(s.tools[1].motion, Motion(circle));
    EXPECT_EQ(s.tools[1].active_from, 0.2);
    EXPECT_EQ(s.tools[1].active_until, 1.2);
    EXPECT_EQ(s.contact, (ContactDescription{true, 0.2, 0.7}));
    EXPECT_EQ(s.solver,
              (SolverDescription{SolverKind::explicit_steps, Integrator::backward_euler, 1e-4, 50}));
    EXPECT_EQ(s.occlusion, (OcclusionDescription{"cpu", 32, occlusion::CriterionKind::transparency}));
    EXPECT_EQ(s.output, (OutputDescription{3, SurfaceFormat::glb, true, true}));
    EXPECT_EQ(s.camera, (CameraDescription{Vec3(1, -4, 2), Vec3(0, 0, 1), Vec3(0, 1, 0.5), Vec3(0, 1, 1), 50,
                                           640, 480}));
}

TEST(ResolvedScene, parses_back_to_an_equal_description) {
    const std::vector<SceneDescription> scenes = {
        parse(full_scene), parse(small_scene), parse(full_scene, {"frames=null", "duration=0.123"}),
        parse(full_scene, {"camera=null", "ground=null",
                           "tools[0].motion={\"path\":{\"keyframes\":[{\"time\":1e-7}]}}"})};
    for (const SceneDescription& scene : scenes) {
        const std::string text = resolved_scene(scene).dump(2);
        EXPECT_EQ(parse(text), scene) << text;
        // File names are absolute, so the text means the same in another folder.
        SceneDescription elsewhere = parse_scene_text(text, "y.json", "/");
        elsewhere.folder = scene.folder;
        EXPECT_EQ(elsewhere, scene);
        EXPECT_EQ(resolved_scene(parse(text)).dump(), resolved_scene(scene).dump());
    }
    EXPECT_FALSE(scenes[0] == scenes[1]);
}

TEST(ParseScene, shipped_scenes_are_valid) {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(SPLITCUBES_SCENES)) {
        if (entry.path().extension() != ".json" || entry.path().filename() == "schema.json") continue;
        const SceneDescription scene = parse_scene_file(entry.path());
        const std::string text = resolved_scene(scene).dump(2);
        EXPECT_EQ(parse_scene_text(text, "r.json", scene.folder), scene) << entry.path();
        ++count;
    }
    EXPECT_GE(count, 3u);
}

TEST(ParseScene, messages_give_location_problem_and_remedy) {
    const auto small = [](const std::string& line) {
        std::string text = small_scene;
        const std::string old_line = "\"poisson_ratio\": 0.3";
        return error_of(text.replace(text.find(old_line), old_line.size(), line));
    };
    EXPECT_EQ(small("\"poisson_ratio\": 0.3"), "");
    EXPECT_EQ(
        small("\"yungs_modulus\": 1e5"),
        "x.json:7: bodies[0].material has the unknown key 'yungs_modulus'; did you mean 'youngs_modulus'?");
    EXPECT_EQ(small("\"poisson_ratio\": 0.7"),
              "x.json:7: bodies[0].material.poisson_ratio is 0.7, which is out of range; give a number from "
              "0 to 0.499");
    EXPECT_EQ(
        small("\"density\": 0"),
        "x.json:7: bodies[0].material.density is 0, which is out of range; give a number above 0 to 1000000");
    EXPECT_EQ(small("\"density\": \"heavy\""),
              "x.json:7: bodies[0].material.density is \"heavy\", a text; give a number above 0 to 1000000");
    EXPECT_EQ(
        small("\"density\": 1, \"density\": 2"),
        "x.json:7:22: key 'density' stands twice in one object, first on line 7; remove one of the two");
    EXPECT_EQ(small("\"density\": 1 \"x\""),
              "x.json:7:21: ',' or '}' is missing before '\"'; what it would end was opened on line 6");
    EXPECT_THAT(error_of("{\n\"frames\": 3}"), HasSubstr("x.json:1: the scene has no 'bodies'; add it"));
    EXPECT_THAT(error_of("[]"), HasSubstr("the scene is [], an array"));
}

TEST(ParseScene, related_values_must_be_consistent) {
    const std::vector<std::tuple<std::string, std::string, std::string>> cases = {
        {"\"frames\": 7", "\"frames\": 7, \"duration\": 1", "duration is given beside 'frames'"},
        {"\"cell_size\": 0.05", "\"cell_size\": 0.05, \"cells\": 3",
         "bodies[1].cell_size is given beside 'cells'"},
        {"\"phyxel_count\": 99", "\"phyxel_count\": 99, \"phyxel_spacing\": 1", "beside 'phyxel_count'"},
        {"\"name\": \"b\"", "\"name\": \"a\"", "bodies[1].name is \"a\", a name given before"},
        {"\"name\": \"t2\"", "\"name\": \"t1\"", "tools[1].name is \"t1\", a name given before"},
        {"\"name\": \"b\"", "\"name\": \"../b\"", "cannot be part of a file name"},
        {"\"name\": \"b\"", "\"name\": \"\"", "which is not a name"},
        {"\"body\": \"b\", \"region\"", "\"body\": \"bb\", \"region\"",
         "constraints[1].body is \"bb\", but no body has that name; there are a, b"},
        {"[\"a\", \"c\"]", "[\"a\", \"z\"]", "tools[0].bodies[1] is \"z\", but no body"},
        {"{\"time\": 0.5}", "{\"time\": 0.25}",
         "constraints[1].keyframes[1].time is 0.25, not after the keyframe"},
        {"\"keyframes\": [{\"time\": 1,", "\"keyframes\": [{\"time\": 2,",
         "keyframes[1].time is 2, not after"},
        {"\"until_time\": 2.5", "\"until_time\": 0.1", "constraints[0].until_time is not after from_time"},
        {"\"until_time\": 1.2", "\"until_time\": 0.2", "until_time is not after from_time"},
        {"\"active_until\": 3", "\"active_until\": 0.4", "makes the tool end before it starts"},
        {"\"max\": [1, 1, 2]", "\"max\": [1, 1, -2]", "region.box.max is less than min"},
        {"\"tube_radius\": 0.125", "\"tube_radius\": 0.5", "not below the ring_radius"},
        {"\"from\": [0, 0, -1]", "\"from\": [0, 0, 1]", "blades[1].straight has no length"},
        {"\"end_angle_degrees\": 50", "\"end_angle_degrees\": -10", "arc has no length"},
        {"\"axis\": [1, 1, 0]", "\"axis\": [0, 0, 0]", "too short for a direction"},
        {"\"disk_size\": 32", "\"disk_size\": 24", "occlusion.disk_size is 24; give 8, 16 or 32"},
        {"\"frames\": 7", "\"frames\": 7.5", "frames is 7.5, not a whole number"},
        {"\"width\": 640", "\"width\": 641", "camera.width is odd"},
        {"\"eye\": [1, -4, 2],", "", "camera has a target but no eye"},
        {"\"eye\": [1, -4, 2]", "\"eye\": [0, 0, 1]", "its eye at its target"},
        {"\"up\": [0, 1, 1]", "\"up\": [1, -4, 1]", "looks along its up direction"},
        {"\"size\": [1, 2, 3]", "\"size\": [1, 2]", "size has 2 elements: [1,2]; give an array of 3"},
        {"\"sphere\": {\"radius\": 0.5}", "\"sphere\": {\"radius\": 0.5}, \"pear\": {\"height\": 1}",
         "bodies[1].shape has 2 keys"},
        {"\"sha256\": \"0123", "\"sha256\": \"xyz0", "bodies[6].shape.mesh.sha256 is \"xyz0"},
        {"\"file\": \"schema.json\",\n     \"sha256\": "
         "\"0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef\"",
         "\"file\": \"none.obj\"", "bodies[6].shape.mesh.file is \"none.obj\", but there is no"},
        {"\"kind\": \"move\"", "\"kind\": \"hold\"", "keyframes is given, but the kind is \"hold\""},
        {"\"kind\": \"explicit\"", "\"kind\": \"magic\"", "solver.kind is \"magic\", which is unknown"},
        {"\"maximum\": 0.3", "\"maximum\": 0.5", "plasticity.maximum is 0.5; give at most 0.45"},
    };
    for (const auto& [old_text, new_text, message] : cases) {
        EXPECT_THAT(error_of(with(old_text, new_text)), AllOf(HasSubstr(message), HasSubstr("x.json:")))
            << new_text;
    }
}

TEST(ParseScene, a_duration_is_rounded_up_to_whole_steps) {
    const auto frames = [](const std::string& step, const std::string& duration) {
        return parse(small_scene, {"time_step=" + step, "duration=" + duration}).frames;
    };
    EXPECT_EQ(frames("0.016666666666666666", "1"), 60);
    EXPECT_EQ(frames("0.1", "0.3"), 3);
    EXPECT_EQ(frames("0.1", "0.31"), 4);
    EXPECT_EQ(frames("0.1", "1e-9"), 1);
    EXPECT_THAT(error_of(small_scene, {"time_step=1e-3", "duration=1e6"}),
                HasSubstr("more than 1000000 steps"));
}

TEST(Overrides, change_add_and_remove) {
    EXPECT_EQ(parse(full_scene, {"bodies[0].material.youngs_modulus=1e4"}).bodies[0].material.youngs_modulus,
              1e4);
    EXPECT_EQ(parse(small_scene, {"solver.tolerance=0.5"}).solver.tolerance, 0.5);
    EXPECT_EQ(parse(small_scene, {"output.format=obj"}).output.format, SurfaceFormat::obj);
    EXPECT_EQ(parse(small_scene, {"name=\"x y\""}).name, "x y");
    EXPECT_EQ(parse(small_scene, {"gravity=[0,0,1]", "gravity[1]=2"}).gravity, Vec3(0, 2, 1));
    EXPECT_EQ(parse(small_scene, {"threads=1", "threads=3"}).threads, 3);
    EXPECT_EQ(parse(full_scene, {"frames=null", "duration=1"}).frames, 100);
    EXPECT_EQ(parse(full_scene, {"ground=null"}).ground, std::nullopt);
    EXPECT_EQ(parse(small_scene, {"ground={}"}).ground, GroundDescription{});
}

// Keys that exclude each other: the override replaces the file's key, and that of an earlier override.
TEST(Overrides, replace_keys_that_exclude_each_other) {
    EXPECT_EQ(parse(full_scene, {"duration=1"}).frames, 100);
    EXPECT_EQ(parse(full_scene, {"duration=1", "frames=3"}).frames, 3);
    EXPECT_EQ(parse(full_scene, {"frames=3", "duration=1"}).frames, 100);
    EXPECT_EQ(parse(full_scene, {"duration=null"}).frames, parse(full_scene).frames);
    EXPECT_EQ(parse(full_scene, {"bodies[0].cell_size=0.25"}).bodies[0].cell_size, 0.25);
    EXPECT_EQ(parse(full_scene, {"bodies[1].cells=12"}).bodies[1].cells, 12);
    EXPECT_EQ(parse(full_scene, {"bodies[1].cells=12"}).bodies[1].cell_size, std::nullopt);
    EXPECT_EQ(parse(full_scene, {"bodies[0].phyxel_spacing=0.5"}).bodies[0].phyxel_count, std::nullopt);
    // Objects given as a whole are not changed.
    EXPECT_THAT(error_of(full_scene, {"bodies[1]={\"name\": \"b\", \"shape\": {\"sphere\": {\"radius\": 1}}, "
                                      "\"cells\": 9, \"cell_size\": 1}"}),
                HasSubstr("is given beside"));
}

// A value that is not JSON is a text, unless it begins like JSON.
TEST(Overrides, take_invalid_json_as_text) {
    for (const std::string word :
         {"2nd", "2nd try", "a,b", "1,5", "12x", "1e999", "-", "+3", ".5", "05", "nan", "truely",
          "it's \"quoted\"", "x: {y}", "caf\xC3\xA9", "../a b.obj", "/x", "'single'", "C:\\files"}) {
        EXPECT_EQ(parse(small_scene, {"name=" + word}).name, word);
        EXPECT_THAT(error_of(small_scene, {"time_step=" + word}),
                    AllOf(HasSubstr("time_step is "), HasSubstr(", a text; give a number above 0 to 1")))
            << word;
    }
    for (const std::string json : {"[1,2", "{\"a\" 1}", "\"open", " [", "[1e999]", "", " "}) {
        const std::string error = error_of(small_scene, {"name=" + json});
        EXPECT_THAT(error, HasSubstr("--set name=" + json + ": ")) << json;
        EXPECT_THAT(error, Not(HasSubstr("a text;"))) << json;
    }
    EXPECT_THAT(error_of(small_scene, {"name=\xff\xfe"}), HasSubstr("is not UTF-8"));
    // Valid JSON is not turned into text.
    EXPECT_THAT(error_of(small_scene, {"name=5"}), HasSubstr("name is 5, a number"));
    EXPECT_THAT(error_of(small_scene, {"name=true"}), HasSubstr("true or false"));
}

TEST(Overrides, errors_name_the_option) {
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"frames", "--set frames: has no '='"},
        {"=3", "--set =3: the path is empty"},
        {"frames=-1", "--set frames=-1: frames is -1, which is out of range"},
        {"contact.restitution=1.2",
         "--set contact.restitution=1.2: contact.restitution is 1.2, which is out of range"},
        {"frames=1x", "--set frames=1x: frames is \"1x\", a text; give a whole number from 1"},
        {"frames=", "--set frames=: there is no JSON value"},
        {"frames=duck", "--set frames=duck: frames is \"duck\", a text"},
        {"bodies[10].cells=3", "--set bodies[10].cells=3: there is no element [10], the scene has 10"},
        {"bodies.cells=3", "--set bodies.cells=3: the scene has no object that 'cells' could be in"},
        {"solver.tolerence=3", "did you mean 'tolerance'?"},
        {"solver.tolerence=3", "--set solver.tolerence=3: solver has the unknown key"},
        {"camera.target=null", "x.json:"},
        {"tools[0].bodies[1]=z", "--set tools[0].bodies[1]=z: tools[0].bodies[1] is \"z\", but no body"},
        {"a b=1", "--set a b=1: path 'a b' has no key"},
        {"solver={\"kind\":1,\"kind\":2}", "stands twice"},
        {"constraints[0].body=h", "its lattice moves"},
        {"bodies[7].deformation.free_form.keyframes[1].points=[{\"index\":[1,2,3],\"displacement\":[0,0,0]},"
         "{\"index\":[1,2,3],\"displacement\":[1,0,0]}]",
         "is there twice"},
        {"bodies[0].material.tearing={\"strength\":null}", "strength is null; give a number"},
    };
    for (const auto& [option, message] : cases) {
        EXPECT_THAT(error_of(full_scene, {option}), HasSubstr(message)) << option;
    }
    EXPECT_THAT(
        error_of(small_scene, {"camera.eye=[1,2,3]"}),
        AllOf(HasSubstr("x.json:1 with --set camera.eye=[1,2,3]"), HasSubstr("an eye but no target")));
}

TEST(ParseScene, sizes_are_bounded) {
    std::string keyframes = "[{\"time\":0}";
    for (int i = 1; i <= 10000; ++i) keyframes += ",{\"time\":" + std::to_string(i) + "}";
    EXPECT_THAT(error_of(full_scene, {"constraints[1].keyframes=" + keyframes + "]"}),
                HasSubstr("has 10001 elements"));
    EXPECT_THAT(error_of(std::string(5 << 20, ' ')), HasSubstr("longer than"));
}

TEST(ParseScene, files_that_cannot_be_read_are_named) {
    EXPECT_THROW(parse_scene_file("/no/such/scene.json"), InputError);
    EXPECT_THROW(parse_scene_file(SPLITCUBES_SCENES), InputError);
    try {
        parse_scene_file("somewhere/bunny.OBJ");
        ADD_FAILURE() << "a mesh was taken for a scene";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("is a mesh, not a scene"));
    }
}

TEST(ParseScene, a_file_gives_name_folder_and_location_of_errors) {
    const auto folder = std::filesystem::temp_directory_path() / "splitcubes_parse_test";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "good one.json") << small_scene;
    const SceneDescription scene = parse_scene_file(folder / "good one.json");
    EXPECT_EQ(scene.name, "good one");
    EXPECT_EQ(scene.folder, folder);
    std::ofstream(folder / "bad.json") << "{\n\n]";
    try {
        parse_scene_file(folder / "bad.json");
        ADD_FAILURE() << "no error";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr((folder / "bad.json").string() + ":3:1: "));
    }
    std::filesystem::remove_all(folder);
}

// Any damaged text is read, or refused with one line that names a position.
TEST(ParseScene, damaged_texts_are_read_or_refused) {
    Random random(11);
    const std::string good = full_scene;
    int refused = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        std::string text = good;
        for (std::uint32_t n = 1 + random.below(4); n > 0; --n) {
            // Moves a part of the text elsewhere: mostly valid syntax with invalid meaning.
            const std::size_t from = random.below(static_cast<std::uint32_t>(good.size()));
            const std::size_t to = random.below(static_cast<std::uint32_t>(text.size()));
            const std::size_t length = 1 + random.below(12);
            text.replace(to, random.below(12), good.substr(from, length));
        }
        const std::string error = error_of(text);
        if (error.empty()) {
            const SceneDescription scene = parse(text);
            EXPECT_EQ(parse(resolved_scene(scene).dump()), scene);
        } else {
            EXPECT_EQ(error.rfind("x.json:", 0), 0u) << error;
            EXPECT_THAT(error, testing::Not(HasSubstr("\n\n")));
            ++refused;
        }
    }
    EXPECT_GT(refused, 100);
    EXPECT_LT(refused, 3000);
}

// The tools of a scene on their own form a path.
TEST(ParsePath, reads_the_tools_of_a_scene) {
    SceneDescription scene = parse(full_scene);
    const auto json = nlohmann::ordered_json::parse(full_scene);
    nlohmann::ordered_json path;
    for (const auto& tool : json["tools"]) {
        path["tools"].push_back(tool);
        for (const char* key : {"bodies", "start_when", "end_when"}) path["tools"].back().erase(key);
        if (tool.value("name", "") == "t2") path["tools"].back().erase("relative_to");
    }
    for (ToolDescription& tool : scene.tools) {
        tool.bodies.clear();
        tool.relative_to.reset();
        tool.start_when.reset();
        tool.end_when.reset();
    }
    EXPECT_EQ(parse_path_text(path.dump(), "path.json", SPLITCUBES_SCENES), scene.tools);
    path["name"] = "All";
    path["$schema"] = "schema.json";
    EXPECT_EQ(parse_path_text("// a comment\n" + path.dump(), "path.json", SPLITCUBES_SCENES), scene.tools);
    EXPECT_EQ(parse_path_file(SPLITCUBES_SCENES "/paths/pear_wire.json").size(), 2u);
}

std::string path_error_of(const std::string& text) {
    try {
        parse_path_text(text, "path.json");
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(ParsePath, refuses_with_file_and_line) {
    const std::string tool = R"({"name": "a", "blades": [{"straight": {"to": [0, 0, 1]}}],
"motion": {"path": {"keyframes": [{"time": 0}]}}})";
    EXPECT_THAT(path_error_of("{\n\"tools\": [" + tool + "]}"), HasSubstr("path.json:2"));  // no from
    EXPECT_THAT(path_error_of("{}"), AllOf(HasSubstr("path.json:1"), HasSubstr("tools")));
    EXPECT_THAT(path_error_of("{\n\n\"tools\": []}"), HasSubstr("path.json:3"));
    EXPECT_THAT(path_error_of("{\"tools\": [" + tool + "],\n\"bodies\": []}"), HasSubstr("'bodies'"));
    EXPECT_THAT(path_error_of(R"({"tools": [{"name": "a",
"bodies": ["b"]}]})"),
                AllOf(HasSubstr("path.json:2"), HasSubstr("a path has no bodies")));
    EXPECT_THAT(path_error_of("[]"), HasSubstr("an array"));
    EXPECT_THAT(path_error_of("{"), HasSubstr("path.json"));
}

}  // namespace
}  // namespace splitcubes::scene
