// An independent check of GLB files against the glTF 2.0 specification, for what the writers use of it.
#pragma once

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace splitcubes::io {

class GltfCheck {
  public:
    explicit GltfCheck(const std::string& bytes) {
        if (!read_container(bytes)) return;
        check_keys();
        for (const std::string part : parts)
            if (json_.contains(part)) want(!json_[part].empty(), part + " is empty");
        check_views();
        for (std::size_t k = 0; k < size_of("accessors"); ++k) check_accessor(k);
        for (const Json& mesh : list("meshes")) check_mesh(mesh);
        for (const Json& material : list("materials")) check_material(material);
        for (const Json& texture : list("textures")) use("images", texture.at("source"));
        for (const Json& image : list("images")) {
            want(image.contains("uri") != image.contains("bufferView"), "an image has no source, or two");
            if (image.contains("bufferView")) {
                use("bufferViews", image["bufferView"]);
                want(image.contains("mimeType"), "an image in the file has no type");
            }
        }
        check_nodes();
        for (const Json& animation : list("animations")) check_animation(animation);
        // Materials are kept also where no triangle has them, so that their numbers stay.
        for (std::size_t k = 0; k < size_of("materials"); ++k) used_["materials"].insert(k);
        for (const std::string part : parts)
            want(used_[part].size() == size_of(part), "something of " + part + " is not used");
    }

    /// What is wrong, a line for each.
    std::string faults() const {
        std::string out;
        for (const std::string& fault : faults_) out += fault + '\n';
        return out;
    }

  private:
    using Json = nlohmann::json;
    static constexpr const char* parts[] = {"bufferViews", "accessors", "materials", "textures",
                                            "images",      "meshes",    "nodes"};

    void want(bool holds, const std::string& otherwise) {
        if (!holds) faults_.insert(otherwise);
    }
    std::size_t size_of(const std::string& part) const {
        return json_.contains(part) ? json_[part].size() : 0;
    }
    Json list(const std::string& part) const { return json_.value(part, Json::array()); }
    // Notes the use of an element and returns whether it exists.
    bool use(const std::string& part, const Json& index) {
        const auto k = index.get<std::size_t>();
        want(k < size_of(part), "there is no " + part + " " + std::to_string(k));
        used_[part].insert(k);
        return k < size_of(part);
    }
    static std::uint32_t word(const std::string& bytes, std::size_t at) {
        std::uint32_t out = 0;
        std::memcpy(&out, bytes.data() + at, 4);
        return out;
    }

    bool read_container(const std::string& bytes) {
        if (bytes.size() < 20 || bytes.substr(0, 4) != "glTF" || word(bytes, 4) != 2) {
            want(false, "it is no GLB of version 2");
            return false;
        }
        want(word(bytes, 8) == bytes.size(), "the header has another length");
        const std::size_t text = word(bytes, 12);
        want(bytes.substr(16, 4) == "JSON" && text % 4 == 0, "the first chunk is no padded JSON");
        json_ = Json::parse(bytes.substr(20, text), nullptr, false);
        want(json_.is_object(), "the JSON cannot be read");
        if (bytes.size() > 20 + text) {
            const std::size_t length = word(bytes, 20 + text);
            want(bytes.substr(24 + text, 4) == std::string("BIN\0", 4) && length % 4 == 0,
                 "the second chunk is not binary and padded");
            want(28 + text + length == bytes.size(), "the second chunk has another length");
            binary_ = bytes.substr(28 + text);
        }
        return json_.is_object();
    }

    void check_keys() {
        const std::set<std::string> known = {"asset",     "scene",       "scenes",  "nodes",
                                             "meshes",    "materials",   "images",  "textures",
                                             "accessors", "bufferViews", "buffers", "animations"};
        for (const auto& [key, value] : json_.items()) want(known.contains(key), "unknown key " + key);
        want(json_["asset"].value("version", "") == "2.0", "the version of the asset is not 2.0");
        want(size_of("buffers") == (binary_.empty() ? 0 : 1),
             "there are not as many buffers as binary chunks");
        if (size_of("buffers") != 1) return;
        const auto length = json_["buffers"][0]["byteLength"].get<std::size_t>();
        want(length <= binary_.size() && length + 3 >= binary_.size(), "the buffer has another length");
    }

    void check_views() {
        for (const Json& view : list("bufferViews")) {
            const auto offset = view.value("byteOffset", std::size_t{0});
            const auto length = view.at("byteLength").get<std::size_t>();
            want(length > 0 && offset + length <= binary_.size(), "a view reaches out of its buffer");
            want(!view.contains("byteStride"), "a view has a stride, which this check does not know");
        }
    }

    static std::size_t width_of(const std::string& type) {
        return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 0;
    }

    // Numbers of an accessor; empty where it is faulty.
    std::vector<double> numbers(std::size_t k) const {
        const Json& accessor = json_["accessors"][k];
        const Json& view = json_["bufferViews"][accessor.at("bufferView").get<std::size_t>()];
        const std::size_t count = accessor["count"].get<std::size_t>() * width_of(accessor["type"]);
        const std::size_t at = view.value("byteOffset", std::size_t{0});
        if (4 * count > view["byteLength"].get<std::size_t>() || at + 4 * count > binary_.size()) return {};
        std::vector<double> out(count);
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t bits = word(binary_, at + 4 * i);
            float value = 0;
            std::memcpy(&value, &bits, 4);
            out[i] =
                accessor["componentType"] == 5125 ? static_cast<double>(bits) : static_cast<double>(value);
        }
        return out;
    }

    void check_accessor(std::size_t k) {
        const Json& accessor = json_["accessors"][k];
        const std::string name = "accessor " + std::to_string(k);
        if (!use("bufferViews", accessor.at("bufferView"))) return;
        const Json& view = json_["bufferViews"][accessor["bufferView"].get<std::size_t>()];
        const int type = accessor.at("componentType");
        want(type == 5126 || type == 5125, name + " has a type that this check does not know");
        want(view.value("byteOffset", 0) % 4 == 0, name + " is not aligned");
        const std::size_t width = width_of(accessor.at("type"));
        want(width > 0 && accessor.at("count") > 0, name + " has no elements");
        const std::vector<double> values = numbers(k);
        want(!values.empty(), name + " reaches out of its view");
        if (values.empty()) return;
        for (const double value : values)
            want(std::isfinite(value), name + " has numbers that are not finite");
        for (const char* key : {"min", "max"}) {
            if (!accessor.contains(key)) continue;
            want(accessor[key].size() == width, name + " has bounds of another size");
            for (std::size_t axis = 0; axis < width && axis < accessor[key].size(); ++axis) {
                double bound = values[axis];
                for (std::size_t i = axis; i < values.size(); i += width)
                    bound = *key == 'm' && key[1] == 'i' ? std::min(bound, values[i])
                                                         : std::max(bound, values[i]);
                want(static_cast<float>(accessor[key][axis].get<double>()) == static_cast<float>(bound),
                     name + " has other bounds");
            }
        }
    }

    void check_unit(std::size_t accessor, const std::string& what) {
        const std::vector<double> values = numbers(accessor);
        const std::size_t width = width_of(json_["accessors"][accessor]["type"]);
        for (std::size_t i = 0; i + width <= values.size(); i += width) {
            double square = 0;
            for (std::size_t axis = 0; axis < width; ++axis) square += values[i + axis] * values[i + axis];
            want(std::abs(std::sqrt(square) - 1) < 5e-4, what + " is not of unit length");
        }
    }

    void check_attribute(const std::string& name, std::size_t accessor) {
        const Json& one = json_["accessors"][accessor];
        const std::map<std::string, std::string> types = {{"POSITION", "VEC3"},
                                                          {"NORMAL", "VEC3"},
                                                          {"TEXCOORD_0", "VEC2"},
                                                          {"COLOR_0", "VEC4"},
                                                          {"_REST", "VEC3"}};
        want(types.contains(name) && types.at(name) == one["type"] && one["componentType"] == 5126,
             "attribute " + name + " is unknown or of another type");
        want(json_["bufferViews"][one["bufferView"].get<std::size_t>()].value("target", 0) == 34962,
             "a view of vertices has another target");
        if (name == "POSITION") want(one.contains("min") && one.contains("max"), "positions have no bounds");
        if (name == "NORMAL") check_unit(accessor, "a normal");
        if (name == "COLOR_0")
            for (const double c : numbers(accessor)) want(c >= 0 && c <= 1, "a colour is out of bounds");
    }

    void check_mesh(const Json& mesh) {
        want(mesh.contains("primitives") && !mesh["primitives"].empty(), "a mesh has no primitives");
        for (const Json& primitive : mesh["primitives"]) {
            std::size_t count = 0;
            want(primitive["attributes"].contains("POSITION"), "a primitive has no positions");
            for (const auto& [name, index] : primitive["attributes"].items()) {
                if (!use("accessors", index)) continue;
                check_attribute(name, index);
                const auto vertices =
                    json_["accessors"][index.get<std::size_t>()]["count"].get<std::size_t>();
                want(count == 0 || count == vertices, "attributes of a primitive have different lengths");
                count = vertices;
            }
            if (primitive.contains("material")) use("materials", primitive["material"]);
            if (!primitive.contains("indices") || !use("accessors", primitive["indices"])) continue;
            const auto index = primitive["indices"].get<std::size_t>();
            const Json& accessor = json_["accessors"][index];
            want(accessor["componentType"] == 5125 && accessor["type"] == "SCALAR",
                 "indices have another type");
            want(json_["bufferViews"][accessor["bufferView"].get<std::size_t>()].value("target", 0) == 34963,
                 "a view of indices has another target");
            const std::vector<double> corners = numbers(index);
            want(corners.size() % 3 == 0, "triangles have not three corners each");
            for (const double v : corners) want(v < static_cast<double>(count), "an index is out of bounds");
        }
    }

    void check_material(const Json& material) {
        const Json& shading = material.at("pbrMetallicRoughness");
        for (const char* key : {"metallicFactor", "roughnessFactor"}) {
            const double value = shading.value(key, 1.0);
            want(value >= 0 && value <= 1, std::string(key) + " is out of bounds");
        }
        const Json colour = shading.value("baseColorFactor", Json::array({1, 1, 1, 1}));
        want(colour.size() == 4, "a base colour has not four numbers");
        for (const Json& c : colour) want(c >= 0 && c <= 1, "a base colour is out of bounds");
        if (shading.contains("baseColorTexture")) use("textures", shading["baseColorTexture"].at("index"));
    }

    void check_nodes() {
        want(json_.value("scene", std::size_t{0}) < size_of("scenes"), "the scene does not exist");
        for (const Json& scene : list("scenes"))
            for (const Json& root : scene.value("nodes", Json::array())) use("nodes", root);
        for (const Json& node : list("nodes")) {
            if (node.contains("mesh")) use("meshes", node["mesh"]);
            if (!node.contains("rotation")) continue;
            double square = 0;
            for (const Json& c : node["rotation"]) square += c.get<double>() * c.get<double>();
            want(std::abs(std::sqrt(square) - 1) < 5e-4, "a node's rotation is not of unit length");
        }
    }

    void check_animation(const Json& animation) {
        std::set<std::string> targets;
        std::set<std::size_t> samplers;
        for (const Json& channel : animation.at("channels")) {
            const Json& target = channel.at("target");
            use("nodes", target.at("node"));
            want(targets.insert(target.dump()).second, "two channels have the same target");
            const auto index = channel.at("sampler").get<std::size_t>();
            samplers.insert(index);
            want(index < animation["samplers"].size(), "a channel's sampler does not exist");
            const Json& sampler = animation["samplers"][index];
            if (!use("accessors", sampler.at("input")) || !use("accessors", sampler.at("output"))) continue;
            const Json& input = json_["accessors"][sampler["input"].get<std::size_t>()];
            const Json& output = json_["accessors"][sampler["output"].get<std::size_t>()];
            want(input.contains("min") && input.contains("max"), "times have no bounds");
            want(input["count"] == output["count"], "a sampler has not as many values as times");
            want(output["type"] == (target["path"] == "rotation" ? "VEC4" : "VEC3"),
                 "values are of another type");
            if (target["path"] == "rotation") check_unit(sampler["output"], "a rotation");
            double last = -std::numeric_limits<double>::infinity();
            for (const double time : numbers(sampler["input"])) {
                want(time >= 0 && time > last, "times do not increase from zero on");
                last = time;
            }
        }
        want(!animation["channels"].empty(), "an animation has no channels");
        want(samplers.size() == animation["samplers"].size(), "a sampler is not used");
    }

    Json json_;
    std::string binary_;
    std::map<std::string, std::set<std::size_t>> used_;
    std::set<std::string> faults_;
};

}  // namespace splitcubes::io
