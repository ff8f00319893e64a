#include "links.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/world/world.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

namespace splitcubes::app {

namespace {

static_assert(std::endian::native == std::endian::little, "files of links are little endian");

std::string header(std::size_t vertices, std::size_t edges) {
    return "ply\nformat binary_little_endian 1.0\ncomment links between phyxels\nelement vertex " +
           std::to_string(vertices) +
           "\nproperty double x\nproperty double y\nproperty double z\nelement edge " +
           std::to_string(edges) +
           "\nproperty uint vertex1\nproperty uint vertex2\nproperty float visibility\nend_header\n";
}

// Returns the count of a header line `element NAME COUNT`.
std::size_t count_of(const std::string& text, const std::string& element) {
    const std::size_t at = text.find("\nelement " + element + ' ');
    if (at == std::string::npos) return 0;
    std::size_t out = 0;
    std::istringstream(text.substr(at + element.size() + 10, 20)) >> out;
    return out;
}

template <class Value>
void put(std::string& out, const Value& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class Value>
Value take(const std::string& bytes, std::size_t& at) {
    Value out;
    std::memcpy(&out, bytes.data() + at, sizeof out);
    at += sizeof out;
    return out;
}

constexpr std::size_t vertex_bytes = 3 * sizeof(double), edge_bytes = 3 * sizeof(float);

}  // namespace

Links links_of(const body::World& world) {
    Links out;
    for (const auto& body : world.bodies()) {
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        const meshless::Phyxels& phyxels = body->phyxels();
        const meshless::Pairs& pairs = body->pairs();
        out.positions.insert(out.positions.end(), phyxels.position.begin(), phyxels.position.end());
        for (std::size_t k = 0; k < pairs.size(); ++k)
            if (phyxels.piece[pairs.a[k]] == phyxels.piece[pairs.b[k]])
                out.links.push_back({first + pairs.a[k], first + pairs.b[k], pairs.visibility[k]});
    }
    return out;
}

void write_links(const std::filesystem::path& file, const Links& links) {
    std::string bytes = header(links.positions.size(), links.links.size());
    for (const Vec3& p : links.positions)
        for (int k = 0; k < 3; ++k) put(bytes, p[k]);
    for (const Link& link : links.links) {
        put(bytes, link.a);
        put(bytes, link.b);
        put(bytes, link.visibility);
    }
    io::write_file(file, bytes);
}

Links read_links(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw InputError(file.string(), "cannot be read", "run the scene with --links");
    const std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    const std::string start = bytes.substr(0, 512);
    const std::size_t vertices = count_of(start, "vertex"), edges = count_of(start, "edge");
    const std::string expected = header(vertices, edges);
    constexpr std::size_t max_count = std::numeric_limits<std::uint32_t>::max();
    if (vertices > max_count || edges > max_count || bytes.compare(0, expected.size(), expected) != 0 ||
        bytes.size() != expected.size() + vertices * vertex_bytes + edges * edge_bytes)
        throw InputError(file.string(), "is not a complete file of links",
                         "run the scene again with --links");
    Links out;
    std::size_t at = expected.size();
    for (std::size_t k = 0; k < vertices; ++k) {
        const double x = take<double>(bytes, at), y = take<double>(bytes, at);
        out.positions.emplace_back(x, y, take<double>(bytes, at));
    }
    for (std::size_t k = 0; k < edges; ++k) {
        const auto a = take<std::uint32_t>(bytes, at), b = take<std::uint32_t>(bytes, at);
        out.links.push_back({a, b, take<float>(bytes, at)});
        if (a >= vertices || b >= vertices)
            throw InputError(file.string(), "link " + std::to_string(k) + " names no phyxel");
    }
    return out;
}

}  // namespace splitcubes::app
