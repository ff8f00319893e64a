// The parts of a glTF 2.0 document that say what is where: JSON, buffers,
// accessors. Internal to the module. After the Khronos glTF 2.0 specification.
#pragma once

#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/math/types.h>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::io {

using Json = nlohmann::json;

/// %20 and the like (RFC 3986, section 2.1).
std::string percent_decoded(const std::string& text);

/// Access by name and number that throws InputError with the path of what is
/// wrong, as `name: accessors[3].count`.
class GltfDocument {
  public:
    /// Takes both containers. Buffers outside of the file are looked for in
    /// `folder`, and refused where that is empty.
    GltfDocument(Bytes bytes, std::string name, std::filesystem::path folder);

    const Json& root() const { return root_; }
    /// Bytes of the document and its buffers: what output is bounded by.
    std::size_t byte_total() const { return byte_total_; }

    /// root[list][index]; throws where there is none. `user`: the caller, for the message.
    const Json& element(const char* list, std::uint64_t index, const std::string& user) const;
    /// Length of root[list]; 0 where there is none.
    std::size_t element_count(const char* list) const;

    /// The member, which must be an array if there; null where there is none.
    const Json* array(const Json& object, const char* key, const std::string& where) const;
    std::optional<std::uint64_t> count(const Json& object, const char* key, const std::string& where) const;
    std::uint64_t to_count(const Json& value, const std::string& where) const;
    /// `length` finite numbers; empty where there is no such member.
    std::vector<double> numbers(const Json& object, const char* key, std::size_t length,
                                const std::string& where) const;

    /// Return the number of elements of the two readers below; checked against the bytes that they lie in.
    std::size_t vector_count(std::uint64_t accessor, const std::string& user) const;
    std::size_t index_count(std::uint64_t accessor, const std::string& user) const;
    /// VEC3 of any component type, normalized integers mapped to their range (section 3.6.2.2).
    std::vector<Vec3> read_vectors(std::uint64_t accessor, const std::string& user) const;
    /// `components` numbers an element, of an accessor of this type (VEC2, VEC4), as above.
    std::vector<float> read_floats(std::uint64_t accessor, const char* type, std::size_t components,
                                   const std::string& user) const;
    /// The accessor's type, as VEC3; empty where it has none.
    std::string type_of(std::uint64_t accessor, const std::string& user) const;
    /// The bytes of a whole buffer view.
    Bytes view(std::uint64_t index, const std::string& user) const;
    /// The folder of the files that it may refer to; may be empty.
    const std::filesystem::path& folder() const { return folder_; }
    /// The buffers' files, relative to the folder.
    std::vector<std::filesystem::path> files() const;
    /// SCALAR of an unsigned type.
    std::vector<std::uint32_t> read_indices(std::uint64_t accessor, const std::string& user) const;

    [[noreturn]] void fail(const std::string& where, const std::string& problem,
                           const std::string& remedy) const;

  private:
    struct Accessor {
        Bytes bytes;  // from the first element on
        std::size_t count = 0;
        std::size_t stride = 0;  // bytes
        int component_type = 0;  // 5120 to 5126
        bool normalized = false;
        std::string where;
    };

    void parse_container(Bytes bytes);
    void parse_json(std::string_view text, std::size_t offset);
    void load_buffers();
    Bytes bytes_of_uri(const std::string& uri, const std::string& where);
    Bytes bytes_of_file(const std::string& relative, const std::string& where);
    Bytes keep(std::vector<std::byte> bytes);
    Bytes view_bytes(std::uint64_t view, std::size_t element_bytes, std::size_t& stride,
                     const std::string& user) const;
    Accessor accessor(std::uint64_t index, const char* type, std::size_t components,
                      const std::string& user) const;
    double component(const Accessor& from, std::size_t element, std::size_t index) const;

    std::string name_;
    std::filesystem::path folder_;
    Json root_;
    std::optional<Bytes> binary_chunk_;
    std::deque<std::vector<std::byte>> owned_;      // buffers that were decoded or read
    std::map<std::filesystem::path, Bytes> files_;  // of owned_, by path
    std::vector<Bytes> buffers_;                    // one per buffer of the document
    std::size_t byte_total_ = 0;
};

/// The materials of the document, one for each, with their base colours and
/// textures. Images inside of the file are kept where they fit its size; what
/// cannot be used is noted.
class GltfMaterials {
  public:
    GltfMaterials(const GltfDocument& document, ReadMeshReport& report);
    const std::vector<geometry::Material>& materials() const { return materials_; }
    std::vector<geometry::Material> take() { return std::move(materials_); }
    /// Which set of texture coordinates the material's base colour goes by.
    std::uint64_t uv_set(std::int32_t material) const;

  private:
    void read_texture(const Json& info, const std::string& where, geometry::Material& material);
    void read_image(std::uint64_t index, const std::string& where, geometry::Material& material);
    void keep_image(const Json& image, std::uint64_t index, Bytes bytes, const std::string& mime_type,
                    geometry::Material& material);

    const GltfDocument& document_;
    ReadMeshReport& report_;
    std::vector<geometry::Material> materials_;
    std::vector<std::uint64_t> uv_sets_;  // per material
    std::map<std::uint64_t, std::shared_ptr<const geometry::EmbeddedImage>> images_;
    std::size_t image_budget_;  // bytes that may still be kept
    std::size_t transforms_ = 0, dropped_ = 0;
};

}  // namespace splitcubes::io
