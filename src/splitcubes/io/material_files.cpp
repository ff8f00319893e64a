// Materials for all writers: names, pictures, colours of vertices.
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/mesh_writers.h>
#include <splitcubes/io/write_mesh.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

namespace splitcubes::io {

using geometry::EmbeddedImage;
using geometry::Material;
using geometry::Origin;
using geometry::Rgba;

std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; }, '_');
    return text;
}

std::vector<std::string> distinct_names(const std::vector<Material>& materials) {
    std::vector<std::string> names;
    std::set<std::string> taken;
    for (const Material& material : materials) {
        std::string name = one_line(material.name);
        while (name.ends_with(' ')) name.pop_back();
        name.erase(0, std::min(name.find_first_not_of(' '), name.size()));
        if (name.empty()) name = "material";
        std::string distinct = name;
        for (int k = 1; !taken.insert(distinct).second; ++k) distinct = name + "_" + std::to_string(k);
        names.push_back(distinct);
    }
    return names;
}

std::vector<Rgba> vertex_colours(const geometry::SurfaceMesh& surface) {
    const auto& corners = surface.attributes.corner_colour;
    if (corners.empty()) return {};
    struct Sum {
        std::array<double, 4> colour{};
        std::size_t count = 0;
    };
    // Of boundary corners and of cut ones.
    std::vector<std::array<Sum, 2>> sums(surface.mesh.positions.size());
    for (std::size_t t = 0; t < corners.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t kind = origin_of(surface, t) == Origin::cut ? 1 : 0;
            Sum& sum = sums[surface.mesh.triangles[t][k]][kind];
            for (std::size_t i = 0; i < 4; ++i) sum.colour[i] += static_cast<double>(corners[t][k][i]);
            ++sum.count;
        }
    std::vector<Rgba> out;
    out.reserve(sums.size());
    for (const std::array<Sum, 2>& both : sums) {
        const Sum& sum = both[0].count > 0 ? both[0] : both[1];
        Rgba& colour = out.emplace_back(Rgba{1, 1, 1, 1});
        for (std::size_t i = 0; i < 4 && sum.count > 0; ++i)
            colour[i] = static_cast<float>(sum.colour[i] / static_cast<double>(sum.count));
    }
    return out;
}

namespace {

bool holds(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return false;
    if (std::filesystem::file_size(path, error) != bytes.size() || error) return false;
    std::ifstream file(path, std::ios::binary);
    std::vector<char> there(bytes.size());
    file.read(there.data(), static_cast<std::streamsize>(there.size()));
    return file && std::memcmp(there.data(), bytes.data(), bytes.size()) == 0;
}

/// Nobody names these pictures, so none takes the place of a file that is there.
bool is_free_for(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::symlink_status(path, error);
    return status.type() == std::filesystem::file_type::not_found || holds(path, bytes);
}

}  // namespace

void write_images(const std::filesystem::path& folder, const std::string& prefix,
                  std::vector<Material>& materials,
                  const std::function<void(const std::filesystem::path&)>& before) {
    std::vector<std::pair<std::shared_ptr<const EmbeddedImage>, std::string>> written;
    std::set<std::string> taken;
    for (Material& material : materials) {
        if (!material.image) continue;
        const auto known = std::find_if(written.begin(), written.end(), [&](const auto& one) {
            return one.first == material.image || *one.first == *material.image;
        });
        if (known != written.end()) {
            material.texture = known->second;
            material.image = nullptr;
            continue;
        }
        const std::filesystem::path wished(material.texture);
        const std::string stem = prefix + "-" + wished.stem().string();
        std::string name = stem + wished.extension().string();
        const std::vector<std::byte>& bytes = material.image->bytes;
        for (int k = 1; !taken.insert(name).second || !is_free_for(folder / name, bytes); ++k)
            name = stem + "-" + std::to_string(k) + wished.extension().string();
        if (before) before(folder / name);
        AtomicFile file(folder / name);
        file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        file.commit();
        material.texture = (folder / name).generic_string();
        written.emplace_back(std::exchange(material.image, nullptr), material.texture);
    }
}

}  // namespace splitcubes::io
