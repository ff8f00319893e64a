#include <splitcubes/core/error.h>
#include <splitcubes/geometry/srgb.h>
#include <splitcubes/io/gltf_builder.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <string_view>

namespace splitcubes::io {

using geometry::Origin;
using geometry::SurfaceMesh;

namespace {

/// RFC 3986: letters, digits and these stand for themselves.
std::string percent_encoded(const std::string& text) {
    const char* const digits = "0123456789ABCDEF";
    std::string out;
    for (const char c : text) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view("-._~/:").find(c) != std::string_view::npos;
        const auto byte = static_cast<unsigned char>(c);
        if (plain)
            out += c;
        else
            out += {'%', digits[byte >> 4], digits[byte & 15]};
    }
    return out;
}

}  // namespace

GltfBuilder::GltfBuilder(std::string name) : name_(std::move(name)) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "splitcubes"}};
    json_["scene"] = 0;
}

std::size_t GltfBuilder::add_texture(const geometry::Material& material) {
    OrderedJson image;
    if (material.image) {
        image = {{"name", std::filesystem::path(material.texture).stem().string()},
                 {"mimeType", material.image->mime_type},
                 {"bufferView", image_view(*material.image)}};
    } else {
        image = {{"uri", percent_encoded(material.texture)}};
    }
    OrderedJson& images = json_["images"];
    const auto known = std::find(images.begin(), images.end(), image);
    const auto source = static_cast<std::size_t>(known - images.begin());
    if (known == images.end()) images.push_back(std::move(image));
    OrderedJson texture = {{"source", source}};
    OrderedJson& textures = json_["textures"];
    const auto same = std::find(textures.begin(), textures.end(), texture);
    const auto index = static_cast<std::size_t>(same - textures.begin());
    if (same == textures.end()) textures.push_back(std::move(texture));
    return index;
}

// The view that holds the picture; equal pictures share one.
std::size_t GltfBuilder::image_view(const geometry::EmbeddedImage& image) {
    for (const auto& [known, view] : image_views_)
        if (known == image) return view;
    const std::size_t offset = binary_.size();
    for (const std::byte byte : image.bytes) binary_ += static_cast<char>(byte);
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", image.bytes.size()}});
    // Numbers that follow must lie at multiples of four.
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    const std::size_t view = json_["bufferViews"].size() - 1;
    image_views_.emplace_back(image, view);
    return view;
}

std::size_t GltfBuilder::add_accessor(std::size_t offset, int target, int component_type, std::size_t count,
                                      const char* type) {
    OrderedJson view = {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", binary_.size() - offset}};
    if (target != target_none) view["target"] = target;
    // A new key of an ordered object moves the values of the others, so references to them end.
    json_["bufferViews"].push_back(std::move(view));
    const std::size_t last_view = json_["bufferViews"].size() - 1;
    OrderedJson& accessors = json_["accessors"];
    accessors.push_back(
        {{"bufferView", last_view}, {"componentType", component_type}, {"count", count}, {"type", type}});
    return accessors.size() - 1;
}

std::size_t GltfBuilder::add_material(const geometry::Material& material) {
    OrderedJson shading = {{"baseColorFactor", material.colour}};
    if (!material.texture.empty()) shading["baseColorTexture"] = {{"index", add_texture(material)}};
    const float rough = material.name == name_of(Origin::cut) ? 0.35F : 0.6F;
    shading["metallicFactor"] = material.metalness.value_or(0);
    shading["roughnessFactor"] = material.roughness.value_or(rough);
    OrderedJson wanted = {{"name", material.name}, {"pbrMetallicRoughness", std::move(shading)}};
    for (const auto& [known, index] : materials_)
        if (known == wanted) return index;
    json_["materials"].push_back(wanted);
    materials_.emplace_back(std::move(wanted), json_["materials"].size() - 1);
    return materials_.back().second;
}

std::size_t GltfBuilder::add_material(Origin origin) {
    const bool cut = origin == Origin::cut;
    geometry::Material material{.name = name_of(origin), .texture = {}, .image = {}};
    material.colour = cut ? geometry::Rgba{0.75F, 0.13F, 0.11F, 1} : geometry::Rgba{0.72F, 0.66F, 0.58F, 1};
    return add_material(material);
}

std::string GltfBuilder::container() const {
    std::string text = json_.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
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
    out += binary_;  // of whole words of four bytes, so it needs no more padding
    return out;
}

namespace {

class SurfaceEncoder {
  public:
    SurfaceEncoder(GltfBuilder& to, const SurfaceMesh& surface,
                   const std::vector<geometry::Material>& materials)
        : to_(to),
          surface_(surface),
          attributes_(surface.attributes),
          materials_(materials),
          name_(to.name()),
          binary_(to.binary()) {}

    std::size_t add(const std::string& mesh_name) {
        split_vertices();
        OrderedJson attributes;
        attributes["POSITION"] = add_positions();
        if (!surface_.normals.empty()) attributes["NORMAL"] = add_normals();
        if (!attributes_.corner_uv.empty()) attributes["TEXCOORD_0"] = add_uv();
        if (!attributes_.corner_colour.empty()) attributes["COLOR_0"] = add_colours();
        if (!surface_.rest.empty()) attributes["_REST"] = add_rest();
        OrderedJson primitives = OrderedJson::array();
        const auto last = static_cast<std::int32_t>(materials_.size());
        const bool by_material = !attributes_.empty();
        std::vector<std::size_t> numbers;
        for (const geometry::Material& material : materials_)
            if (by_material) numbers.push_back(to_.add_material(material));
        for (std::int32_t group = by_material ? -1 : 0; group < (by_material ? last : 2); ++group) {
            const std::size_t offset = binary_.size();
            const std::size_t count = add_indices(group);
            if (count == 0) continue;
            OrderedJson primitive = {{"attributes", attributes}};
            primitive["indices"] = to_.add_accessor(offset, target_indices, type_uint32, count, "SCALAR");
            if (!by_material)
                primitive["material"] = to_.add_material(static_cast<Origin>(group));
            else if (group >= 0)
                primitive["material"] = numbers[static_cast<std::size_t>(group)];
            primitives.push_back(std::move(primitive));
        }
        to_.json()["meshes"].push_back({{"name", mesh_name}, {"primitives", primitives}});
        return to_.json()["meshes"].size() - 1;
    }

  private:
    /// A vertex of the file: one of the surface's with what its corners say.
    struct Vertex {
        std::uint32_t from = 0;  // vertex of the surface
        geometry::Uv uv{};
        geometry::Rgba colour{};
        std::uint32_t next = none;  // the next one of the same vertex
    };
    static constexpr std::uint32_t none = 0xffffffff;

    /// Material, or origin where there are no attributes.
    std::int32_t group_of(std::size_t t) const {
        if (attributes_.empty()) return static_cast<std::int32_t>(origin_of(surface_, t));
        return attributes_.triangle_material.empty() ? -1 : attributes_.triangle_material[t];
    }

    std::size_t add_indices(std::int32_t group) {
        std::size_t count = 0;
        for (std::size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
            if (group_of(t) != group) continue;
            const auto& corners = corners_.empty() ? surface_.mesh.triangles[t] : corners_[t];
            for (const std::uint32_t v : corners) put_number(binary_, v);
            count += 3;
        }
        return count;
    }

    void split_vertices() {
        const std::size_t count = surface_.mesh.positions.size();
        vertices_.resize(count);
        for (std::uint32_t v = 0; v < count; ++v) vertices_[v].from = v;
        if (attributes_.corner_uv.empty() && attributes_.corner_colour.empty()) return;
        std::vector<bool> used(count, false);
        corners_.reserve(surface_.mesh.triangles.size());
        for (std::size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
            geometry::Triangle& corners = corners_.emplace_back();
            for (std::size_t k = 0; k < 3; ++k) {
                Vertex wanted{.from = surface_.mesh.triangles[t][k]};
                if (!attributes_.corner_uv.empty()) wanted.uv = attributes_.corner_uv[t][k];
                if (!attributes_.corner_colour.empty()) wanted.colour = attributes_.corner_colour[t][k];
                corners[k] = vertex_like(wanted, used);
            }
        }
    }

    /// The number of that vertex, made where there is none yet.
    std::uint32_t vertex_like(const Vertex& wanted, std::vector<bool>& used) {
        std::uint32_t at = wanted.from;
        if (!used[at]) {
            used[at] = true;
            vertices_[at] = wanted;
            return at;
        }
        for (;; at = vertices_[at].next) {
            if (vertices_[at].uv == wanted.uv && vertices_[at].colour == wanted.colour) return at;
            if (vertices_[at].next == none) break;
        }
        if (vertices_.size() == none)
            throw InputError(name_, "the surface has too many vertices for GLB", "write PLY");
        vertices_[at].next = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back(wanted);
        return vertices_[at].next;
    }

    std::size_t add_positions() {
        const std::size_t offset = binary_.size();
        std::array<float, 3> low, high;
        low.fill(std::numeric_limits<float>::infinity());
        high.fill(-std::numeric_limits<float>::infinity());
        for (const Vertex& vertex : vertices_)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Vec3 position = gltf_from_own(surface_.mesh.positions[vertex.from]);
                const float value = to_float(position[static_cast<Eigen::Index>(axis)], name_);
                low[axis] = std::min(low[axis], value);
                high[axis] = std::max(high[axis], value);
                put_number(binary_, value);
            }
        const std::size_t accessor =
            to_.add_accessor(offset, target_vertices, type_float, vertices_.size(), "VEC3");
        to_.json()["accessors"][accessor]["min"] = low;
        to_.json()["accessors"][accessor]["max"] = high;
        return accessor;
    }

    std::size_t add_normals() {
        const std::size_t offset = binary_.size();
        for (const Vertex& vertex : vertices_) {
            Vec3 unit = surface_.normals[vertex.from];
            unit.stableNormalize();
            // The format demands unit length; a vertex without a direction gets any.
            if (!(unit.squaredNorm() > 0.5)) unit = Vec3::UnitZ();
            for (const double value : gltf_from_own(unit)) put_number(binary_, static_cast<float>(value));
        }
        return to_.add_accessor(offset, target_vertices, type_float, vertices_.size(), "VEC3");
    }

    std::size_t add_uv() {
        const std::size_t offset = binary_.size();
        for (const Vertex& vertex : vertices_) {
            put_number(binary_, vertex.uv[0]);
            // Here the picture's upper left corner is (0, 0).
            put_number(binary_, 1 - vertex.uv[1]);
        }
        return to_.add_accessor(offset, target_vertices, type_float, vertices_.size(), "VEC2");
    }

    std::size_t add_colours() {
        const std::size_t offset = binary_.size();
        for (const Vertex& vertex : vertices_)
            for (std::size_t i = 0; i < 4; ++i)
                put_number(binary_, i < 3 ? geometry::linear_from_srgb(vertex.colour[i]) : vertex.colour[i]);
        return to_.add_accessor(offset, target_vertices, type_float, vertices_.size(), "VEC4");
    }

    std::size_t add_rest() {
        const std::size_t offset = binary_.size();
        for (const Vertex& vertex : vertices_)
            for (const double value : gltf_from_own(surface_.rest[vertex.from]))
                put_number(binary_, to_float(value, name_));
        return to_.add_accessor(offset, target_vertices, type_float, vertices_.size(), "VEC3");
    }

    GltfBuilder& to_;
    const SurfaceMesh& surface_;
    const geometry::MeshAttributes& attributes_;
    const std::vector<geometry::Material>& materials_;
    const std::string& name_;
    std::string& binary_;
    std::vector<Vertex> vertices_;
    std::vector<geometry::Triangle> corners_;  // into vertices_; empty where they are the surface's own
};

}  // namespace

std::size_t add_gltf_surface(GltfBuilder& to, const SurfaceMesh& surface,
                             const std::vector<geometry::Material>& materials, const std::string& mesh_name) {
    return SurfaceEncoder(to, surface, materials).add(mesh_name);
}

}  // namespace splitcubes::io
