#include <splitcubes/io/ply_attributes.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace splitcubes::io {

using geometry::Material;
using geometry::Rgba;
using geometry::Uv;

namespace {

/// The next word of a text, taken off it with the blanks around.
std::string_view take_word(std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    const std::string_view word = text.substr(0, text.find_first_of(" \t"));
    text.remove_prefix(word.size());
    return word;
}

template <class Number>
bool take_number(std::string_view& text, Number& value) {
    const std::string_view word = take_word(text);
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return !word.empty() && error == std::errc() && stop == word.data() + word.size();
}

std::string_view trimmed(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    return text.substr(0, text.find_last_not_of(" \t") + 1);
}

}  // namespace

PlyAttributes::PlyAttributes(const PlyHeader& header, const std::filesystem::path& folder,
                             ReadMeshReport& report) {
    for (const std::string& comment : header.comments) read_comment(comment, folder, report);
}

void PlyAttributes::read_comment(const std::string& comment, const std::filesystem::path& folder,
                                 ReadMeshReport& report) {
    std::string_view rest = comment;
    const std::string_view keyword = take_word(rest);
    if (keyword == "TextureFile") {
        const std::string name(trimmed(rest));
        if (commented_ < 0) {
            commented_ = static_cast<std::int32_t>(out_.materials.size());
            out_.materials.push_back({.name = std::filesystem::path(name).stem().string(),
                                      .colour = {1, 1, 1, 1},
                                      .texture = {},
                                      .image = {}});
        }
        out_.materials[static_cast<std::size_t>(commented_)].texture =
            resolved_texture(name, folder, folder, report);
        by_texture_.push_back(std::exchange(commented_, -1));
    } else if (keyword == "material") {
        std::int32_t number = 0;
        Rgba colour{};
        bool good = take_number(rest, number) && number >= 0;
        for (float& value : colour) {
            double read = 0;
            good = good && take_number(rest, read);
            value = channel(read);
        }
        // Other programs' comments may begin with the same word.
        if (!good || by_number_.contains(number)) return;
        commented_ = static_cast<std::int32_t>(out_.materials.size());
        by_number_.emplace(number, commented_);
        out_.materials.push_back(
            {.name = std::string(trimmed(rest)), .colour = colour, .texture = {}, .image = {}});
    }
}

void PlyAttributes::add_vertex_colour(const double* colour) {
    vertex_colour_.push_back(
        {channel(colour[0]), channel(colour[1]), channel(colour[2]), channel(colour[3])});
}

void PlyAttributes::add_face_uv(std::size_t first, std::span<const std::array<std::uint32_t, 3>> added,
                                std::span<const float> uv) {
    out_.corner_uv.resize(first);
    for (const auto& corners : added) {
        std::array<Uv, 3>& to = out_.corner_uv.emplace_back();
        for (std::size_t k = 0; k < 3; ++k)
            to[k] = {uv[std::size_t{2} * corners[k]], uv[std::size_t{2} * corners[k] + 1]};
    }
}

void PlyAttributes::add_material(std::int32_t number, std::size_t count, bool by_texture) {
    std::int32_t own = -1;
    if (number >= 0 && by_texture && static_cast<std::size_t>(number) < by_texture_.size()) {
        own = by_texture_[static_cast<std::size_t>(number)];
    } else if (number >= 0) {
        const auto next = static_cast<std::int32_t>(out_.materials.size());
        // Numbers of texture files and of materials may overlap.
        const auto [found, is_new] = by_number_.emplace(number, next);
        if (is_new)
            out_.materials.push_back(
                {.name = "material " + std::to_string(number), .texture = {}, .image = {}});
        own = found->second;
    }
    out_.triangle_material.insert(out_.triangle_material.end(), count, own);
}

geometry::MeshAttributes PlyAttributes::finish(const geometry::TriangleMesh& mesh) {
    const std::size_t count = mesh.triangles.size();
    const auto by_vertex = [&](const auto& values, auto& corners) {
        corners.clear();
        corners.reserve(count);
        for (const geometry::Triangle& t : mesh.triangles)
            corners.push_back({values[t[0]], values[t[1]], values[t[2]]});
    };
    if (!out_.corner_uv.empty())
        out_.corner_uv.resize(count);
    else if (!vertex_uv_.empty())
        by_vertex(vertex_uv_, out_.corner_uv);
    if (!vertex_colour_.empty()) by_vertex(vertex_colour_, out_.corner_colour);
    // A file with one texture need not say which faces have it.
    const bool one_texture = out_.triangle_material.empty() && by_texture_.size() == 1;
    if (one_texture && !out_.corner_uv.empty()) out_.triangle_material.assign(count, by_texture_.front());
    if (out_.triangle_material.empty()) out_.materials.clear();
    return std::move(out_);
}

}  // namespace splitcubes::io
