#include "surface_file.h"

#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

namespace splitcubes::torture {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

namespace {

enum class Kind : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
    std::string name;
    bool is_list = false;
    Kind count = Kind::uint8, kind = Kind::uint8;
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

Kind kind_of(const std::string& name) {
    static const std::map<std::string, Kind> kinds = {
        {"char", Kind::int8},      {"int8", Kind::int8},       {"uchar", Kind::uint8},
        {"uint8", Kind::uint8},    {"short", Kind::int16},     {"int16", Kind::int16},
        {"ushort", Kind::uint16},  {"uint16", Kind::uint16},   {"int", Kind::int32},
        {"int32", Kind::int32},    {"uint", Kind::uint32},     {"uint32", Kind::uint32},
        {"float", Kind::float32},  {"float32", Kind::float32}, {"double", Kind::float64},
        {"float64", Kind::float64}};
    const auto found = kinds.find(name);
    if (found == kinds.end()) throw std::runtime_error("unknown type " + name);
    return found->second;
}

class Bytes {
  public:
    Bytes(const std::string& bytes, std::size_t at) : bytes_(bytes), at_(at) {}

    double next(Kind kind) {
        switch (kind) {
            case Kind::int8:
                return raw<std::int8_t>();
            case Kind::uint8:
                return raw<std::uint8_t>();
            case Kind::int16:
                return raw<std::int16_t>();
            case Kind::uint16:
                return raw<std::uint16_t>();
            case Kind::int32:
                return raw<std::int32_t>();
            case Kind::uint32:
                return raw<std::uint32_t>();
            case Kind::float32:
                return static_cast<double>(raw<float>());
            default:
                return raw<double>();
        }
    }
    bool at_end() const { return at_ == bytes_.size(); }

  private:
    template <class T>
    T raw() {
        if (bytes_.size() - at_ < sizeof(T)) throw std::runtime_error("the file ends too early");
        T out;
        std::memcpy(&out, bytes_.data() + at_, sizeof(T));
        at_ += sizeof(T);
        return out;
    }

    const std::string& bytes_;
    std::size_t at_;
};

// Returns the elements and where the data begin.
std::vector<Element> parse_header(const std::string& bytes, std::size_t& data) {
    const std::string last = "end_header\n";
    const std::size_t end = bytes.find(last);
    if (bytes.rfind("ply\n", 0) != 0 || end == std::string::npos) throw std::runtime_error("not a PLY file");
    data = end + last.size();
    std::istringstream lines(bytes.substr(0, end));
    std::vector<Element> out;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string word, type;
        words >> word;
        if (word == "format") {
            words >> type;
            if (type != "binary_little_endian") throw std::runtime_error("format " + type + ", not binary");
        } else if (word == "element") {
            Element element;
            words >> element.name >> element.count;
            if (element.count > bytes.size()) throw std::runtime_error("more elements than bytes");
            out.push_back(element);
        } else if (word == "property") {
            if (out.empty()) throw std::runtime_error("a property of nothing");
            Property property;
            words >> type;
            property.is_list = type == "list";
            if (property.is_list) {
                words >> type;
                property.count = kind_of(type);
                words >> type;
            }
            property.kind = kind_of(type);
            words >> property.name;
            out.back().properties.push_back(property);
        }
    }
    return out;
}

void take_vertex(Surface& out, const Element& element, Bytes& bytes) {
    Vec3 x = Vec3::Zero(), rest = Vec3::Zero();
    bool has_rest = false;
    int piece = 0;
    for (const Property& p : element.properties) {
        if (p.is_list) throw std::runtime_error("a list in a vertex");
        const double value = bytes.next(p.kind);
        if (p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z') x[p.name[0] - 'x'] = value;
        if (p.name.size() == 6 && p.name.rfind("rest_", 0) == 0) {
            rest[p.name[5] - 'x'] = value;
            has_rest = true;
        }
        if (p.name == "piece") piece = static_cast<int>(value);
    }
    out.positions.push_back(x);
    out.piece.push_back(piece);
    if (has_rest) out.rest.push_back(rest);
}

void take_face(Surface& out, const Element& element, Bytes& bytes) {
    for (const Property& p : element.properties) {
        if (!p.is_list) {
            bytes.next(p.kind);
            continue;
        }
        const auto count = static_cast<std::size_t>(bytes.next(p.count));
        if (p.name != "vertex_indices") {
            for (std::size_t k = 0; k < count; ++k) bytes.next(p.kind);
            continue;
        }
        if (count != 3) throw std::runtime_error("a face of " + std::to_string(count) + " corners");
        std::array<int, 3> triangle;
        for (int& corner : triangle) {
            corner = static_cast<int>(bytes.next(p.kind));
            if (corner < 0 || static_cast<std::size_t>(corner) >= out.positions.size())
                throw std::runtime_error("vertex " + std::to_string(corner) + " is out of range");
        }
        out.triangles.push_back(triangle);
    }
}

}  // namespace

Surface parse_surface(const std::string& bytes, const std::string& name) {
    try {
        std::size_t data = 0;
        const std::vector<Element> elements = parse_header(bytes, data);
        Bytes rest(bytes, data);
        Surface out;
        for (const Element& element : elements)
            for (std::size_t k = 0; k < element.count; ++k) {
                if (element.name == "vertex") take_vertex(out, element, rest);
                if (element.name == "face") take_face(out, element, rest);
            }
        if (!rest.at_end()) throw std::runtime_error("bytes follow the last element");
        return out;
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(name + ": " + error.what());
    }
}

Surface read_surface(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    return parse_surface(bytes, file.string());
}

std::string encode_surface(const Surface& surface) {
    std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(surface.positions.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nproperty int piece\n";
    if (!surface.rest.empty())
        out += "property double rest_x\nproperty double rest_y\nproperty double rest_z\n";
    out += "element face " + std::to_string(surface.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
    const auto add = [&](const auto& value) {
        out.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    for (std::size_t v = 0; v < surface.positions.size(); ++v) {
        for (const double x : surface.positions[v]) add(x);
        add(static_cast<std::int32_t>(surface.piece[v]));
        if (!surface.rest.empty())
            for (const double x : surface.rest[v]) add(x);
    }
    for (const std::array<int, 3>& triangle : surface.triangles) {
        out += '\3';
        for (const int corner : triangle) add(static_cast<std::int32_t>(corner));
    }
    return out;
}

}  // namespace splitcubes::torture
