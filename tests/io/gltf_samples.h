// glTF documents for the tests.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

#include "mesh_samples.h"

namespace splitcubes::io {

inline std::string base64(const std::string& bytes) {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k)
            word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        for (int k = 3; k >= 0; --k) out += digits[word >> (6 * k) & 63U];
    }
    const std::size_t padding = (3 - bytes.size() % 3) % 3;
    return out.replace(out.size() - padding, padding, padding, '=');
}

/// A document around one binary buffer, to which the test adds what it wants.
struct GltfSample {
    nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
    std::string binary;

    template <class Number>
    int add_accessor(const std::vector<Number>& values, int component_type, const char* type,
                     std::size_t components) {
        const std::size_t offset = binary.size();
        for (const Number value : values) put(binary, value);
        json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", binary.size() - offset}});
        json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                     {"componentType", component_type},
                                     {"count", values.size() / components},
                                     {"type", type}});
        return static_cast<int>(json["accessors"].size()) - 1;
    }
    int add_positions(const std::vector<Vec3>& positions) {
        std::vector<float> values;
        // glTF is y-up.
        for (const Vec3& p : positions)
            for (const double x : {p.x(), p.z(), -p.y()}) values.push_back(static_cast<float>(x));
        return add_accessor(values, 5126, "VEC3", 3);
    }
    /// 5121, 5123 or 5125
    int add_indices(const std::vector<std::uint32_t>& values, int component_type) {
        if (component_type == 5121)
            return add_accessor(std::vector<std::uint8_t>(values.begin(), values.end()), component_type,
                                "SCALAR", 1);
        if (component_type == 5123)
            return add_accessor(std::vector<std::uint16_t>(values.begin(), values.end()), component_type,
                                "SCALAR", 1);
        return add_accessor(values, component_type, "SCALAR", 1);
    }

    /// With the buffer inside, as base64.
    std::string embedded() const {
        nlohmann::json out = json;
        out["buffers"] = {{{"byteLength", binary.size()},
                           {"uri", "data:application/octet-stream;base64," + base64(binary)}}};
        return out.dump();
    }
    /// With the buffer in a file beside it.
    std::string referring(const std::string& uri) const {
        nlohmann::json out = json;
        out["buffers"] = {{{"byteLength", binary.size()}, {"uri", uri}}};
        return out.dump(1);
    }
    std::string glb() const {
        nlohmann::json out = json;
        out["buffers"] = {{{"byteLength", binary.size()}}};
        std::string text = out.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string padded = binary;
        padded.resize((padded.size() + 3) / 4 * 4, '\0');
        std::string file = "glTF";
        put(file, std::uint32_t{2});
        put(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + padded.size()));
        put(file, static_cast<std::uint32_t>(text.size()));
        file += "JSON" + text;
        put(file, static_cast<std::uint32_t>(padded.size()));
        return file + std::string("BIN\0", 4) + padded;
    }
};

/// The box as one indexed primitive of mesh 0; no nodes.
inline GltfSample box_sample(int index_type = 5123) {
    GltfSample sample;
    const geometry::TriangleMesh box = box_mesh();
    std::vector<std::uint32_t> indices;
    for (const geometry::Triangle& t : box.triangles) indices.insert(indices.end(), t.begin(), t.end());
    const int positions = sample.add_positions(box.positions);
    const int corners = sample.add_indices(indices, index_type);
    sample.json["meshes"] = {
        {{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", corners}}}}}};
    return sample;
}

}  // namespace splitcubes::io
