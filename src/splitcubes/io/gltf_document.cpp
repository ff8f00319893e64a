#include <splitcubes/core/error.h>
#include <splitcubes/io/base64.h>
#include <splitcubes/io/byte_reader.h>
#include <splitcubes/io/gltf_document.h>
#include <splitcubes/io/text_cursor.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace splitcubes::io {

namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t json_chunk = 0x4e4f534a;  // "JSON"
constexpr std::uint32_t bin_chunk = 0x004e4942;   // "BIN", 0

std::string indexed(const char* list, std::uint64_t index) {
    return std::string(list) + "[" + std::to_string(index) + "]";
}

/// Bytes of a component (section 3.6.2.2); 0 for an unknown type.
std::size_t component_bytes(std::uint64_t type) {
    switch (type) {
        case 5120:
        case 5121:
            return 1;
        case 5122:
        case 5123:
            return 2;
        case 5125:
        case 5126:
            return 4;
        default:
            return 0;
    }
}

int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

}  // namespace

std::string percent_decoded(const std::string& text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool escaped = text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 &&
                             hex_digit(text[i + 2]) >= 0;
        if (escaped) {
            out += static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
            i += 2;
        } else {
            out += text[i];
        }
    }
    return out;
}

GltfDocument::GltfDocument(Bytes bytes, std::string name, fs::path folder)
    : name_(std::move(name)), folder_(std::move(folder)), byte_total_(bytes.size()) {
    if (as_text(bytes).starts_with("glTF"))
        parse_container(bytes);
    else
        parse_json(as_text(bytes), 0);
    const Json::const_iterator asset = root_.find("asset");
    if (asset == root_.end() || !asset->is_object() || !asset->contains("version") ||
        !(*asset)["version"].is_string())
        fail("asset.version", "is missing", "the file is no glTF");
    const std::string version = (*asset)["version"].get<std::string>();
    if (!version.starts_with("2.")) fail("asset.version", "is " + in_quotes(version), "glTF 2.0 can be read");
    load_buffers();
}

void GltfDocument::fail(const std::string& where, const std::string& problem,
                        const std::string& remedy) const {
    throw InputError(name_ + ": " + where, problem, remedy);
}

/// Section 4.4: a header of 12 bytes, then chunks of length, type, content.
void GltfDocument::parse_container(Bytes bytes) {
    ByteReader reader(bytes, name_, std::endian::little);
    reader.take(4, "the GLB header");  // the magic "glTF"
    const auto version = reader.read<std::uint32_t>("the GLB header");
    if (version != 2) reader.fail("GLB version " + std::to_string(version), "version 2 can be read");
    const auto length = reader.read<std::uint32_t>("the GLB header");
    if (length != bytes.size())
        reader.fail("the header says " + std::to_string(length) + " bytes, but there are " +
                        std::to_string(bytes.size()),
                    "the file was cut off or is damaged");
    bool has_json = false;
    while (reader.bytes_left() > 0) {
        const auto chunk_length = reader.read<std::uint32_t>("a chunk's header");
        const auto type = reader.read<std::uint32_t>("a chunk's header");
        const std::size_t offset = reader.offset();
        const Bytes chunk = reader.take(chunk_length, "a chunk");
        if (!has_json && type != json_chunk)
            reader.fail("the first chunk is not JSON", "the file is damaged");
        if (!has_json) parse_json(as_text(chunk), offset);
        if (has_json && type == bin_chunk && !binary_chunk_) binary_chunk_ = chunk;
        has_json = true;  // chunks of other types are passed over, as the section demands
    }
    if (!has_json) reader.fail("there is no JSON chunk", "the file was cut off");
}

void GltfDocument::parse_json(std::string_view text, std::size_t offset) {
    try {
        root_ = Json::parse(text);
    } catch (const Json::parse_error& error) {
        throw InputError(at_byte(name_, offset + error.byte), "the JSON is malformed",
                         "the file was cut off or is damaged");
    } catch (const Json::exception&) {
        throw InputError(name_, "its JSON holds a number that is too large", "the file is damaged");
    }
    if (!root_.is_object()) throw InputError(name_, "the JSON is no object", "the file is no glTF");
}

void GltfDocument::load_buffers() {
    const std::size_t count = element_count("buffers");
    for (std::size_t i = 0; i < count; ++i) {
        const std::string where = indexed("buffers", i);
        const Json& buffer = element("buffers", i, where);
        const std::uint64_t length = this->count(buffer, "byteLength", where).value_or(0);
        const auto uri = buffer.find("uri");
        Bytes bytes;
        if (uri == buffer.end()) {
            if (i != 0 || !binary_chunk_)
                fail(where, "has neither a uri nor a binary chunk", "the file is damaged");
            bytes = *binary_chunk_;
        } else {
            if (!uri->is_string())
                fail(where + ".uri", "is no text", "it should name a file or hold base64 data");
            bytes = bytes_of_uri(uri->get_ref<const std::string&>(), where + ".uri");
        }
        if (length == 0 || length > bytes.size())
            fail(where + ".byteLength",
                 "is " + std::to_string(length) + " but there are " + std::to_string(bytes.size()) + " bytes",
                 "the buffer was cut off or is damaged");
        buffers_.push_back(bytes.first(length));
    }
}

Bytes GltfDocument::keep(std::vector<std::byte> bytes) {
    byte_total_ += bytes.size();
    owned_.push_back(std::move(bytes));
    return owned_.back();
}

Bytes GltfDocument::bytes_of_uri(const std::string& uri, const std::string& where) {
    if (!uri.starts_with("data:")) return bytes_of_file(percent_decoded(uri), where);
    const std::size_t comma = uri.find(',');
    if (comma == uri.npos || !std::string_view(uri).substr(0, comma).ends_with(";base64"))
        fail(where, "is a data URI without base64", "store the buffer as base64 or as a file");
    std::optional<std::vector<std::byte>> bytes = decode_base64(std::string_view(uri).substr(comma + 1));
    if (!bytes) fail(where, "holds malformed base64", "the file is damaged");
    return keep(std::move(*bytes));
}

Bytes GltfDocument::bytes_of_file(const std::string& relative, const std::string& where) {
    if (folder_.empty())
        fail(where, "refers to " + in_quotes(relative) + ", which data from memory cannot",
             "use GLB or base64");
    if (!is_beside_or_below(relative))
        fail(where, "refers to " + in_quotes(relative) + ", outside of the file's folder", "copy it there");
    const fs::path path = fs::path(relative).lexically_normal();
    // A document that names one file a thousand times gets it once.
    const auto known = files_.find(path);
    if (known != files_.end()) return known->second;
    return files_[path] = keep(read_file_bytes(folder_ / path));
}

std::vector<fs::path> GltfDocument::files() const {
    std::vector<fs::path> out;
    for (const auto& [path, bytes] : files_) out.push_back(path);
    return out;
}

std::size_t GltfDocument::element_count(const char* list) const {
    const Json* found = array(root_, list, "the document");
    return found ? found->size() : 0;
}

const Json& GltfDocument::element(const char* list, std::uint64_t index, const std::string& user) const {
    const Json* found = array(root_, list, "the document");
    const std::size_t size = found ? found->size() : 0;
    if (index >= size)
        fail(user, "refers to " + indexed(list, index) + " but there are " + std::to_string(size),
             "the file is damaged");
    const Json& value = (*found)[index];
    if (!value.is_object()) fail(indexed(list, index), "is no object", "the file is damaged");
    return value;
}

const Json* GltfDocument::array(const Json& object, const char* key, const std::string& where) const {
    const auto found = object.find(key);
    if (found == object.end()) return nullptr;
    if (!found->is_array()) fail(where + "." + key, "is no array", "the file is damaged");
    return &*found;
}

std::optional<std::uint64_t> GltfDocument::count(const Json& object, const char* key,
                                                 const std::string& where) const {
    const auto found = object.find(key);
    if (found == object.end()) return std::nullopt;
    return to_count(*found, where + "." + key);
}

std::uint64_t GltfDocument::to_count(const Json& value, const std::string& where) const {
    // Far above any file's size and far below what sums and products could overflow from.
    constexpr std::uint64_t limit = std::uint64_t{1} << 48;
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > limit)
        fail(where, "is " + in_quotes(value.dump()), "it must be a whole number, 0 or more");
    return value.get<std::uint64_t>();
}

std::vector<double> GltfDocument::numbers(const Json& object, const char* key, std::size_t length,
                                          const std::string& where) const {
    const Json* list = array(object, key, where);
    if (!list) return {};
    const std::string what = where + "." + key;
    if (list->size() != length)
        fail(what, "has " + std::to_string(list->size()) + " numbers",
             "it must have " + std::to_string(length));
    std::vector<double> values;
    for (const Json& value : *list) {
        if (!value.is_number() || !std::isfinite(value.get<double>()))
            fail(what, "holds something else than a finite number", "the file is damaged");
        values.push_back(value.get<double>());
    }
    return values;
}

Bytes GltfDocument::view_bytes(std::uint64_t view, std::size_t element_bytes, std::size_t& stride,
                               const std::string& user) const {
    const Json& json = element("bufferViews", view, user);
    const std::string where = indexed("bufferViews", view);
    const std::uint64_t buffer = count(json, "buffer", where).value_or(buffers_.size());
    if (buffer >= buffers_.size())
        fail(where + ".buffer", "there is no buffer " + std::to_string(buffer), "the file is damaged");
    const std::uint64_t offset = count(json, "byteOffset", where).value_or(0);
    const std::uint64_t length = count(json, "byteLength", where).value_or(0);
    if (offset > buffers_[buffer].size() || length > buffers_[buffer].size() - offset)
        fail(where,
             "bytes " + std::to_string(offset) + " to " + std::to_string(offset + length) +
                 " of a buffer of " + std::to_string(buffers_[buffer].size()),
             "the file was cut off or is damaged");
    // Section 3.6.2.4: packed unless a stride of 4 to 252 is given.
    const std::uint64_t given = count(json, "byteStride", where).value_or(element_bytes);
    if (given != element_bytes && (given < 4 || given > 252 || given < element_bytes))
        fail(where + ".byteStride",
             "is " + std::to_string(given) + " for elements of " + std::to_string(element_bytes) + " bytes",
             "it must be 4 to 252 and hold an element");
    stride = given;
    return buffers_[buffer].subspan(offset, length);
}

GltfDocument::Accessor GltfDocument::accessor(std::uint64_t index, const char* type, std::size_t components,
                                              const std::string& user) const {
    const Json& json = element("accessors", index, user);
    Accessor out;
    out.where = indexed("accessors", index);
    const auto found_type = json.find("type");
    if (found_type == json.end() || *found_type != type)
        fail(out.where + ".type", "is not " + std::string(type), "it is needed for " + user);
    const std::uint64_t component_type = count(json, "componentType", out.where).value_or(0);
    const std::size_t element_bytes = components * component_bytes(component_type);
    if (element_bytes == 0)
        fail(out.where + ".componentType", "is " + std::to_string(component_type), "5120 to 5126 are known");
    out.component_type = static_cast<int>(component_type);
    if (const auto normalized = json.find("normalized"); normalized != json.end())
        out.normalized = normalized->is_boolean() && normalized->get<bool>();
    if (json.contains("sparse"))
        fail(out.where, "is sparse, which cannot be read", "export the mesh without sparse accessors");
    const std::optional<std::uint64_t> view = count(json, "bufferView", out.where);
    if (!view) fail(out.where, "has no bufferView", "compressed and empty accessors cannot be read");
    const Bytes bytes = view_bytes(*view, element_bytes, out.stride, out.where);
    const std::uint64_t offset = count(json, "byteOffset", out.where).value_or(0);
    const std::uint64_t wanted = count(json, "count", out.where).value_or(0);
    if (wanted == 0) fail(out.where + ".count", "is 0 or missing", "it must be 1 or more");
    const std::uint64_t room = offset > bytes.size() || bytes.size() - offset < element_bytes
                                   ? 0
                                   : (bytes.size() - offset - element_bytes) / out.stride + 1;
    if (wanted > room)
        fail(out.where + ".count",
             "is " + std::to_string(wanted) + " but its bufferView holds " + std::to_string(room),
             "the file was cut off or is damaged");
    out.bytes = bytes.subspan(offset);
    out.count = wanted;
    return out;
}

double GltfDocument::component(const Accessor& from, std::size_t element, std::size_t index) const {
    const std::byte* at = from.bytes.data() + element * from.stride;
    constexpr auto order = std::endian::little;
    switch (from.component_type) {
        case 5120: {
            const double value = load_number<std::int8_t>(at + index, order);
            return from.normalized ? std::max(value / 127, -1.0) : value;
        }
        case 5121: {
            const double value = load_number<std::uint8_t>(at + index, order);
            return from.normalized ? value / 255 : value;
        }
        case 5122: {
            const double value = load_number<std::int16_t>(at + 2 * index, order);
            return from.normalized ? std::max(value / 32767, -1.0) : value;
        }
        case 5123: {
            const double value = load_number<std::uint16_t>(at + 2 * index, order);
            return from.normalized ? value / 65535 : value;
        }
        case 5125:
            return load_number<std::uint32_t>(at + 4 * index, order);
        default:
            return load_number<float>(at + 4 * index, order);
    }
}

std::size_t GltfDocument::vector_count(std::uint64_t index, const std::string& user) const {
    return accessor(index, "VEC3", 3, user).count;
}

std::size_t GltfDocument::index_count(std::uint64_t index, const std::string& user) const {
    return accessor(index, "SCALAR", 1, user).count;
}

std::vector<Vec3> GltfDocument::read_vectors(std::uint64_t index, const std::string& user) const {
    const Accessor from = accessor(index, "VEC3", 3, user);
    std::vector<Vec3> values;
    values.reserve(from.count);
    for (std::size_t i = 0; i < from.count; ++i) {
        values.emplace_back(component(from, i, 0), component(from, i, 1), component(from, i, 2));
        if (!values.back().allFinite())
            fail(from.where, "element " + std::to_string(i) + " is not finite", "coordinates must be finite");
    }
    return values;
}

std::vector<float> GltfDocument::read_floats(std::uint64_t index, const char* type, std::size_t components,
                                             const std::string& user) const {
    const Accessor from = accessor(index, type, components, user);
    std::vector<float> values;
    values.reserve(from.count * components);
    for (std::size_t i = 0; i < from.count; ++i)
        for (std::size_t k = 0; k < components; ++k) {
            const std::optional<float> value = finite_float(component(from, i, k));
            if (!value) fail(from.where, "element " + std::to_string(i) + " is not finite", "it must be");
            values.push_back(*value);
        }
    return values;
}

std::string GltfDocument::type_of(std::uint64_t index, const std::string& user) const {
    const Json& json = element("accessors", index, user);
    const auto type = json.find("type");
    return type != json.end() && type->is_string() ? type->get<std::string>() : std::string();
}

Bytes GltfDocument::view(std::uint64_t index, const std::string& user) const {
    std::size_t stride = 0;
    return view_bytes(index, 1, stride, user);
}

std::vector<std::uint32_t> GltfDocument::read_indices(std::uint64_t index, const std::string& user) const {
    const Accessor from = accessor(index, "SCALAR", 1, user);
    if (from.component_type != 5121 && from.component_type != 5123 && from.component_type != 5125)
        fail(from.where + ".componentType", "is " + std::to_string(from.component_type),
             "indices must be 5121, 5123 or 5125");
    std::vector<std::uint32_t> values;
    values.reserve(from.count);
    for (std::size_t i = 0; i < from.count; ++i) {
        const std::byte* at = from.bytes.data() + i * from.stride;
        if (from.component_type == 5121)
            values.push_back(load_number<std::uint8_t>(at, std::endian::little));
        else if (from.component_type == 5123)
            values.push_back(load_number<std::uint16_t>(at, std::endian::little));
        else
            values.push_back(load_number<std::uint32_t>(at, std::endian::little));
    }
    return values;
}

}  // namespace splitcubes::io
