// Surfaces as a run writes them: binary PLY, read by code of this folder's own.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::torture {

using Vec3 = Eigen::Vector3d;

struct Surface {
    std::vector<Vec3> positions;  // m
    std::vector<Vec3> rest;       // m; empty where the file has none
    std::vector<int> piece;       // of each vertex
    std::vector<std::array<int, 3>> triangles;
};

/// Throws std::runtime_error for what is no such file.
Surface read_surface(const std::filesystem::path& file);

/// The same from bytes; `name` stands in messages for the file.
Surface parse_surface(const std::string& bytes, const std::string& name);

/// Writes one, for tests.
std::string encode_surface(const Surface& surface);

}  // namespace splitcubes::torture
