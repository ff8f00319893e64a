// GLB: a JSON chunk that says what is where, a binary chunk with the numbers
// (Khronos glTF 2.0 specification, section 4.4).
#include <splitcubes/io/gltf_builder.h>

namespace splitcubes::io {

std::string encode_glb(const Output& output) {
    GltfBuilder builder(output.name);
    OrderedJson& json = builder.json();
    // The format knows no empty accessors: without triangles there is an empty scene.
    if (output.surface.mesh.triangles.empty()) {
        json["scenes"] = OrderedJson::array({OrderedJson::object()});
        return builder.container();
    }
    json["scenes"] = OrderedJson::array({{{"nodes", {0}}}});
    json["nodes"] = OrderedJson::array({{{"mesh", 0}}});
    add_gltf_surface(builder, output.surface, output.materials, "surface");
    json["buffers"] = OrderedJson::array({{{"byteLength", builder.binary().size()}}});
    return builder.container();
}

}  // namespace splitcubes::io
