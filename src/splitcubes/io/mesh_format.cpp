#include <splitcubes/io/mesh_format.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/text_encoding.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace splitcubes::io {

std::optional<MeshFormat> format_of_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (extension == ".obj") return MeshFormat::obj;
    if (extension == ".ply") return MeshFormat::ply;
    if (extension == ".stl") return MeshFormat::stl;
    if (extension == ".gltf" || extension == ".glb") return MeshFormat::gltf;
    return std::nullopt;
}

namespace {

/// Whether the text's first lines that are neither blank nor a comment begin an OBJ file.
bool looks_like_obj(std::string_view text) {
    constexpr std::array<std::string_view, 9> openings = {"v", "vn", "vt",     "f",     "g",
                                                          "o", "s",  "mtllib", "usemtl"};
    std::size_t at = 0;
    while (at < text.size()) {
        const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
        std::string_view line = text.substr(at, end - at);
        at = end + 1;
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        if (line.empty() || line.front() == '#') continue;
        const std::string_view word = line.substr(0, line.find_first_of(" \t"));
        return std::find(openings.begin(), openings.end(), word) != openings.end();
    }
    return false;
}

}  // namespace

std::optional<MeshFormat> format_of_content(std::span<const std::byte> bytes) {
    bytes = without_byte_order_mark(bytes);
    const std::string_view text = as_text(bytes);
    if (text.starts_with("ply\n") || text.starts_with("ply\r")) return MeshFormat::ply;
    if (text.starts_with("glTF")) return MeshFormat::gltf;
    if (is_binary_stl(bytes)) return MeshFormat::stl;
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos) return std::nullopt;
    if (text[first] == '{') return MeshFormat::gltf;
    const std::string_view rest = text.substr(first);
    if (rest.starts_with("solid") && rest.find("facet") != std::string_view::npos) return MeshFormat::stl;
    if (looks_like_obj(text)) return MeshFormat::obj;
    return std::nullopt;
}

}  // namespace splitcubes::io
