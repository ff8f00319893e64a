#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/io/byte_reader.h>
#include <splitcubes/io/mesh_builder.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/ply_attributes.h>
#include <splitcubes/io/ply_header.h>
#include <splitcubes/io/text_cursor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

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
    PlyReader(Body body, const PlyHeader& header, const std::string& name,
              const std::filesystem::path& folder, PlyContent content, ReadMeshReport& report)
        : body_(std::move(body)),
          header_(header),
          name_(name),
          with_surface_(content == PlyContent::surface),
          report_(report),
          attributes_(header, folder, report) {}

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
        surface_.mesh = builder_.finish(name_, report_, with_surface_);
        surface_.attributes = attributes_.finish(surface_.mesh);
        return std::move(surface_);
    }

  private:
    /// A count must fit the bytes that are left, before anything goes by it.
    void check_count(const PlyElement& element) const {
        const std::size_t element_bytes = element.min_bytes(header_.encoding);
        if (element_bytes == 0) return;  // takes no bytes, and nothing is read for it
        const std::uint64_t room = body_.bytes_left() / element_bytes;
        if (element.count > room)
            throw InputError(name_ + ":" + std::to_string(element.line),
                             "the header claims " + std::to_string(element.count) + " of element " +
                                 in_quotes(element.name) + " but the bytes left hold at most " +
                                 std::to_string(room),
                             "the file was cut off or its header lies");
    }

    void read_vertices(const PlyElement& element) {
        const std::vector<int> slots = vertex_slots(element);
        const auto has = [&](int first, int last) {
            for (int s = first; s <= last; ++s)
                if (std::find(slots.begin(), slots.end(), s) == slots.end()) return false;
            return true;
        };
        const bool has_normals = has(slot_normal, slot_normal + 2), has_pieces = has(slot_piece, slot_piece),
                   has_rest = has(slot_rest, slot_rest + 2), has_uv = has(slot_uv, slot_uv + 1),
                   has_colours = has(slot_colour, slot_colour + 2), has_bodies = has(slot_body, slot_body);
        builder_.mesh.positions.reserve(element.count);
        for (std::uint64_t v = 0; v < element.count; ++v) {
            double values[slot_count] = {};
            values[slot_colour + 3] = 1;
            for (std::size_t p = 0; p < slots.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                if (slots[p] < 0)
                    skip_property(property);
                else
                    values[slots[p]] = vertex_value(property, slots[p]);
            }
            const auto vector_at = [&](int s) { return Vec3(values[s], values[s + 1], values[s + 2]); };
            builder_.mesh.positions.push_back(vector_at(0));
            if (has_normals) surface_.normals.push_back(vector_at(slot_normal));
            if (has_pieces)
                surface_.vertex_piece.push_back(whole_number(values[slot_piece], "a vertex's piece"));
            if (has_bodies)
                surface_.vertex_body.push_back(whole_number(values[slot_body], "a vertex's body"));
            if (has_rest) surface_.rest.push_back(vector_at(slot_rest));
            if (has_uv) attributes_.add_vertex_uv(uv_number(values[slot_uv]), uv_number(values[slot_uv + 1]));
            if (has_colours) attributes_.add_vertex_colour(values + slot_colour);
        }
    }

    double vertex_value(const PlyProperty& property, int slot) {
        const double value = finite(body_.scalar(property.type, "a vertex"), property.name);
        if (slot < slot_colour || slot > slot_colour + 3) return value;
        // Whole numbers run to 255, whatever holds them, but for those of 16 bits.
        if (property.type >= PlyType::float32) return value;
        return property.type == PlyType::uint16 ? value / 65535 : value / 255;
    }

    /// Returns the slot for the value of each property, or -1.
    std::vector<int> vertex_slots(const PlyElement& element) const {
        static const std::pair<const char*, int> names[] = {{"x", 0},
                                                            {"y", 1},
                                                            {"z", 2},
                                                            {"nx", slot_normal},
                                                            {"ny", slot_normal + 1},
                                                            {"nz", slot_normal + 2},
                                                            {"piece", slot_piece},
                                                            {"body", slot_body},
                                                            {"rest_x", slot_rest},
                                                            {"rest_y", slot_rest + 1},
                                                            {"rest_z", slot_rest + 2},
                                                            {"red", slot_colour},
                                                            {"green", slot_colour + 1},
                                                            {"blue", slot_colour + 2},
                                                            {"alpha", slot_colour + 3},
                                                            {"s", slot_uv},
                                                            {"t", slot_uv + 1},
                                                            {"u", slot_uv},
                                                            {"v", slot_uv + 1},
                                                            {"texture_u", slot_uv},
                                                            {"texture_v", slot_uv + 1}};
        std::vector<int> slots(element.properties.size(), -1);
        for (const auto& [property, slot] : names) {
            const PlyProperty* found = element.find(property);
            const bool needed = slot < 3;
            // Those for surfaces only keep the demand that they be numbers.
            const bool for_surface = (slot >= slot_normal && slot <= slot_piece) || slot == slot_body;
            if ((!found && needed) || (found && found->is_list && (needed || (for_surface && with_surface_))))
                throw InputError(name_ + ":" + std::to_string(element.line),
                                 "vertices have no number " + in_quotes(property),
                                 "they need properties x, y and z");
            if (!found || found->is_list ||
                (((slot >= 3 && slot < slot_colour) || slot == slot_body) && !with_surface_))
                continue;
            // Of several pairs of texture coordinates the first.
            if (std::find(slots.begin(), slots.end(), slot) == slots.end())
                slots[static_cast<std::size_t>(found - element.properties.data())] = slot;
        }
        return slots;
    }

    void read_faces(const PlyElement& element) {
        const PlyProperty* indices = element.find("vertex_indices");
        if (!indices) indices = element.find("vertex_index");
        if (!indices || !indices->is_list)
            throw InputError(name_ + ":" + std::to_string(element.line),
                             "faces have no list 'vertex_indices' or 'vertex_index'", "they need one");
        const auto scalar_property = [&](const char* property) {
            const PlyProperty* found = element.find(property);
            return found && !found->is_list ? found : nullptr;
        };
        const PlyProperty* origin = with_surface_ ? scalar_property("origin") : nullptr;
        const PlyProperty* cut = with_surface_ ? scalar_property("cut") : nullptr;
        const PlyProperty* material = scalar_property("material");
        const bool by_texture = !material;
        if (!material) material = scalar_property("texnumber");
        const PlyProperty* uv = element.find("texcoord");
        if (uv && !uv->is_list) uv = nullptr;
        for (std::uint64_t f = 0; f < element.count; ++f) {
            double origin_value = 0, material_value = -1, cut_value = -1;
            for (const PlyProperty& property : element.properties) {
                if (&property == indices)
                    read_corners(property);
                else if (&property == origin)
                    origin_value = body_.scalar(property.type, "a face's origin");
                else if (&property == cut)
                    cut_value = body_.scalar(property.type, "a face's cut");
                else if (&property == material)
                    material_value = body_.scalar(property.type, "a face's material");
                else if (&property == uv)
                    read_face_uv(property);
                else
                    skip_property(property);
            }
            const std::size_t before = builder_.mesh.triangles.size();
            const std::size_t added = builder_.add_polygon(corners_);
            if (origin)
                surface_.triangle_origin.insert(surface_.triangle_origin.end(), added,
                                                origin_of(origin_value));
            if (cut)
                surface_.triangle_cut.insert(surface_.triangle_cut.end(), added,
                                             whole_number(cut_value, "a face's cut"));
            if (uv) add_face_uv(before);
            if (material) attributes_.add_material(material_number(material_value), added, by_texture);
        }
    }

    void read_face_uv(const PlyProperty& property) {
        const std::uint64_t count = list_count(property);
        face_uv_.clear();
        for (std::uint64_t i = 0; i < count; ++i)
            face_uv_.push_back(uv_number(finite(body_.scalar(property.type, "a face"), property.name)));
    }

    /// Two numbers a corner, or none for a face without.
    void add_face_uv(std::size_t first_triangle) {
        if (!face_uv_.empty() && face_uv_.size() != 2 * corners_.size())
            body_.fail("a face of " + std::to_string(corners_.size()) + " corners has a texcoord of " +
                           std::to_string(face_uv_.size()) + " numbers",
                       "it must have two a corner or none");
        if (!face_uv_.empty()) attributes_.add_face_uv(first_triangle, builder_.added(), face_uv_);
    }

    float uv_number(double value) const {
        const std::optional<float> number = finite_float(value);
        if (!number) body_.fail("a texture coordinate is too large for single precision", "scale it down");
        return *number;
    }
    std::int32_t material_number(double value) const {
        if (!(value >= -1 && value <= std::numeric_limits<std::int32_t>::max()) || std::floor(value) != value)
            body_.fail("a face's material is " + plain_number(value),
                       "it must be a whole number, -1 or more");
        return static_cast<std::int32_t>(value);
    }

    void read_corners(const PlyProperty& property) {
        const std::uint64_t count = list_count(property);
        if (count < 3)
            body_.fail("a face has " + std::to_string(count) + " corners", "it needs three or more");
        corners_.clear();
        for (std::uint64_t i = 0; i < count; ++i) {
            const double index = body_.scalar(property.type, "a face");
            if (!(index >= 0) || index >= static_cast<double>(vertex_count_) || std::floor(index) != index)
                body_.fail("face corner " + plain_number(index) + " is out of range: there are " +
                               std::to_string(vertex_count_) + " vertices",
                           "indices count from 0");
            corners_.push_back(static_cast<std::uint32_t>(index));
        }
    }

    std::uint64_t list_count(const PlyProperty& property) {
        const double count = body_.scalar(property.count_type, "a list's length");
        if (count < 0 || count > static_cast<double>(body_.bytes_left()))
            body_.fail("a list has length " + plain_number(count) + " and " +
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
            body_.fail("vertex property " + in_quotes(property) + " is " + plain_number(value),
                       "it must be finite");
        return value;
    }
    std::int32_t whole_number(double value, const char* what) const {
        using Limits = std::numeric_limits<std::int32_t>;
        if (!(value >= Limits::min() && value <= Limits::max()) || std::floor(value) != value)
            body_.fail(std::string(what) + " is " + plain_number(value),
                       "it must be a whole number of 32 bits");
        return static_cast<std::int32_t>(value);
    }
    Origin origin_of(double value) const {
        if (value != 0 && value != 1)
            body_.fail("a face's origin is " + plain_number(value), "it must be 0 (boundary) or 1 (cut)");
        return value == 0 ? Origin::boundary : Origin::cut;
    }
    // Slots of a vertex's values; x y z come first.
    static constexpr int slot_normal = 3, slot_piece = 6, slot_rest = 7, slot_colour = 10, slot_uv = 14,
                         slot_body = 16, slot_count = 17;

    Body body_;
    const PlyHeader& header_;
    const std::string& name_;
    const bool with_surface_;
    ReadMeshReport& report_;
    MeshBuilder builder_;
    geometry::SurfaceMesh surface_;
    PlyAttributes attributes_;
    std::vector<std::uint32_t> corners_;  // of the face being read
    std::vector<float> face_uv_;          // its texcoord
    std::uint64_t vertex_count_ = 0;      // as claimed: the faces may come first
};

}  // namespace

geometry::SurfaceMesh read_ply(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
                               PlyContent content, ReadMeshReport& report) {
    const PlyHeader header = read_ply_header(bytes, name);
    if (!header.find("vertex"))
        throw InputError(name + ":" + std::to_string(header.body_line - 1),
                         "the header has no element 'vertex'", "give a file with a triangle mesh");
    if (header.encoding == PlyEncoding::ascii)
        return PlyReader(AsciiBody(bytes, name, header), header, name, folder, content, report).read();
    return PlyReader(BinaryBody(bytes, name, header), header, name, folder, content, report).read();
}

}  // namespace splitcubes::io
