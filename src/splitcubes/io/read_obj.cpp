#include <splitcubes/io/mesh_builder.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/text_cursor.h>

#include <algorithm>
#include <array>
#include <charconv>

namespace splitcubes::io {

namespace {

// Statements of the Wavefront OBJ format that carry nothing a triangle mesh needs.
constexpr std::array<std::string_view, 19> passed_over = {
    "vn", "vt",    "vp",       "g",        "o",   "s",      "usemtl", "mtllib",     "mg",       "l",
    "p",  "bevel", "c_interp", "d_interp", "lod", "maplib", "usemap", "shadow_obj", "trace_obj"};

class ObjReader {
  public:
    ObjReader(Bytes bytes, const std::string& name, ReadMeshReport& report)
        : cursor_(as_text(bytes), name), name_(name), report_(report) {}

    geometry::TriangleMesh read() {
        do {
            const std::string_view keyword = cursor_.word_on_line();
            if (keyword.empty() || keyword.front() == '#') continue;
            if (keyword == "v")
                read_vertex();
            else if (keyword == "f" || keyword == "fo")
                read_face();
            else if (std::find(passed_over.begin(), passed_over.end(), keyword) == passed_over.end())
                note_unknown(keyword);
        } while (cursor_.next_line());
        if (highest_index_ > builder_.mesh.positions.size()) fail_index(highest_index_line_, highest_index_);
        if (unknown_count_ > 0)
            report_.notes.push_back(std::to_string(unknown_count_) +
                                    " unknown statements were passed over, " + first_unknown_);
        return builder_.finish(name_, report_);
    }

  private:
    void read_vertex() {
        const double x = cursor_.number(cursor_.word_on_line(), "x");
        const double y = cursor_.number(cursor_.word_on_line(), "y");
        const double z = cursor_.number(cursor_.word_on_line(), "z");
        // A weight or a colour may follow.
        for (std::string_view word = cursor_.word_on_line(); !word.empty() && word.front() != '#';
             word = cursor_.word_on_line())
            cursor_.number(word, "what follows a vertex");
        if (builder_.mesh.positions.size() == max_vertex_count)
            cursor_.fail("more vertices than " + std::to_string(max_vertex_count), "split the mesh");
        builder_.mesh.positions.emplace_back(x, y, z);
    }

    void read_face() {
        corners_.clear();
        for (std::string_view word = cursor_.word_on_line(); !word.empty() && word.front() != '#';
             word = cursor_.word_on_line())
            corners_.push_back(read_corner(word));
        if (corners_.size() < 3)
            cursor_.fail("a face has " + std::to_string(corners_.size()) + " corners",
                         "it needs three or more");
        builder_.add_polygon(corners_);
    }

    /// One of v, v/t, v//n, v/t/n; the vertex counted from 1, or back from the latest as -1.
    std::uint32_t read_corner(std::string_view word) {
        const char* const end = word.data() + word.size();
        std::int64_t index = 0;
        const auto [stop, error] = std::from_chars(word.data(), end, index);
        if (error != std::errc() || (stop != end && *stop != '/')) fail_corner(word);
        if (stop != end) check_corner_rest(word, {stop, static_cast<std::size_t>(end - stop)});
        const auto count = static_cast<std::int64_t>(builder_.mesh.positions.size());
        if (index == 0 || index < -count || index > static_cast<std::int64_t>(max_vertex_count))
            fail_index(cursor_.line(), index);
        const auto number = static_cast<std::uint64_t>(index > 0 ? index : count + index + 1);
        // A file may list its vertices after its faces, so this waits for the end.
        if (number > highest_index_) {
            highest_index_ = number;
            highest_index_line_ = cursor_.line();
        }
        return static_cast<std::uint32_t>(number - 1);
    }

    /// rest: from the first slash on. The texture and normal numbers are not used, but must be numbers.
    void check_corner_rest(std::string_view word, std::string_view rest) const {
        rest.remove_prefix(1);
        const std::size_t slash = rest.find('/');
        const std::string_view texture = rest.substr(0, slash);
        const bool has_normal = slash != rest.npos;
        if (!is_integer(texture) && !(texture.empty() && has_normal)) fail_corner(word);
        if (has_normal && !is_integer(rest.substr(slash + 1))) fail_corner(word);
    }

    static bool is_integer(std::string_view word) {
        std::int64_t value = 0;
        const char* const end = word.data() + word.size();
        const auto [stop, error] = std::from_chars(word.data(), end, value);
        return error == std::errc() && stop == end && value != 0;
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
    ReadMeshReport& report_;
    MeshBuilder builder_;
    std::vector<std::uint32_t> corners_;  // of the face being read
    std::uint64_t highest_index_ = 0;     // counted from 1
    std::size_t highest_index_line_ = 0;
    std::size_t unknown_count_ = 0;
    std::string first_unknown_;
};

}  // namespace

geometry::TriangleMesh read_obj(Bytes bytes, const std::string& name, ReadMeshReport& report) {
    return ObjReader(bytes, name, report).read();
}

}  // namespace splitcubes::io
