// Materials, textures and images of a glTF document (sections 3.8.2, 3.8.3 and 3.9).
#include <splitcubes/core/error.h>
#include <splitcubes/io/base64.h>
#include <splitcubes/io/gltf_document.h>

#include <algorithm>
#include <array>

namespace splitcubes::io {

using geometry::Material;

namespace {

/// The member if it is an object, else null.
const Json* object(const Json& json, const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_object() ? &*found : nullptr;
}

std::string text(const Json& json, const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::string location_in(const char* list, std::uint64_t index) {
    return std::string(list) + "[" + std::to_string(index) + "]";
}

const char* extension_of(const std::string& mime_type) {
    constexpr std::array<std::pair<const char*, const char*>, 4> known = {
        {{"image/png", ".png"}, {"image/jpeg", ".jpg"}, {"image/webp", ".webp"}, {"image/ktx2", ".ktx2"}}};
    for (const auto& [type, extension] : known)
        if (mime_type == type) return extension;
    return nullptr;
}

/// A name that can be a file's on any system: letters, digits, - and _.
std::string file_stem(const std::string& name) {
    std::string out;
    for (const char c : name.substr(0, 40)) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        out += plain || c == '-' ? c : '_';
    }
    return out;
}

}  // namespace

GltfMaterials::GltfMaterials(const GltfDocument& document, ReadMeshReport& report)
    : document_(document), report_(report), image_budget_(document.byte_total()) {
    const std::size_t count = document_.element_count("materials");
    for (std::size_t k = 0; k < count; ++k) {
        const std::string where = location_in("materials", k);
        const Json& json = document_.element("materials", k, where);
        Material material{.name = text(json, "name"), .colour = {1, 1, 1, 1}, .texture = {}, .image = {}};
        if (material.name.empty()) material.name = "material " + std::to_string(k);
        uv_sets_.push_back(0);
        if (const Json* shading = object(json, "pbrMetallicRoughness")) {
            const std::vector<double> colour = document_.numbers(*shading, "baseColorFactor", 4, where);
            for (std::size_t i = 0; i < colour.size(); ++i) material.colour[i] = channel(colour[i]);
            if (const Json* texture = object(*shading, "baseColorTexture"))
                read_texture(*texture, where + ".baseColorTexture", material);
        }
        materials_.push_back(std::move(material));
    }
    if (transforms_ > 0)
        report_.notes.push_back(std::to_string(transforms_) + " texture transforms were passed over");
    if (dropped_ > 0) report_.notes.push_back(std::to_string(dropped_) + " images could not be kept");
}

std::uint64_t GltfMaterials::uv_set(std::int32_t material) const {
    return material < 0 ? 0 : uv_sets_[static_cast<std::size_t>(material)];
}

void GltfMaterials::read_texture(const Json& info, const std::string& where, Material& material) {
    uv_sets_.back() = document_.count(info, "texCoord", where).value_or(0);
    if (const Json* extensions = object(info, "extensions"))
        transforms_ += extensions->contains("KHR_texture_transform") ? 1 : 0;
    const auto index = document_.count(info, "index", where);
    if (!index) return;
    const Json& texture = document_.element("textures", *index, where);
    // Without a source the picture is in a format of an extension.
    if (const auto source = document_.count(texture, "source", location_in("textures", *index)))
        read_image(*source, where, material);
    else
        ++dropped_;
}

void GltfMaterials::read_image(std::uint64_t index, const std::string& where, Material& material) {
    const Json& image = document_.element("images", index, where);
    const std::string own = location_in("images", index);
    const std::string uri = text(image, "uri");
    if (const auto view = document_.count(image, "bufferView", own)) {
        keep_image(image, index, document_.view(*view, own), text(image, "mimeType"), material);
    } else if (uri.starts_with("data:")) {
        const std::size_t comma = std::min(uri.find(','), uri.size() - 1);
        const std::string head = uri.substr(5, comma - 5);
        std::optional<std::vector<std::byte>> bytes(std::in_place);
        if (!images_[index]) bytes = decode_base64(std::string_view(uri).substr(comma + 1));
        if (bytes && head.ends_with(";base64"))
            keep_image(image, index, *bytes, head.substr(0, head.find(';')), material);
        else
            ++dropped_;
    } else if (!uri.empty()) {
        material.texture =
            resolved_texture(percent_decoded(uri), document_.folder(), document_.folder(), report_);
    }
}

/// Views may overlap and images repeat, so the sum is held to the size of the file.
void GltfMaterials::keep_image(const Json& image, std::uint64_t index, Bytes bytes,
                               const std::string& mime_type, Material& material) {
    std::shared_ptr<const geometry::EmbeddedImage>& kept = images_[index];
    const char* const extension = extension_of(mime_type);
    if (!kept && (!extension || bytes.size() > image_budget_)) {
        ++dropped_;
        return;
    }
    if (!kept) {
        image_budget_ -= bytes.size();
        kept = std::make_shared<geometry::EmbeddedImage>(
            geometry::EmbeddedImage{mime_type, {bytes.begin(), bytes.end()}});
    }
    // The name of an image that stood in a file before may end as the file's did.
    const std::string name = file_stem(std::filesystem::path(text(image, "name")).stem().string());
    material.texture = (name.empty() ? "image" + std::to_string(index) : name) + extension;
    material.image = kept;
}

}  // namespace splitcubes::io
