// The links between phyxels of a run, as files and as lines coloured by visibility.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace splitcubes::body {
class World;
}

namespace splitcubes::app {

struct Link {
    std::uint32_t a, b;  // indices into positions
    float visibility;    // 0 .. 1: the factor that the criterion gives the pair
};

struct Links {
    std::vector<Vec3> positions;  // of phyxels, m, world
    std::vector<Link> links;
};

/// Returns the pairs of phyxels of the same piece, in all bodies.
Links links_of(const body::World& world);

/// Writes a binary PLY: vertex x y z (double), edge vertex1 vertex2 (uint) visibility (float).
void write_links(const std::filesystem::path& file, const Links& links);
/// Reads a file of write_links. Throws InputError for anything else.
Links read_links(const std::filesystem::path& file);

}  // namespace splitcubes::app
