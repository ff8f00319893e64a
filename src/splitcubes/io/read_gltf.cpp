#include <splitcubes/geometry/srgb.h>
#include <splitcubes/io/gltf_document.h>
#include <splitcubes/io/mesh_builder.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/text_cursor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace splitcubes::io {

namespace {

using geometry::srgb_from_linear;
using geometry::Triangle;

// Limit on vertices, corners and primitives per byte of the file (a vertex takes twelve): nodes may use a
// mesh several times, but a small file must not fill the memory.
constexpr std::size_t elements_per_byte = 8;
constexpr std::size_t min_budget = std::size_t{1} << 20;

// Required extensions that leave positions and triangles as they are; section
// 3.12 demands that others are refused.
constexpr std::array<std::string_view, 6> harmless_extensions = {"KHR_materials_", "KHR_texture_",
                                                                 "KHR_lights_",    "KHR_mesh_quantization",
                                                                 "EXT_texture_",   "KHR_node_visibility"};

constexpr std::array<geometry::Rgba, 3> white = {{{1, 1, 1, 1}, {1, 1, 1, 1}, {1, 1, 1, 1}}};

enum Mode : std::uint64_t { mode_triangles = 4, mode_strip = 5, mode_fan = 6 };

class GltfReader {
  public:
    GltfReader(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
               ReadMeshReport& report)
        : document_(bytes, name, folder),
          name_(name),
          report_(report),
          budget_(std::max(min_budget, elements_per_byte * document_.byte_total())),
          materials_(document_, report) {}

    Model read() {
        check_extensions();
        if (document_.element_count("nodes") == 0)
            add_all_meshes();
        else
            walk_nodes();
        note(skipped_primitives_, "primitives of points or lines were passed over");
        note(skinned_nodes_, "skinned meshes were taken in their bind pose");
        note(morphed_, "primitives with morph targets were taken without them");
        note(unreached_, "nodes outside of the scene were passed over");
        for (const std::filesystem::path& file : document_.files())
            report_.files.push_back(document_.folder() / file);
        Model model;
        model.mesh = builder_.finish(name_, report_);
        if (rest_.size() == model.mesh.positions.size()) model.rest = std::move(rest_);
        model.attributes = std::move(attributes_);
        fill_up(model.mesh.triangles.size(), model.attributes);
        if (!model.attributes.triangle_material.empty()) model.attributes.materials = materials_.take();
        return model;
    }

  private:
    /// Attributes of a primitive, by vertex; empty: the primitive has none.
    struct VertexAttributes {
        std::vector<float> uv;      // two a vertex
        std::vector<float> colour;  // four a vertex, linear
        std::int32_t material = -1;
    };
    struct Visit {
        std::uint64_t node;
        Eigen::Affine3d world_from_parent;
    };

    /// glTF is y-up (section 3.4), all else z-up.
    static Eigen::Affine3d own_from_gltf() {
        Eigen::Affine3d out = Eigen::Affine3d::Identity();
        out.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
        return out;
    }

    void note(std::size_t count, const char* what) {
        if (count > 0) report_.notes.push_back(std::to_string(count) + " " + what);
    }

    void check_extensions() const {
        const Json* required = document_.array(document_.root(), "extensionsRequired", "the document");
        if (!required) return;
        for (const Json& extension : *required) {
            if (!extension.is_string())
                document_.fail("extensionsRequired", "holds no text", "the file is damaged");
            const auto& text = extension.get_ref<const std::string&>();
            const bool harmless =
                std::any_of(harmless_extensions.begin(), harmless_extensions.end(),
                            [&](std::string_view prefix) { return text.starts_with(prefix); });
            if (!harmless)
                document_.fail("extensionsRequired", "needs " + in_quotes(text) + ", which is not known",
                               "export the mesh without it");
        }
    }

    /// Without nodes the file is a store of meshes; they are taken where they are.
    void add_all_meshes() {
        for (std::size_t m = 0; m < document_.element_count("meshes"); ++m)
            add_mesh(m, own_from_gltf(), "the document");
    }

    /// The scene's nodes, depth first, by a stack of our own: a file may nest as
    /// deep as it likes. Nodes must form trees (section 3.5.2), so none is met twice.
    void walk_nodes() {
        std::vector<bool> seen(document_.element_count("nodes"), false);
        std::vector<Visit> stack;
        push_reversed(root_nodes(), own_from_gltf(), stack);
        while (!stack.empty()) {
            const Visit visit = stack.back();
            stack.pop_back();
            const std::string where = "nodes[" + std::to_string(visit.node) + "]";
            const Json& node = document_.element("nodes", visit.node, "a scene or node");
            if (seen[visit.node]) document_.fail(where, "is reached twice", "nodes must form trees");
            seen[visit.node] = true;
            const Eigen::Affine3d world_from_node = visit.world_from_parent * local_transform(node, where);
            if (const auto mesh = document_.count(node, "mesh", where)) {
                // Section 3.7.3.3: a skinned mesh is placed by its joints, not by its node.
                const bool skinned = node.contains("skin");
                skinned_nodes_ += skinned ? 1 : 0;
                add_mesh(*mesh, skinned ? own_from_gltf() : world_from_node, where);
            }
            push_reversed(indices(node, "children", where), world_from_node, stack);
        }
        unreached_ = static_cast<std::size_t>(std::count(seen.begin(), seen.end(), false));
    }

    static void push_reversed(const std::vector<std::uint64_t>& nodes,
                              const Eigen::Affine3d& world_from_parent, std::vector<Visit>& stack) {
        for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
            stack.push_back({*node, world_from_parent});
    }

    std::vector<std::uint64_t> indices(const Json& object, const char* key, const std::string& where) const {
        std::vector<std::uint64_t> out;
        if (const Json* list = document_.array(object, key, where))
            for (const Json& value : *list) out.push_back(document_.to_count(value, where + "." + key));
        return out;
    }

    /// Of the default scene, else of the first one, else all that are nobody's children.
    std::vector<std::uint64_t> root_nodes() const {
        const auto chosen = document_.count(document_.root(), "scene", "the document");
        if (chosen || document_.element_count("scenes") > 0)
            return indices(document_.element("scenes", chosen.value_or(0), "scene"), "nodes", "scenes");
        std::vector<bool> is_child(document_.element_count("nodes"), false);
        for (std::size_t n = 0; n < is_child.size(); ++n)
            for (const std::uint64_t child :
                 indices(document_.element("nodes", n, "nodes"), "children", "nodes"))
                if (child < is_child.size()) is_child[child] = true;
        std::vector<std::uint64_t> roots;
        for (std::size_t n = 0; n < is_child.size(); ++n)
            if (!is_child[n]) roots.push_back(n);
        return roots;
    }

    /// Section 3.5.3: a matrix by columns, or translation, rotation (x y z w) and scale.
    Eigen::Affine3d local_transform(const Json& node, const std::string& where) const {
        Eigen::Affine3d transform = Eigen::Affine3d::Identity();
        const std::vector<double> matrix = document_.numbers(node, "matrix", 16, where);
        if (!matrix.empty()) {
            const Eigen::Matrix4d full = Eigen::Map<const Eigen::Matrix4d>(matrix.data());
            if (full.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
                document_.fail(where + ".matrix", "does not end in 0 0 0 1 by rows",
                               "only affine transforms can be read");
            transform.matrix() = full;
            return transform;
        }
        const std::vector<double> t = document_.numbers(node, "translation", 3, where);
        const std::vector<double> r = document_.numbers(node, "rotation", 4, where);
        const std::vector<double> s = document_.numbers(node, "scale", 3, where);
        if (!t.empty()) transform.translation() = Vec3(t[0], t[1], t[2]);
        if (!r.empty()) {
            const Quat rotation(r[3], r[0], r[1], r[2]);
            const double norm = rotation.norm();
            if (!(std::abs(norm - 1) < 1e-2))
                document_.fail(where + ".rotation", "has length " + std::to_string(norm),
                               "it must be a unit quaternion");
            transform.linear() = Quat(rotation.coeffs() / norm).toRotationMatrix();
        }
        if (!s.empty()) transform.linear() = transform.linear() * Vec3(s[0], s[1], s[2]).asDiagonal();
        return transform;
    }

    void add_mesh(std::uint64_t index, const Eigen::Affine3d& world_from_mesh, const std::string& user) {
        const Json& mesh = document_.element("meshes", index, user);
        const std::string where = "meshes[" + std::to_string(index) + "]";
        const Json* primitives = document_.array(mesh, "primitives", where);
        if (!primitives) document_.fail(where, "has no primitives", "the file is damaged");
        // Primitives that share an accessor share its vertices, which keeps a
        // surface closed that only its materials divide.
        std::map<std::uint64_t, std::uint32_t> first_vertex_of_accessor;
        for (std::size_t p = 0; p < primitives->size(); ++p) {
            const std::string location = where + ".primitives[" + std::to_string(p) + "]";
            spend(1, location);
            const Json& primitive = (*primitives)[p];
            if (!primitive.is_object()) document_.fail(location, "is no object", "the file is damaged");
            add_primitive(primitive, location, world_from_mesh, first_vertex_of_accessor);
        }
    }

    void add_primitive(const Json& primitive, const std::string& where,
                       const Eigen::Affine3d& world_from_mesh,
                       std::map<std::uint64_t, std::uint32_t>& first_vertex_of_accessor) {
        const std::uint64_t mode = document_.count(primitive, "mode", where).value_or(mode_triangles);
        if (mode > mode_fan)
            document_.fail(where + ".mode", "is " + std::to_string(mode), "it must be 0 to 6");
        if (mode < mode_triangles) {
            ++skipped_primitives_;
            return;
        }
        if (primitive.contains("targets")) ++morphed_;
        const auto attributes = primitive.find("attributes");
        if (attributes == primitive.end() || !attributes->is_object())
            document_.fail(where, "has no attributes", "the file is damaged");
        const auto position = document_.count(*attributes, "POSITION", where);
        if (!position) document_.fail(where, "has no POSITION", "the file is damaged");
        const std::size_t before = builder_.mesh.positions.size();
        const std::uint32_t first =
            add_positions(*position, where, world_from_mesh, first_vertex_of_accessor);
        if (builder_.mesh.positions.size() > before) add_rest(*attributes, before, where);
        const std::size_t vertex_count = document_.vector_count(*position, where);
        const std::vector<std::uint32_t> corners = corner_indices(primitive, where, vertex_count);
        const VertexAttributes vertices = vertex_attributes(primitive, *attributes, where, vertex_count);
        // Section 3.7.4: a transform that mirrors turns the triangles round.
        add_triangles(corners, first, vertices, mode, world_from_mesh.linear().determinant() < 0, where);
    }

    VertexAttributes vertex_attributes(const Json& primitive, const Json& attributes,
                                       const std::string& where, std::size_t vertex_count) {
        VertexAttributes out;
        if (const auto material = document_.count(primitive, "material", where)) {
            document_.element("materials", *material, where);  // for its check
            out.material = static_cast<std::int32_t>(*material);
        }
        const std::string uv_name = "TEXCOORD_" + std::to_string(materials_.uv_set(out.material));
        if (const auto uv = document_.count(attributes, uv_name.c_str(), where)) {
            spend(vertex_count, where);
            out.uv = document_.read_floats(*uv, "VEC2", 2, where);
            check_count(out.uv.size() / 2, vertex_count, where + "." + uv_name);
            // Here the picture's upper left corner is (0, 0).
            for (std::size_t i = 1; i < out.uv.size(); i += 2) out.uv[i] = 1 - out.uv[i];
        }
        if (const auto colour = document_.count(attributes, "COLOR_0", where)) {
            spend(vertex_count, where);
            const bool opaque = document_.type_of(*colour, where) == "VEC3";
            const std::size_t width = opaque ? 3 : 4;
            const std::vector<float> values =
                document_.read_floats(*colour, opaque ? "VEC3" : "VEC4", width, where);
            check_count(values.size() / width, vertex_count, where + ".COLOR_0");
            for (std::size_t i = 0; i < values.size(); i += width) {
                out.colour.insert(out.colour.end(), values.begin() + static_cast<std::ptrdiff_t>(i),
                                  values.begin() + static_cast<std::ptrdiff_t>(i + width));
                if (opaque) out.colour.push_back(1);
            }
        }
        return out;
    }

    void check_count(std::size_t count, std::size_t vertex_count, const std::string& where) const {
        if (count != vertex_count)
            document_.fail(where,
                           "has " + std::to_string(count) + " elements for " + std::to_string(vertex_count) +
                               " vertices",
                           "there must be one each");
    }

    std::uint32_t add_positions(std::uint64_t accessor, const std::string& where,
                                const Eigen::Affine3d& world_from_mesh,
                                std::map<std::uint64_t, std::uint32_t>& first_vertex_of_accessor) {
        const auto known = first_vertex_of_accessor.find(accessor);
        if (known != first_vertex_of_accessor.end()) return known->second;
        const std::size_t count = document_.vector_count(accessor, where);
        spend(count, where);
        std::vector<Vec3>& positions = builder_.mesh.positions;
        if (count > max_vertex_count - positions.size())
            document_.fail(where, "there are too many vertices", "split the mesh");
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (const Vec3& position : document_.read_vectors(accessor, where)) {
            positions.emplace_back(world_from_mesh * position);
            if (!positions.back().allFinite())
                document_.fail(where, "its node's transform makes a coordinate infinite",
                               "scale the mesh down");
        }
        first_vertex_of_accessor.emplace(accessor, first);
        return first;
    }

    /// Rest positions, of the vertices from `before` on; meshes of other programs have none.
    void add_rest(const Json& attributes, std::size_t before, const std::string& where) {
        const auto accessor = document_.count(attributes, "_REST", where);
        if (!accessor || document_.type_of(*accessor, where) != "VEC3") return;
        const std::size_t count = builder_.mesh.positions.size() - before;
        if (document_.vector_count(*accessor, where) != count) return;
        spend(count, where);
        rest_.resize(before, Vec3::Zero());
        for (const Vec3& rest : document_.read_vectors(*accessor, where))
            rest_.emplace_back(own_from_gltf() * rest);
    }

    std::vector<std::uint32_t> corner_indices(const Json& primitive, const std::string& where,
                                              std::size_t vertex_count) {
        std::vector<std::uint32_t> corners;
        const auto accessor = document_.count(primitive, "indices", where);
        spend(accessor ? document_.index_count(*accessor, where) : vertex_count, where);
        if (!accessor) {
            for (std::size_t i = 0; i < vertex_count; ++i) corners.push_back(static_cast<std::uint32_t>(i));
            return corners;
        }
        corners = document_.read_indices(*accessor, where);
        for (std::size_t i = 0; i < corners.size(); ++i)
            if (corners[i] >= vertex_count)
                document_.fail(where,
                               "index " + std::to_string(corners[i]) + " (number " + std::to_string(i) +
                                   ") is out of range: there are " + std::to_string(vertex_count) +
                                   " vertices",
                               "indices count from 0");
        return corners;
    }

    /// Section 3.7.2.1. corners: of the primitive's own vertices, the first of which is number `first`.
    void add_triangles(const std::vector<std::uint32_t>& corners, std::uint32_t first,
                       const VertexAttributes& vertices, std::uint64_t mode, bool mirrored,
                       const std::string& where) {
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            const Triangle own = mirrored ? Triangle{a, c, b} : Triangle{a, b, c};
            if (builder_.add_triangle({own[0] + first, own[1] + first, own[2] + first}))
                add_attributes(own, vertices);
        };
        const std::size_t count = corners.size();
        if (count < 3 || (mode == mode_triangles && count % 3 != 0))
            document_.fail(where, std::to_string(count) + " corners do not make triangles",
                           "the file is damaged");
        if (mode == mode_triangles)
            for (std::size_t i = 0; i < count; i += 3) add(corners[i], corners[i + 1], corners[i + 2]);
        else if (mode == mode_strip)
            for (std::size_t i = 0; i + 2 < count; ++i)
                add(corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]);
        else
            for (std::size_t i = 1; i + 1 < count; ++i) add(corners[i], corners[i + 1], corners[0]);
    }

    /// Of the triangle that was added last.
    void add_attributes(const Triangle& own, const VertexAttributes& vertices) {
        const std::size_t before = builder_.mesh.triangles.size() - 1;
        if (!vertices.uv.empty()) {
            attributes_.corner_uv.resize(before);
            auto& to = attributes_.corner_uv.emplace_back();
            for (std::size_t k = 0; k < 3; ++k)
                to[k] = {vertices.uv[std::size_t{2} * own[k]], vertices.uv[std::size_t{2} * own[k] + 1]};
        }
        if (!vertices.colour.empty()) {
            attributes_.corner_colour.resize(before, white);
            auto& to = attributes_.corner_colour.emplace_back();
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t i = 0; i < 4; ++i) {
                    const float value = vertices.colour[std::size_t{4} * own[k] + i];
                    to[k][i] = i < 3 ? srgb_from_linear(value) : channel(value);
                }
        }
        if (vertices.material >= 0) {
            attributes_.triangle_material.resize(before, -1);
            attributes_.triangle_material.push_back(vertices.material);
        }
    }

    /// Arrays end with the last triangle that has the attribute.
    static void fill_up(std::size_t count, geometry::MeshAttributes& attributes) {
        if (!attributes.corner_uv.empty()) attributes.corner_uv.resize(count);
        if (!attributes.corner_colour.empty()) attributes.corner_colour.resize(count, white);
        if (!attributes.triangle_material.empty()) attributes.triangle_material.resize(count, -1);
    }

    void spend(std::size_t amount, const std::string& where) {
        if (amount > budget_)
            document_.fail(where, "the nodes unfold the meshes to far more than the file holds",
                           "apply fewer instances");
        budget_ -= amount;
    }

    GltfDocument document_;
    const std::string& name_;
    ReadMeshReport& report_;
    std::size_t budget_;  // vertices, corners and primitives that may still be added
    GltfMaterials materials_;
    MeshBuilder builder_;
    geometry::MeshAttributes attributes_;
    std::vector<Vec3> rest_;
    std::size_t skipped_primitives_ = 0;
    std::size_t skinned_nodes_ = 0;
    std::size_t morphed_ = 0;
    std::size_t unreached_ = 0;
};

}  // namespace

Model read_gltf(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
                ReadMeshReport& report) {
    return GltfReader(bytes, name, folder, report).read();
}

}  // namespace splitcubes::io
