#include <splitcubes/core/error.h>
#include <splitcubes/io/byte_reader.h>
#include <splitcubes/io/mesh_builder.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/ply_header.h>
#include <splitcubes/io/text_cursor.h>

#include <cmath>
#include <limits>
#include <optional>

namespace splitcubes::io {

namespace {

using geometry::Origin;

/// Numbers of a text body. Lines mean nothing: some writers wrap them.
class AsciiBody {
  public:
    AsciiBody(Bytes bytes, const std::string& name, const PlyHeader& header)
        : cursor_(as_text(bytes.subspan(header.body_offset)), name, header.body_line) {}

    double scalar(PlyType type, const char* what) {
        const std::string_view word = cursor_.word();
        if (word.empty())
            fail("the file ends within " + std::string(what), "the file was cut off or its header lies");
        return type >= PlyType::float32 ? cursor_.number(word, what)
                                        : static_cast<double>(cursor_.integer(word, what));
    }
    /// Numbers that are not used may be anything.
    void skip(PlyType, std::uint64_t count) {
        for (std::uint64_t i = 0; i < count; ++i)
            if (cursor_.word().empty())
                fail("the file ends within a value", "the file was cut off or its header lies");
    }
    std::size_t bytes_left() const {
        return cursor_.bytes_left() + 1;
    }  // a last number needs nothing behind it
    void expect_end() {
        const std::string_view word = cursor_.word();
        if (!word.empty())
            fail(in_quotes(word) + " follows the last element", "the header's counts are too small");
    }
    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        cursor_.fail(problem, remedy);
    }

  private:
    TextCursor cursor_;
};

class BinaryBody {
  public:
    BinaryBody(Bytes bytes, const std::string& name, const PlyHeader& header)
        : reader_(bytes, name,
                  header.encoding == PlyEncoding::big_endian ? std::endian::big : std::endian::little,
                  header.body_offset) {}

    double scalar(PlyType type, const char* what) {
        switch (type) {
            case PlyType::int8:
                return reader_.read<std::int8_t>(what);
            case PlyType::uint8:
                return reader_.read<std::uint8_t>(what);
            case PlyType::int16:
                return reader_.read<std::int16_t>(what);
            case PlyType::uint16:
                return reader_.read<std::uint16_t>(what);
            case PlyType::int32:
                return reader_.read<std::int32_t>(what);
            case PlyType::uint32:
                return reader_.read<std::uint32_t>(what);
            case PlyType::float32:
                return reader_.read<float>(what);
            case PlyType::float64:
                return reader_.read<double>(what);
        }
        return 0;
    }
    /// count <= 2^32, so the product cannot overflow.
    void skip(PlyType type, std::uint64_t count) { reader_.take(byte_count(type) * count, "a value"); }
    std::size_t bytes_left() const { return reader_.bytes_left(); }
    void expect_end() {
        // Some writers end the last line.
        while (bytes_left() > 0) {
            const auto byte = reader_.read<std::uint8_t>("the end");
            if (byte != '\n' && byte != '\r')
                fail("there are bytes behind the last element", "the header's counts are too small");
        }
    }
    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        reader_.fail(problem, remedy);
    }

  private:
    ByteReader reader_;
};

template <class Body>
class PlyReader {
  public:
    /// The header must have an element `vertex`.
    PlyReader(Body body, const PlyHeader& header, const std::string& name, PlyContent content,
              ReadMeshReport& report)
        : body_(std::move(body)),
          header_(header),
          name_(name),
          with_attributes_(content == PlyContent::surface),
          report_(report) {}

    geometry::SurfaceMesh read() {
        vertex_count_ = header_.find("vertex")->count;
        if (vertex_count_ > max_vertex_count)
            throw InputError(name_ + ":" + std::to_string(header_.find("vertex")->line),
                             std::to_string(vertex_count_) + " vertices are too many", "split the mesh");
        for (const PlyElement& element : header_.elements) {
            check_count(element);
            if (element.name == "vertex")
                read_vertices(element);
            else if (element.name == "face")
                read_faces(element);
            else
                skip_element(element);
        }
        body_.expect_end();
        surface_.mesh = builder_.finish(name_, report_, with_attributes_);
        return std::move(surface_);
    }

  private:
    /// A count must fit the bytes that are left, before anything goes by it.
    void check_count(const PlyElement& element) const {
        const std::size_t least = element.least_bytes(header_.encoding);
        if (least == 0) return;  // takes no bytes, and nothing is read for it
        const std::uint64_t room = body_.bytes_left() / least;
        if (element.count > room)
            throw InputError(name_ + ":" + std::to_string(element.line),
                             "the header claims " + std::to_string(element.count) + " of element " +
                                 in_quotes(element.name) + " but the bytes left hold at most " +
                                 std::to_string(room),
                             "the file was cut off or its header lies");
    }

    void read_vertices(const PlyElement& element) {
        const std::vector<int> slots = vertex_slots(element);
        const bool has_normals =
            with_attributes_ && element.find("nx") && element.find("ny") && element.find("nz");
        const bool has_pieces = with_attributes_ && element.find("piece");
        builder_.mesh.positions.reserve(element.count);
        if (has_normals) surface_.normals.reserve(element.count);
        if (has_pieces) surface_.vertex_piece.reserve(element.count);
        for (std::uint64_t v = 0; v < element.count; ++v) {
            double values[slot_count] = {};
            for (std::size_t p = 0; p < slots.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                if (slots[p] < 0)
                    skip_property(property);
                else
                    values[slots[p]] = finite(body_.scalar(property.type, "a vertex"), property.name);
            }
            builder_.mesh.positions.emplace_back(values[0], values[1], values[2]);
            if (has_normals) surface_.normals.emplace_back(values[3], values[4], values[5]);
            if (has_pieces) surface_.vertex_piece.push_back(piece_number(values[6]));
        }
    }

    /// Where the value of each property goes: x y z nx ny nz piece, or -1.
    std::vector<int> vertex_slots(const PlyElement& element) const {
        static const char* const names[slot_count] = {"x", "y", "z", "nx", "ny", "nz", "piece"};
        std::vector<int> slots(element.properties.size(), -1);
        const int wanted = with_attributes_ ? slot_count : 3;
        for (int s = 0; s < wanted; ++s) {
            const PlyProperty* found = element.find(names[s]);
            if ((!found && s < 3) || (found && found->is_list))
                throw InputError(name_ + ":" + std::to_string(element.line),
                                 "vertices have no number " + in_quotes(names[s]),
                                 "they need properties x, y and z");
            if (found) slots[static_cast<std::size_t>(found - element.properties.data())] = s;
        }
        return slots;
    }

    void read_faces(const PlyElement& element) {
        const PlyProperty* indices = element.find("vertex_indices");
        if (!indices) indices = element.find("vertex_index");
        if (!indices || !indices->is_list)
            throw InputError(name_ + ":" + std::to_string(element.line),
                             "faces have no list 'vertex_indices' or 'vertex_index'", "they need one");
        const PlyProperty* origin = with_attributes_ ? element.find("origin") : nullptr;
        if (origin && origin->is_list) origin = nullptr;
        for (std::uint64_t f = 0; f < element.count; ++f) {
            double origin_value = 0;
            for (const PlyProperty& property : element.properties) {
                if (&property == indices)
                    read_corners(property);
                else if (&property == origin)
                    origin_value = body_.scalar(property.type, "a face's origin");
                else
                    skip_property(property);
            }
            const std::size_t added = builder_.add_polygon(corners_);
            if (origin)
                surface_.triangle_origin.insert(surface_.triangle_origin.end(), added,
                                                origin_of(origin_value));
        }
    }

    void read_corners(const PlyProperty& property) {
        const std::uint64_t count = list_count(property);
        if (count < 3)
            body_.fail("a face has " + std::to_string(count) + " corners", "it needs three or more");
        corners_.clear();
        for (std::uint64_t i = 0; i < count; ++i) {
            const double index = body_.scalar(property.type, "a face");
            if (!(index >= 0) || index >= static_cast<double>(vertex_count_) || std::floor(index) != index)
                body_.fail("face corner " + number_text(index) + " is out of range: there are " +
                               std::to_string(vertex_count_) + " vertices",
                           "indices count from 0");
            corners_.push_back(static_cast<std::uint32_t>(index));
        }
    }

    std::uint64_t list_count(const PlyProperty& property) {
        const double count = body_.scalar(property.count_type, "a list's length");
        if (count < 0 || count > static_cast<double>(body_.bytes_left()))
            body_.fail("a list has length " + number_text(count) + " and " +
                           std::to_string(body_.bytes_left()) + " bytes are left",
                       "the file was cut off or is damaged");
        return static_cast<std::uint64_t>(count);
    }

    void skip_property(const PlyProperty& property) {
        body_.skip(property.type, property.is_list ? list_count(property) : 1);
    }

    void skip_element(const PlyElement& element) {
        report_.notes.push_back("element " + in_quotes(element.name) + " (" + std::to_string(element.count) +
                                ") was passed over");
        if (element.properties.empty()) return;
        for (std::uint64_t i = 0; i < element.count; ++i)
            for (const PlyProperty& property : element.properties) skip_property(property);
    }

    double finite(double value, const std::string& property) const {
        if (!std::isfinite(value))
            body_.fail("vertex property " + in_quotes(property) + " is " + number_text(value),
                       "it must be finite");
        return value;
    }
    std::int32_t piece_number(double value) const {
        using Limits = std::numeric_limits<std::int32_t>;
        if (value < Limits::min() || value > Limits::max() || std::floor(value) != value)
            body_.fail("a vertex's piece is " + number_text(value), "it must be a whole number of 32 bits");
        return static_cast<std::int32_t>(value);
    }
    Origin origin_of(double value) const {
        if (value != 0 && value != 1)
            body_.fail("a face's origin is " + number_text(value), "it must be 0 (boundary) or 1 (cut)");
        return value == 0 ? Origin::boundary : Origin::cut;
    }
    static std::string number_text(double value) {
        return std::floor(value) == value && std::abs(value) < 1e15
                   ? std::to_string(static_cast<std::int64_t>(value))
                   : std::to_string(value);
    }

    static constexpr int slot_count = 7;

    Body body_;
    const PlyHeader& header_;
    const std::string& name_;
    const bool with_attributes_;
    ReadMeshReport& report_;
    MeshBuilder builder_;
    geometry::SurfaceMesh surface_;
    std::vector<std::uint32_t> corners_;  // of the face being read
    std::uint64_t vertex_count_ = 0;      // as claimed: the faces may come first
};

}  // namespace

geometry::SurfaceMesh read_ply(Bytes bytes, const std::string& name, PlyContent content,
                               ReadMeshReport& report) {
    const PlyHeader header = read_ply_header(bytes, name);
    if (!header.find("vertex"))
        throw InputError(name + ":" + std::to_string(header.body_line - 1),
                         "the header has no element 'vertex'", "give a file with a triangle mesh");
    if (header.encoding == PlyEncoding::ascii)
        return PlyReader(AsciiBody(bytes, name, header), header, name, content, report).read();
    return PlyReader(BinaryBody(bytes, name, header), header, name, content, report).read();
}

}  // namespace splitcubes::io
