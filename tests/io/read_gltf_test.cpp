#include <gmock/gmock.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/read_mesh.h>

#include "gltf_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using nlohmann::json;
using ::testing::HasSubstr;

namespace {

geometry::TriangleMesh read(const std::string& text, ReadMeshReport* report = nullptr) {
    return read_mesh_from_memory(bytes_of(text), MeshFormat::gltf, "the-file", report);
}
std::string gltf_complaint(const std::string& text) {
    return io::complaint(text, MeshFormat::gltf);
}
std::string gltf_complaint(const GltfSample& sample) {
    return gltf_complaint(sample.embedded());
}

}  // namespace

TEST(ReadGltf, EveryContainerAndIndexTypeGivesTheSameMesh) {
    const TemporaryFolder folder;
    const geometry::TriangleMesh box = box_mesh();
    for (const int index_type : {5121, 5123, 5125}) {
        const GltfSample sample = box_sample(index_type);
        folder.write("data 1.bin", sample.binary);
        for (const auto& path :
             {folder.write("a.gltf", sample.embedded()), folder.write("b.GLB", sample.glb()),
              folder.write("c.gltf", sample.referring("data%201.bin")),
              folder.write("d.gltf", sample.referring("./data 1.bin")), folder.write("e", sample.glb()),
              folder.write("f", sample.embedded())}) {
            const geometry::TriangleMesh mesh = read_mesh(path);
            EXPECT_EQ(mesh.positions, box.positions) << path;
            EXPECT_EQ(mesh.triangles, box.triangles) << path;
        }
    }
}

TEST(ReadGltf, NodesPlaceAndMirrorTheirMeshes) {
    GltfSample sample = box_sample();
    // A parent scaled by 2 and moved, a child turned a quarter about z, a mirrored child.
    const double half = std::sqrt(0.5);
    sample.json["nodes"] = {{{"children", {1, 2}}, {"scale", {2, 2, 2}}, {"translation", {10, 0, 0}}},
                            {{"mesh", 0}, {"rotation", {0, 0, half, half}}},
                            {{"mesh", 0}, {"matrix", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}}},
                            {{"mesh", 0}}};
    sample.json["scenes"] = {{{"nodes", {3}}}, {{"nodes", {0}}}};
    sample.json["scene"] = 1;
    ReadMeshReport report;
    const geometry::TriangleMesh mesh = read(sample.embedded(), &report);
    ASSERT_EQ(mesh.positions.size(), 16U);
    // The file's y is up, its z is towards -y.
    EXPECT_LT((mesh.positions[1] - Vec3(10, 0, 2)).norm(), 1e-12);     // corner (1, 0, 0) turned upwards
    EXPECT_LT((mesh.positions[2] - Vec3(10, 2, 0)).norm(), 1e-12);     // corner (0, 1, 0) on the axis
    EXPECT_LT((mesh.positions[9] - Vec3(18, -14, 12)).norm(), 1e-12);  // corner (1, 0, 0) mirrored, moved
    // Both are turned outwards: two boxes of edge 2.
    EXPECT_TRUE(geometry::check_mesh(mesh).valid());
    EXPECT_NEAR(mesh.volume(), 16, 1e-12);
    EXPECT_THAT(report.notes, ::testing::Contains("1 nodes outside of the scene were passed over"));
    sample.json.erase("scene");
    EXPECT_NEAR(read(sample.embedded()).volume(), 1, 1e-12);
    sample.json.erase("scenes");
    EXPECT_NEAR(read(sample.embedded()).volume(), 17, 1e-12);
}

TEST(ReadGltf, StripsFansAndListsGiveTheSameSurface) {
    // A square of four vertices, every triangle of which has normal +z.
    const std::vector<Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const std::vector<Vec3> zigzag = {square[0], square[1], square[3], square[2]};
    const auto area_vector = [](const geometry::TriangleMesh& mesh) {
        Vec3 sum = Vec3::Zero();
        for (const geometry::Triangle& t : mesh.triangles)
            sum += (mesh.positions[t[1]] - mesh.positions[t[0]])
                       .cross(mesh.positions[t[2]] - mesh.positions[t[0]]) /
                   2;
        return sum;
    };
    for (const bool indexed : {false, true})
        for (const int mode : {4, 5, 6}) {
            GltfSample sample;
            const std::vector<Vec3> corners =
                mode == 5 ? zigzag
                : mode == 6
                    ? square
                    : std::vector<Vec3>{square[0], square[1], square[2], square[0], square[2], square[3]};
            json primitive = {{"attributes", {{"POSITION", sample.add_positions(corners)}}}, {"mode", mode}};
            std::vector<std::uint32_t> order(corners.size());
            for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
            if (indexed) primitive["indices"] = sample.add_indices(order, 5125);
            sample.json["meshes"] = {
                {{"primitives", {primitive, {{"mode", 1}, {"attributes", {{"POSITION", 0}}}}}}}};
            ReadMeshReport report;
            const geometry::TriangleMesh mesh = read(sample.embedded(), &report);
            EXPECT_EQ(mesh.triangles.size(), 2U);
            EXPECT_LT((area_vector(mesh) - Vec3(0, 0, 1)).norm(), 1e-12) << mode;
            EXPECT_THAT(report.notes, ::testing::Contains(HasSubstr("1 primitives of points or lines")));
        }
}

TEST(ReadGltf, PrimitivesThatShareVerticesStayJoined) {
    GltfSample sample = box_sample();
    const json primitive = sample.json["meshes"][0]["primitives"][0];
    const geometry::TriangleMesh box = box_mesh();
    std::vector<std::uint32_t> first, second;
    for (std::size_t t = 0; t < 12; ++t)
        for (const std::uint32_t v : box.triangles[t]) (t < 6 ? first : second).push_back(v);
    json primitives = json::array();
    for (const auto& part : {first, second})
        primitives.push_back(
            {{"attributes", primitive["attributes"]}, {"indices", sample.add_indices(part, 5121)}});
    sample.json["meshes"][0]["primitives"] = primitives;
    const geometry::TriangleMesh mesh = read(sample.glb());
    EXPECT_EQ(mesh.positions.size(), 8U);
    EXPECT_TRUE(geometry::check_mesh(mesh).valid());
}

TEST(ReadGltf, InterleavedAndQuantizedPositions) {
    GltfSample sample;
    // Three vertices of 12 bytes: six of position, six of something else.
    for (const std::vector<int>& p : {std::vector<int>{0, 0, 0}, {32767, 0, 0}, {0, -32767, 0}}) {
        for (const int x : p) put(sample.binary, static_cast<std::int16_t>(x));
        sample.binary += "??????";
    }
    sample.json["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}, {"byteStride", 12}}};
    sample.json["accessors"] = {
        {{"bufferView", 0}, {"componentType", 5122}, {"normalized", true}, {"count", 3}, {"type", "VEC3"}}};
    sample.json["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}};
    sample.json["extensionsRequired"] = {"KHR_mesh_quantization"};
    const geometry::TriangleMesh mesh = read(sample.glb());
    EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 0, -1}}));
}

TEST(ReadGltf, NodesThatLoopOrMeetAreRefused) {
    GltfSample sample = box_sample();
    sample.json["nodes"] = {{{"mesh", 0}, {"children", {1}}}, {{"children", {0}}}};
    sample.json["scenes"] = {{{"nodes", {0}}}};
    EXPECT_THAT(gltf_complaint(sample), HasSubstr("nodes[0]: is reached twice"));
    sample.json["nodes"] = {{{"children", {1, 2}}}, {{"children", {3}}}, {{"children", {3}}}, {{"mesh", 0}}};
    EXPECT_THAT(gltf_complaint(sample), HasSubstr("nodes[3]: is reached twice"));
}

TEST(ReadGltf, DeepNodesAreNoTrouble) {
    GltfSample sample = box_sample();
    constexpr int depth = 20000;
    json nodes = json::array();
    for (int i = 1; i < depth; ++i) nodes.push_back({{"children", {i}}});
    nodes.push_back({{"mesh", 0}});
    sample.json["nodes"] = nodes;
    EXPECT_DOUBLE_EQ(read(sample.embedded()).volume(), 1);
    EXPECT_THAT(gltf_complaint(std::string(100000, '[')), HasSubstr("JSON is malformed"));
}

TEST(ReadGltf, SmallFilesDoNotUnfoldWithoutBound) {
    GltfSample sample;
    const std::vector<Vec3> many(999, Vec3::Zero());
    sample.json["meshes"] = {
        {{"primitives", {{{"attributes", {{"POSITION", sample.add_positions(many)}}}}}}}};
    for (int i = 0; i < 3000; ++i) sample.json["nodes"].push_back({{"mesh", 0}});
    EXPECT_THAT(gltf_complaint(sample), HasSubstr("unfold"));
}

TEST(ReadGltf, SaysWhereAndWhatIsWrong) {
    const GltfSample good = box_sample();
    EXPECT_NO_THROW(read(good.embedded()));
    const auto changed = [&](const char* pointer, const json& value) {
        GltfSample bad = good;
        bad.json[json::json_pointer(pointer)] = value;
        return gltf_complaint(bad);
    };
    EXPECT_THAT(gltf_complaint("{\"asset\":"), HasSubstr("the-file at byte"));
    EXPECT_THAT(gltf_complaint("[]"), HasSubstr("no object"));
    EXPECT_THAT(gltf_complaint("{}"), HasSubstr("asset.version: is missing"));
    EXPECT_THAT(changed("/asset/version", "1.0"), HasSubstr("asset.version: is '1.0'"));
    EXPECT_THAT(changed("/meshes", json::array()), HasSubstr("no triangles"));
    EXPECT_THAT(changed("/meshes", 5), HasSubstr("meshes: is no array"));
    EXPECT_THAT(changed("/accessors/0/count", 9),
                HasSubstr("accessors[0].count: is 9 but its bufferView holds 8"));
    EXPECT_THAT(changed("/accessors/0/count", 1000000000000), HasSubstr("is 1000000000000 but"));
    EXPECT_THAT(changed("/accessors/0/count", -1), HasSubstr("accessors[0].count: is '-1'"));
    EXPECT_THAT(changed("/accessors/0/count", 7), HasSubstr("index 7"));
    EXPECT_THAT(changed("/accessors/0/type", "VEC2"), HasSubstr("accessors[0].type: is not VEC3"));
    EXPECT_THAT(changed("/accessors/0/componentType", 5127), HasSubstr("componentType: is 5127"));
    EXPECT_THAT(changed("/accessors/1/componentType", 5122), HasSubstr("indices must be"));
    EXPECT_THAT(changed("/accessors/1/count", 35), HasSubstr("35 corners do not make triangles"));
    EXPECT_THAT(changed("/accessors/0/sparse", json::object()), HasSubstr("is sparse"));
    EXPECT_THAT(changed("/accessors/0/bufferView", 5), HasSubstr("bufferViews[5] but there are 2"));
    EXPECT_THAT(changed("/accessors/0/byteOffset", 100), HasSubstr("bufferView holds 0"));
    EXPECT_THAT(changed("/bufferViews/0/byteStride", 0), HasSubstr("byteStride: is 0"));
    EXPECT_THAT(changed("/bufferViews/0/byteOffset", 1000), HasSubstr("of a buffer of"));
    EXPECT_THAT(changed("/bufferViews/0/buffer", 1), HasSubstr("there is no buffer 1"));
    EXPECT_THAT(changed("/meshes/0/primitives/0/indices", 2), HasSubstr("accessors[2] but there are 2"));
    EXPECT_THAT(changed("/meshes/0/primitives/0/mode", 7), HasSubstr("mode: is 7"));
    EXPECT_THAT(changed("/meshes/0/primitives/0/attributes", json::object()), HasSubstr("has no POSITION"));
    EXPECT_THAT(changed("/nodes", {{{"mesh", 1}}}), HasSubstr("meshes[1] but there are 1"));
    EXPECT_THAT(changed("/nodes", {{{"mesh", 0}, {"scale", {1, 2}}}}), HasSubstr("has 2 numbers"));
    EXPECT_THAT(changed("/nodes", {{{"mesh", 0}, {"scale", {1e200, 1, 1}}, {"children", {1}}},
                                   {{"mesh", 0}, {"scale", {1e200, 1, 1}}}}),
                HasSubstr("infinite"));
    EXPECT_THAT(changed("/nodes", {{{"mesh", 0}, {"rotation", {0, 0, 0, 0}}}}), HasSubstr("unit quaternion"));
    EXPECT_THAT(changed("/extensionsRequired", {"KHR_draco_mesh_compression"}),
                HasSubstr("'KHR_draco_mesh_compression'"));
    GltfSample nan = good;
    std::string no_number;
    put(no_number, std::numeric_limits<float>::quiet_NaN());
    nan.binary.replace(4, 4, no_number);
    EXPECT_THAT(gltf_complaint(nan), HasSubstr("accessors[0]: element 0 is not finite"));
}

TEST(ReadGltf, DamagedContainersAndBuffers) {
    const GltfSample good = box_sample();
    const std::string glb = good.glb();
    EXPECT_THAT(gltf_complaint(glb.substr(0, glb.size() - 1)), HasSubstr("the header says"));
    EXPECT_THAT(gltf_complaint(glb.substr(0, 8)), HasSubstr("the file ends within the GLB header"));
    std::string other = glb;
    other[4] = 1;
    EXPECT_THAT(gltf_complaint(other), HasSubstr("GLB version 1"));
    other = glb;
    other[15] = 1;  // the JSON chunk's length
    EXPECT_THAT(gltf_complaint(other), HasSubstr("the file ends within a chunk"));
    std::string text = good.embedded();
    text[text.find("base64,") + 9] = '!';
    EXPECT_THAT(gltf_complaint(text), HasSubstr("buffers[0].uri: holds malformed base64"));
    GltfSample longer = good;
    longer.json["bufferViews"][0]["byteLength"] = 100000;
    EXPECT_THAT(gltf_complaint(longer), HasSubstr("bufferViews[0]"));
    EXPECT_THAT(gltf_complaint(good.referring("x.bin")), HasSubstr("data from memory cannot"));
}

TEST(ReadGltf, BuffersLieInTheFilesFolderOnly) {
    const TemporaryFolder folder;
    const GltfSample sample = box_sample();
    std::filesystem::create_directory(folder.path() / "sub");
    folder.write("secret.bin", sample.binary);
    const std::string absolute = (folder.path() / "secret.bin").string();
    for (const std::string& uri :
         std::vector<std::string>{"../secret.bin", "x/../../secret.bin", "%2e%2e/secret.bin",
                                  "http://x/secret.bin", absolute, "none.bin", "", "."})
        EXPECT_THROW(read_mesh(folder.write("sub/a.gltf", sample.referring(uri))), InputError) << uri;
}
