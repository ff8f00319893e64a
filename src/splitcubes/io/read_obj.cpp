#include <splitcubes/core/error.h>
#include <splitcubes/io/mesh_builder.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/text_cursor.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <unordered_map>

namespace splitcubes::io {

namespace {

// Statements of the Wavefront OBJ format that carry nothing that is read here.
constexpr std::array<std::string_view, 16> passed_over = {
    "vn",    "vp",       "g",        "o",   "s",      "mg",     "l",          "p",
    "bevel", "c_interp", "d_interp", "lod", "maplib", "usemap", "shadow_obj", "trace_obj"};

class ObjReader {
  public:
    ObjReader(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
              ReadMeshReport& report)
        : cursor_(as_text(bytes), name), name_(name), folder_(folder), report_(report) {}

    Model read() {
        do {
            const std::string_view keyword = cursor_.word_on_line();
            if (keyword.empty() || keyword.front() == '#') continue;
            if (keyword == "v")
                read_vertex();
            else if (keyword == "f" || keyword == "fo")
                read_face();
            else if (keyword == "vt")
                read_texture_point();
            else if (keyword == "usemtl")
                use_material(std::string(cursor_.rest_of_line()));
            else if (keyword == "mtllib")
                read_library(cursor_.rest_of_line());
            else if (std::find(passed_over.begin(), passed_over.end(), keyword) == passed_over.end())
                note_unknown(keyword);
        } while (cursor_.next_line());
        check_highest();
        if (unknown_count_ > 0)
            report_.notes.push_back(std::to_string(unknown_count_) +
                                    " unknown statements were passed over, " + first_unknown_);
        Model model;
        model.mesh = builder_.finish(name_, report_);
        finish_attributes(model);
        return model;
    }

  private:
    struct Corner {
        std::uint32_t vertex;   // counted from 0
        std::uint32_t texture;  // counted from 1; 0: none
    };

    void read_vertex() {
        const double x = cursor_.number(cursor_.word_on_line(), "x");
        const double y = cursor_.number(cursor_.word_on_line(), "y");
        const double z = cursor_.number(cursor_.word_on_line(), "z");
        // A weight or a colour may follow: one number or three.
        std::array<float, 3> colour{};
        std::size_t count = 0;
        for (std::string_view word = cursor_.word_on_line(); !word.empty() && word.front() != '#';
             word = cursor_.word_on_line()) {
            const double value = cursor_.number(word, "what follows a vertex");
            if (count < 3) colour[count] = channel(value);
            ++count;
        }
        if (builder_.mesh.positions.size() == max_vertex_count)
            cursor_.fail("more vertices than " + std::to_string(max_vertex_count), "split the mesh");
        builder_.mesh.positions.emplace_back(x, y, z);
        if (count == 3) {
            colours_.resize(builder_.mesh.positions.size() - 1, {1, 1, 1});
            colours_.push_back(colour);
        }
    }

    void read_texture_point() {
        std::array<double, 3> values{};
        std::size_t count = 0;
        for (std::string_view word = cursor_.word_on_line(); !word.empty() && word.front() != '#';
             word = cursor_.word_on_line()) {
            const double value = cursor_.number(word, "a texture coordinate");
            if (count < 3) values[count] = value;
            ++count;
        }
        const auto u = finite_float(values[0]), v = finite_float(values[1]);
        if (count == 0 || !u || !v)
            cursor_.fail("a texture coordinate is missing or too large", "write it like vt 0.5 0.25");
        if (texture_points_.size() == max_vertex_count)
            cursor_.fail("more texture coordinates than " + std::to_string(max_vertex_count),
                         "split the mesh");
        texture_points_.push_back({*u, *v});
        has_depth_.push_back(count > 2);
    }

    void use_material(const std::string& name) {
        const auto [found, is_new] = material_number_.emplace(name, materials_.size());
        if (is_new) materials_.push_back({.name = name, .texture = {}, .image = {}});
        material_ = static_cast<std::int32_t>(found->second);
    }

    /// A library's name may hold blanks, or the line may name several libraries.
    void read_library(std::string_view line) {
        const std::string whole(line);
        if (folder_.empty() || !is_beside_or_below(whole) || std::filesystem::exists(folder_ / whole)) {
            open_library(whole);
            return;
        }
        for (std::size_t begin = 0; begin < line.size();) {
            const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
            open_library(std::string(line.substr(begin, end - begin)));
            begin = std::min(line.find_first_not_of(" \t", end), line.size());
        }
    }

    void open_library(std::string name) {
        std::replace(name.begin(), name.end(), '\\', '/');
        const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
        if (!libraries_.insert(path).second) return;
        const std::string quoted = "the material library " + in_quotes(name);
        if (folder_.empty() || !is_beside_or_below(name)) {
            report_.notes.push_back(
                quoted + " was not read: " +
                (folder_.empty() ? "there is no folder to look in" : "it lies outside of the file's folder"));
            return;
        }
        try {
            const std::vector<std::byte> bytes = read_file_bytes(folder_ / path);
            report_.files.push_back(folder_ / path);
            read_mtl(bytes, (folder_ / path).string(), folder_ / path.parent_path(), folder_, materials_,
                     report_);
        } catch (const InputError& error) {
            report_.notes.push_back(quoted + " was not read: " + error.what());
        }
        for (std::size_t k = 0; k < materials_.size(); ++k) material_number_.emplace(materials_[k].name, k);
    }

    void read_face() {
        vertices_.clear();
        textures_.clear();
        for (std::string_view word = cursor_.word_on_line(); !word.empty() && word.front() != '#';
             word = cursor_.word_on_line()) {
            const Corner corner = read_corner(word);
            vertices_.push_back(corner.vertex);
            textures_.push_back(corner.texture);
        }
        if (vertices_.size() < 3)
            cursor_.fail("a face has " + std::to_string(vertices_.size()) + " corners",
                         "it needs three or more");
        const std::size_t before = builder_.mesh.triangles.size();
        builder_.add_polygon(vertices_);
        const bool textured = std::any_of(textures_.begin(), textures_.end(), [](auto t) { return t > 0; });
        if (textured || !corner_textures_.empty()) {
            corner_textures_.resize(before);
            for (const auto& [a, b, c] : builder_.added())
                corner_textures_.push_back({textures_[a], textures_[b], textures_[c]});
        }
        if (material_ >= 0 || !triangle_material_.empty()) {
            triangle_material_.resize(before, -1);
            triangle_material_.resize(builder_.mesh.triangles.size(), material_);
        }
    }

    /// One of v, v/t, v//n, v/t/n; numbers counted from 1, or back from the latest as -1.
    Corner read_corner(std::string_view word) {
        const char* const end = word.data() + word.size();
        std::int64_t index = 0;
        const auto [stop, error] = std::from_chars(word.data(), end, index);
        if (error != std::errc() || (stop != end && *stop != '/')) fail_corner(word);
        const std::int64_t texture =
            stop == end ? 0 : texture_index(word, {stop, static_cast<std::size_t>(end - stop)});
        const auto count = static_cast<std::int64_t>(builder_.mesh.positions.size());
        if (index == 0 || index < -count || index > static_cast<std::int64_t>(max_vertex_count))
            fail_index(cursor_.line(), index);
        const auto number = static_cast<std::uint64_t>(index > 0 ? index : count + index + 1);
        // A file may list its vertices after its faces, so this waits for the end.
        if (number > highest_index_) {
            highest_index_ = number;
            highest_index_line_ = cursor_.line();
        }
        return {static_cast<std::uint32_t>(number - 1), texture_number(texture)};
    }

    /// Of a corner, 0 for none. rest: from the first slash on. The normal's number is
    /// not used, but must be one.
    std::int64_t texture_index(std::string_view word, std::string_view rest) const {
        rest.remove_prefix(1);
        const std::size_t slash = rest.find('/');
        const std::string_view texture = rest.substr(0, slash);
        const bool has_normal = slash != rest.npos;
        if (!is_integer(texture) && !(texture.empty() && has_normal)) fail_corner(word);
        if (has_normal && !is_integer(rest.substr(slash + 1))) fail_corner(word);
        std::int64_t value = 0;
        std::from_chars(texture.data(), texture.data() + texture.size(), value);
        return value;
    }

    /// Counted from 1. Whether there is such a coordinate is checked at the end: they
    /// may follow, and files exist that have lost all of theirs but still number them.
    std::uint32_t texture_number(std::int64_t index) {
        const auto count = static_cast<std::int64_t>(texture_points_.size());
        const std::int64_t number = index >= 0 ? index : count + index + 1;
        const bool out_of_reach = number < (index < 0 ? 1 : 0) || number > std::int64_t{max_vertex_count};
        if (out_of_reach ? lost_texture_line_ == 0 : number > highest_texture_) {
            (out_of_reach ? lost_texture_line_ : highest_texture_line_) = cursor_.line();
            (out_of_reach ? lost_texture_ : highest_texture_) = out_of_reach ? index : number;
        }
        return out_of_reach ? 0 : static_cast<std::uint32_t>(number);
    }

    static bool is_integer(std::string_view word) {
        std::int64_t value = 0;
        const char* const end = word.data() + word.size();
        const auto [stop, error] = std::from_chars(word.data(), end, value);
        return error == std::errc() && stop == end && value != 0;
    }

    void check_highest() const {
        if (highest_index_ > builder_.mesh.positions.size()) fail_index(highest_index_line_, highest_index_);
        if (texture_points_.empty()) return;
        if (lost_texture_line_ > 0) fail_texture(lost_texture_line_, lost_texture_);
        if (highest_texture_ > static_cast<std::int64_t>(texture_points_.size()))
            fail_texture(highest_texture_line_, highest_texture_);
    }

    void finish_attributes(Model& model) const {
        geometry::MeshAttributes& out = model.attributes;
        const std::size_t count = model.mesh.triangles.size();
        if (!triangle_material_.empty()) out.materials = materials_;
        out.triangle_material = triangle_material_;
        if (!colours_.empty()) {
            const auto colour_of = [&](std::uint32_t v) {
                return v < colours_.size() ? geometry::Rgba{colours_[v][0], colours_[v][1], colours_[v][2], 1}
                                           : geometry::Rgba{1, 1, 1, 1};
            };
            out.corner_colour.reserve(count);
            for (const geometry::Triangle& t : model.mesh.triangles)
                out.corner_colour.push_back({colour_of(t[0]), colour_of(t[1]), colour_of(t[2])});
        }
        if (texture_points_.empty() || corner_textures_.empty()) return;
        out.corner_uv.resize(count);
        for (std::size_t t = 0; t < corner_textures_.size(); ++t)
            if (!is_solid_texture(t))
                for (std::size_t k = 0; k < 3; ++k)
                    if (const std::uint32_t number = corner_textures_[t][k])
                        out.corner_uv[t][k] = texture_points_[number - 1];
    }

    /// Three components on a face of material `cut` are a position in a solid texture,
    /// as written by this program, and no texture coordinates of a picture.
    bool is_solid_texture(std::size_t t) const {
        const std::int32_t material = t < triangle_material_.size() ? triangle_material_[t] : -1;
        if (material < 0 || materials_[static_cast<std::size_t>(material)].name != "cut") return false;
        const auto& numbers = corner_textures_[t];
        return std::all_of(numbers.begin(), numbers.end(),
                           [&](std::uint32_t n) { return n > 0 && has_depth_[n - 1]; });
    }

    [[noreturn]] void fail_corner(std::string_view word) const {
        cursor_.fail("face corner " + in_quotes(word) + " is none of v, v/t, v//n, v/t/n",
                     "indices are whole numbers, not zero");
    }

    template <class Index>
    [[noreturn]] void fail_index(std::size_t line, Index index) const {
        cursor_.fail_at(line,
                        "face corner " + std::to_string(index) + " is out of range: there are " +
                            std::to_string(builder_.mesh.positions.size()) + " vertices",
                        "indices count from 1, or from -1 backwards");
    }

    [[noreturn]] void fail_texture(std::size_t line, std::int64_t index) const {
        cursor_.fail_at(line,
                        "texture coordinate " + std::to_string(index) + " is out of range: there are " +
                            std::to_string(texture_points_.size()),
                        "indices count from 1, or from -1 backwards");
    }

    void note_unknown(std::string_view keyword) {
        const bool text =
            std::all_of(keyword.begin(), keyword.end(), [](char c) { return c > ' ' && c <= '~'; });
        if (!text)
            cursor_.fail(in_quotes(keyword) + " is no OBJ statement", "the file is not text or is damaged");
        if (unknown_count_++ == 0)
            first_unknown_ =
                "the first is " + in_quotes(keyword) + " in line " + std::to_string(cursor_.line());
    }

    TextCursor cursor_;
    const std::string& name_;
    const std::filesystem::path& folder_;
    ReadMeshReport& report_;
    MeshBuilder builder_;
    std::vector<std::uint32_t> vertices_, textures_;  // of the face being read
    std::uint64_t highest_index_ = 0;                 // counted from 1
    std::size_t highest_index_line_ = 0;
    std::int64_t highest_texture_ = 0;  // counted from 1
    std::size_t highest_texture_line_ = 0;
    std::int64_t lost_texture_ = 0;  // the first that no count of coordinates could make valid
    std::size_t lost_texture_line_ = 0;
    std::size_t unknown_count_ = 0;
    std::string first_unknown_;

    // Arrays that may be shorter than what they describe: the rest has none.
    std::vector<std::array<float, 3>> colours_;  // per vertex, sRGB
    std::vector<geometry::Uv> texture_points_;
    std::vector<bool> has_depth_;  // per texture point: it has a third component
    std::vector<std::array<std::uint32_t, 3>> corner_textures_;  // per triangle, counted from 1; 0: none
    std::vector<std::int32_t> triangle_material_;
    std::int32_t material_ = -1;  // of the faces to come
    std::vector<geometry::Material> materials_;
    std::unordered_map<std::string, std::size_t> material_number_;
    std::set<std::filesystem::path> libraries_;  // already looked for
};

}  // namespace

Model read_obj(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
               ReadMeshReport& report) {
    return ObjReader(bytes, name, folder, report).read();
}

}  // namespace splitcubes::io
