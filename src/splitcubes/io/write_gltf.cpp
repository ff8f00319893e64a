// GLB: a JSON chunk that says what is where, a binary chunk with the numbers
// (Khronos glTF 2.0 specification, section 4.4).
#include <splitcubes/core/error.h>
#include <splitcubes/io/mesh_writers.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace splitcubes::io {

namespace {

using geometry::Origin;
using geometry::SurfaceMesh;
using OrderedJson = nlohmann::ordered_json;

// Values of the specification.
constexpr int type_float = 5126;
constexpr int type_uint32 = 5125;
constexpr int target_vertices = 34962;
constexpr int target_indices = 34963;

class GlbWriter {
  public:
    GlbWriter(const SurfaceMesh& surface, const std::string& name) : surface_(surface), name_(name) {
        json_["asset"] = {{"version", "2.0"}, {"generator", "splitcubes"}};
        json_["scene"] = 0;
    }

    std::string encode() {
        // The format knows no empty accessors: without triangles there is an empty scene.
        if (surface_.mesh.triangles.empty()) {
            json_["scenes"] = OrderedJson::array({OrderedJson::object()});
            return container();
        }
        json_["scenes"] = OrderedJson::array({{{"nodes", {0}}}});
        json_["nodes"] = OrderedJson::array({{{"mesh", 0}}});
        add_mesh();
        json_["buffers"] = OrderedJson::array({{{"byteLength", binary_.size()}}});
        return container();
    }

  private:
    void add_mesh() {
        OrderedJson attributes;
        attributes["POSITION"] = add_positions();
        if (!surface_.normals.empty()) attributes["NORMAL"] = add_normals();
        OrderedJson primitives = OrderedJson::array();
        for (const Origin origin : {Origin::boundary, Origin::cut}) {
            const std::size_t offset = binary_.size();
            std::size_t count = 0;
            for (std::size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
                if (origin_of(surface_, t) != origin) continue;
                for (const std::uint32_t v : surface_.mesh.triangles[t]) put_number(binary_, v);
                count += 3;
            }
            if (count == 0) continue;
            const std::size_t indices = add_accessor(offset, target_indices, type_uint32, count, "SCALAR");
            primitives.push_back(
                {{"attributes", attributes}, {"indices", indices}, {"material", add_material(origin)}});
        }
        json_["meshes"] = OrderedJson::array({{{"name", "surface"}, {"primitives", primitives}}});
    }

    std::size_t add_positions() {
        const std::size_t offset = binary_.size();
        std::array<float, 3> low, high;
        low.fill(std::numeric_limits<float>::infinity());
        high.fill(-std::numeric_limits<float>::infinity());
        for (const Vec3& position : surface_.mesh.positions)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const float value = to_float(position[static_cast<Eigen::Index>(axis)], name_);
                low[axis] = std::min(low[axis], value);
                high[axis] = std::max(high[axis], value);
                put_number(binary_, value);
            }
        const std::size_t accessor =
            add_accessor(offset, target_vertices, type_float, surface_.mesh.positions.size(), "VEC3");
        json_["accessors"][accessor]["min"] = low;
        json_["accessors"][accessor]["max"] = high;
        return accessor;
    }

    std::size_t add_normals() {
        const std::size_t offset = binary_.size();
        for (const Vec3& normal : surface_.normals) {
            Vec3 unit = normal;
            unit.stableNormalize();
            // The format demands unit length; a vertex without a direction gets any.
            if (!(unit.squaredNorm() > 0.5)) unit = Vec3::UnitZ();
            for (const double value : unit) put_number(binary_, static_cast<float>(value));
        }
        return add_accessor(offset, target_vertices, type_float, surface_.normals.size(), "VEC3");
    }

    /// Of what was appended to the binary chunk since `offset`.
    std::size_t add_accessor(std::size_t offset, int target, int component_type, std::size_t count,
                             const char* type) {
        OrderedJson& views = json_["bufferViews"];
        OrderedJson& accessors = json_["accessors"];
        views.push_back({{"buffer", 0},
                         {"byteOffset", offset},
                         {"byteLength", binary_.size() - offset},
                         {"target", target}});
        accessors.push_back({{"bufferView", views.size() - 1},
                             {"componentType", component_type},
                             {"count", count},
                             {"type", type}});
        return accessors.size() - 1;
    }

    std::size_t add_material(Origin origin) {
        const bool cut = origin == Origin::cut;
        const OrderedJson colour =
            cut ? OrderedJson{0.75, 0.13, 0.11, 1.0} : OrderedJson{0.72, 0.66, 0.58, 1.0};
        OrderedJson& materials = json_["materials"];
        materials.push_back({{"name", name_of(origin)},
                             {"pbrMetallicRoughness",
                              {{"baseColorFactor", colour},
                               {"metallicFactor", 0.0},
                               {"roughnessFactor", cut ? 0.35 : 0.6}}}});
        return materials.size() - 1;
    }

    std::string container() const {
        std::string text = json_.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const std::size_t binary_bytes = binary_.empty() ? 0 : 8 + binary_.size();
        const std::size_t total = 12 + 8 + text.size() + binary_bytes;
        if (total > std::numeric_limits<std::uint32_t>::max())
            throw InputError(name_,
                             "the surface takes " + std::to_string(total) + " bytes, more than GLB can hold",
                             "write PLY");
        std::string out;
        out.reserve(total);
        out += "glTF";
        put_number(out, std::uint32_t{2});
        put_number(out, static_cast<std::uint32_t>(total));
        put_number(out, static_cast<std::uint32_t>(text.size()));
        out += "JSON";
        out += text;
        if (binary_.empty()) return out;
        put_number(out, static_cast<std::uint32_t>(binary_.size()));
        out += std::string_view("BIN\0", 4);
        out += binary_;  // only numbers of four bytes, so it needs no padding
        return out;
    }

    const SurfaceMesh& surface_;
    const std::string& name_;
    OrderedJson json_;
    std::string binary_;
};

}  // namespace

std::string encode_glb(const SurfaceMesh& surface, const std::string& name) {
    return GlbWriter(surface, name).encode();
}

}  // namespace splitcubes::io
