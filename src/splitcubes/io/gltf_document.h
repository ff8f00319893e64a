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
#include <optional>
#include <string>
#include <vector>

namespace splitcubes::io {

using Json = nlohmann::json;

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

    /// root[list][index]; throws where there is none. `user`: who asks, for the message.
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

    /// How many elements these two readers give; checked against the bytes that they lie in.
    std::size_t vector_count(std::uint64_t accessor, const std::string& user) const;
    std::size_t index_count(std::uint64_t accessor, const std::string& user) const;
    /// VEC3 of any component type, normalized integers mapped to their range (section 3.6.2.2).
    std::vector<Vec3> read_vectors(std::uint64_t accessor, const std::string& user) const;
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

}  // namespace splitcubes::io
