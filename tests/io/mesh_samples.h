// Meshes and files for the tests, made here rather than read.
#pragma once

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/read_mesh.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::io {

inline std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

/// Appends a number's bytes; big: highest first.
template <class Number>
void put(std::string& out, Number value, bool big = false) {
    char bytes[sizeof(Number)];
    std::memcpy(bytes, &value, sizeof(Number));
    if ((std::endian::native == std::endian::big) != big) std::reverse(bytes, bytes + sizeof(Number));
    out.append(bytes, sizeof(Number));
}

/// A closed unit box from (0, 0, 0) to (1, 1, 1), volume 1.
inline geometry::TriangleMesh box_mesh() {
    geometry::TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
    const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    return mesh;
}

/// The box with random positions near its corners, every attribute, and normals
/// that single precision holds.
inline geometry::SurfaceMesh box_surface(std::uint64_t seed) {
    Random random(seed);
    geometry::SurfaceMesh surface;
    surface.mesh = box_mesh();
    for (Vec3& p : surface.mesh.positions)
        for (double& x : p) x += random.uniform(-0.1, 0.1);
    for (std::size_t v = 0; v < surface.mesh.positions.size(); ++v) {
        const Vec3 normal = Vec3(random.uniform(-1, 1), random.uniform(-1, 1), 2).normalized();
        surface.normals.push_back(normal.cast<float>().cast<double>());
        surface.vertex_piece.push_back(static_cast<std::int32_t>(random.bits()));
    }
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
        surface.triangle_origin.push_back(random.below(2) ? geometry::Origin::cut
                                                          : geometry::Origin::boundary);
    surface.triangle_origin.front() = geometry::Origin::cut;
    surface.triangle_origin.back() = geometry::Origin::boundary;
    return surface;
}

/// The box with all of the above, rest positions and, by corner, texture coordinates
/// and colours that a byte a channel holds, three materials, one of them unused, and
/// triangles without one.
inline geometry::SurfaceMesh textured_surface(std::uint64_t seed) {
    Random random(seed);
    geometry::SurfaceMesh surface = box_surface(seed);
    for (const Vec3& p : surface.mesh.positions) surface.rest.emplace_back(2 * p);
    geometry::MeshAttributes& a = surface.attributes;
    std::vector<geometry::Rgba> colours;
    for (std::size_t v = 0; v < surface.mesh.positions.size(); ++v) {
        geometry::Rgba& colour = colours.emplace_back();
        for (float& value : colour) value = static_cast<float>(random.below(256)) / 255.0F;
        colour[3] = 1;  // OBJ has no more
    }
    for (const geometry::Triangle& t : surface.mesh.triangles) {
        auto& uv = a.corner_uv.emplace_back();
        // Multiples of 2^-10 survive being counted from the other end.
        for (geometry::Uv& corner : uv)
            corner = {static_cast<float>(random.below(1025)) / 1024,
                      static_cast<float>(random.below(1025)) / 1024};
        a.corner_colour.push_back({colours[t[0]], colours[t[1]], colours[t[2]]});
        a.triangle_material.push_back(static_cast<std::int32_t>(random.below(3)) - 1);
    }
    a.triangle_material[0] = 0;
    a.triangle_material[1] = 1;
    a.materials = {{.name = "skin of a pear", .colour = {0.5F, 0.25F, 1, 1}, .texture = {}, .image = {}},
                   {.name = "leaf", .colour = {0.1F, 0.2F, 0.3F, 0.5F}, .texture = {}, .image = {}},
                   {.name = "unused", .texture = {}, .image = {}}};
    return surface;
}

/// The message of the InputError that reading gives; fails the test when it gives none.
inline std::string complaint(const std::string& content, MeshFormat format) {
    try {
        read_mesh_from_memory(bytes_of(content), format, "the-file");
    } catch (const InputError& error) {
        const std::string message = error.what();
        EXPECT_TRUE(message.starts_with("the-file")) << message;
        EXPECT_EQ(message.find('\n'), message.npos) << message;
        return message;
    }
    ADD_FAILURE() << "no InputError";
    return {};
}

/// A folder of its own, removed at the end.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
        for (int i = 0;; ++i) {
            path_ = std::filesystem::temp_directory_path() / ("splitcubes-" + name + "-" + std::to_string(i));
            if (std::filesystem::create_directory(path_)) break;
        }
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path write(const std::string& name, const std::string& content) const {
        std::ofstream(path_ / name, std::ios::binary) << content;
        return path_ / name;
    }
    std::string content(const std::string& name) const {
        std::ifstream stream(path_ / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }
    std::size_t file_count() const {
        return static_cast<std::size_t>(
            std::distance(std::filesystem::directory_iterator(path_), std::filesystem::directory_iterator()));
    }

  private:
    std::filesystem::path path_;
};

}  // namespace splitcubes::io
