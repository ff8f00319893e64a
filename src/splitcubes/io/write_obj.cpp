// Wavefront OBJ and its material libraries.
#include <splitcubes/io/mesh_writers.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <unordered_map>

namespace splitcubes::io {

using geometry::Material;
using geometry::Origin;
using geometry::Rgba;
using geometry::SurfaceMesh;
using geometry::Triangle;

namespace {

template <class Values>
void put_values(std::string& out, const Values& values) {
    for (const auto value : values) {
        out += ' ';
        put_text(out, value);
    }
}

class ObjWriter {
  public:
    ObjWriter(const Output& output, const std::string& library)
        : surface_(output.surface),
          attributes_(output.surface.attributes),
          names_(distinct_names(output.materials)),
          library_(library) {}

    std::string encode() {
        out_ = "# splitcubes surface, metres\n";
        out_.reserve(surface_.mesh.positions.size() * 120 + surface_.mesh.triangles.size() * 40);
        if (!names_.empty()) out_ += "mtllib " + library_ + "\n";
        put_vertices();
        put_texture_points();
        put_faces();
        return std::move(out_);
    }

  private:
    void put_vertices() {
        const std::vector<Rgba> colours = vertex_colours(surface_);
        for (std::size_t v = 0; v < surface_.mesh.positions.size(); ++v) {
            out_ += 'v';
            put_values(out_, surface_.mesh.positions[v]);
            if (!colours.empty()) put_values(out_, std::array{colours[v][0], colours[v][1], colours[v][2]});
            out_ += '\n';
        }
        for (const Vec3& normal : surface_.normals) {
            out_ += "vn";
            put_values(out_, normal);
            out_ += '\n';
        }
    }

    /// Texture coordinates of boundary corners, each pair once; rest positions of cut ones.
    void put_texture_points() {
        const bool with_uv = !attributes_.corner_uv.empty();
        const bool with_rest = !surface_.rest.empty();
        if (!with_uv && !with_rest) return;
        std::unordered_map<std::uint64_t, std::uint64_t> known;
        std::vector<std::uint64_t> of_vertex(with_rest ? surface_.rest.size() : 0, 0);
        texture_numbers_.resize(surface_.mesh.triangles.size());
        for (std::size_t t = 0; t < surface_.mesh.triangles.size(); ++t)
            for (std::size_t k = 0; k < 3; ++k) {
                if (with_rest && origin_of(surface_, t) == Origin::cut)
                    texture_numbers_[t][k] = rest_number(surface_.mesh.triangles[t][k], of_vertex);
                else if (with_uv)
                    texture_numbers_[t][k] = uv_number(attributes_.corner_uv[t][k], known);
            }
    }

    std::uint64_t rest_number(std::uint32_t vertex, std::vector<std::uint64_t>& of_vertex) {
        if (of_vertex[vertex] > 0) return of_vertex[vertex];
        out_ += "vt";
        put_values(out_, surface_.rest[vertex]);
        out_ += '\n';
        return of_vertex[vertex] = ++texture_count_;
    }

    std::uint64_t uv_number(const geometry::Uv& uv, std::unordered_map<std::uint64_t, std::uint64_t>& known) {
        const std::uint64_t bits =
            std::uint64_t{std::bit_cast<std::uint32_t>(uv[0])} << 32 | std::bit_cast<std::uint32_t>(uv[1]);
        std::uint64_t& number = known[bits];
        if (number > 0) return number;
        out_ += "vt";
        put_values(out_, uv);
        out_ += '\n';
        return number = ++texture_count_;
    }

    std::int32_t material_of(std::size_t t) const {
        return attributes_.triangle_material.empty() ? -1 : attributes_.triangle_material[t];
    }

    /// By material and, within one, by origin. Faces without a material come first:
    /// no statement ends one.
    void put_faces() {
        std::vector<std::size_t> order(surface_.mesh.triangles.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        const auto group = [&](std::size_t t) { return std::pair(material_of(t), origin_of(surface_, t)); };
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return group(a) < group(b); });
        for (std::size_t i = 0; i < order.size(); ++i) {
            const auto [material, origin] = group(order[i]);
            const bool first = i == 0;
            if (first || group(order[i - 1]).second != origin || group(order[i - 1]).first != material)
                out_ += std::string("g ") + name_of(origin) + "\n";
            if (attributes_.empty() && (first || group(order[i - 1]).second != origin))
                out_ += std::string("usemtl ") + name_of(origin) + "\n";
            if (material >= 0 && (first || group(order[i - 1]).first != material))
                out_ += "usemtl " + names_[static_cast<std::size_t>(material)] + "\n";
            put_face(order[i]);
        }
    }

    void put_face(std::size_t t) {
        out_ += 'f';
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t vertex = std::uint64_t{surface_.mesh.triangles[t][k]} + 1;
            const std::uint64_t texture = texture_numbers_.empty() ? 0 : texture_numbers_[t][k];
            out_ += ' ';
            put_text(out_, vertex);
            if (texture > 0 || !surface_.normals.empty()) out_ += '/';
            if (texture > 0) put_text(out_, texture);
            if (surface_.normals.empty()) continue;
            out_ += '/';
            put_text(out_, vertex);
        }
        out_ += '\n';
    }

    const SurfaceMesh& surface_;
    const geometry::MeshAttributes& attributes_;
    const std::vector<std::string> names_;  // of materials
    const std::string& library_;
    std::string out_;
    std::vector<std::array<std::uint64_t, 3>> texture_numbers_;  // per triangle, counted from 1; 0: none
    std::uint64_t texture_count_ = 0;
};

}  // namespace

std::string encode_obj(const Output& output, const std::string& library) {
    return ObjWriter(output, library).encode();
}

std::string encode_mtl(const std::vector<Material>& materials) {
    const std::vector<std::string> names = distinct_names(materials);
    std::string out = "# splitcubes materials\n";
    for (std::size_t k = 0; k < materials.size(); ++k) {
        const Rgba& colour = materials[k].colour;
        out += "newmtl " + names[k] + "\nKd";
        put_values(out, std::array{colour[0], colour[1], colour[2]});
        out += '\n';
        if (colour[3] != 1) {
            out += "d ";
            put_text(out, colour[3]);
            out += '\n';
        }
        if (!materials[k].texture.empty()) out += "map_Kd " + one_line(materials[k].texture) + "\n";
    }
    return out;
}

}  // namespace splitcubes::io
