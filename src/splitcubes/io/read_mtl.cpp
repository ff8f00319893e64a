// Material libraries of OBJ files: of each material its base colour and texture.
#include <splitcubes/core/error.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/text_cursor.h>
#include <splitcubes/io/text_encoding.h>

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

namespace splitcubes::io {

namespace {

using geometry::Material;

/// Returns the number of words after an option of a texture statement; -1 for a word that is no option.
int option_words(std::string_view word) {
    constexpr std::array<std::pair<std::string_view, int>, 9> options = {{{"-blendu", 1},
                                                                          {"-blendv", 1},
                                                                          {"-boost", 1},
                                                                          {"-cc", 1},
                                                                          {"-clamp", 1},
                                                                          {"-bm", 1},
                                                                          {"-imfchan", 1},
                                                                          {"-texres", 1},
                                                                          {"-mm", 2}}};
    for (const auto& [name, count] : options)
        if (name == word) return count;
    return word == "-o" || word == "-s" || word == "-t" ? 3 : -1;
}

bool is_number(std::string_view word) {
    return !word.empty() && word.find_first_not_of("+-.0123456789eE") == word.npos;
}

std::string_view first_word(std::string_view text) {
    return text.substr(0, text.find_first_of(" \t"));
}

void drop_word(std::string_view& text) {
    text.remove_prefix(first_word(text).size());
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
}

/// The file's name behind the options, blanks in it included. -o, -s and -t take one to three numbers.
std::string_view texture_name(std::string_view rest) {
    for (int count = option_words(first_word(rest)); count >= 0; count = option_words(first_word(rest))) {
        const bool numbers = count == 3;
        drop_word(rest);
        for (int i = 0; i < count && (!numbers || is_number(first_word(rest))); ++i) drop_word(rest);
    }
    return rest;
}

class MtlReader {
  public:
    MtlReader(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
              const std::filesystem::path& mesh_folder, std::vector<Material>& materials,
              ReadMeshReport& report)
        : cursor_(as_text(without_byte_order_mark(bytes)), name),
          folder_(folder),
          mesh_folder_(mesh_folder),
          materials_(materials),
          report_(report) {
        for (std::size_t k = 0; k < materials.size(); ++k) number_.emplace(materials[k].name, k);
    }

    void read() {
        do {
            try {
                read_statement(cursor_.word_on_line());
            } catch (const InputError& error) {
                if (bad_count_++ == 0) first_bad_ = error.what();
            }
        } while (cursor_.next_line());
        if (bad_count_ > 0)
            report_.notes.push_back(std::to_string(bad_count_) +
                                    " statements of the material library were passed over, the first is " +
                                    first_bad_);
    }

  private:
    void read_statement(std::string_view keyword) {
        if (keyword == "newmtl") {
            begin(std::string(cursor_.rest_of_line()));
        } else if (!has_current_) {
            return;
        } else if (keyword == "Kd") {
            read_colour();
        } else if (keyword == "d") {
            current().colour[3] = channel(cursor_.number(cursor_.word_on_line(), "d"));
        } else if (keyword == "Tr") {
            current().colour[3] = 1 - channel(cursor_.number(cursor_.word_on_line(), "Tr"));
        } else if (keyword == "map_Kd") {
            current().texture = resolved_texture(std::string(texture_name(cursor_.rest_of_line())), folder_,
                                                 mesh_folder_, report_);
        }
    }

    void begin(const std::string& name) {
        const auto [found, is_new] = number_.emplace(name, materials_.size());
        if (is_new) materials_.push_back({.name = name, .texture = {}, .image = {}});
        current_ = found->second;
        has_current_ = true;
    }

    void read_colour() {
        // A spectral curve or CIE XYZ may stand here instead; nobody writes them.
        geometry::Rgba& colour = current().colour;
        std::array<float, 3> read;
        for (float& value : read) value = channel(cursor_.number(cursor_.word_on_line(), "Kd"));
        std::copy(read.begin(), read.end(), colour.begin());
    }

    Material& current() { return materials_[current_]; }

    TextCursor cursor_;
    const std::filesystem::path &folder_, &mesh_folder_;
    std::vector<Material>& materials_;
    ReadMeshReport& report_;
    std::unordered_map<std::string, std::size_t> number_;
    std::size_t current_ = 0;
    bool has_current_ = false;
    std::size_t bad_count_ = 0;
    std::string first_bad_;
};

}  // namespace

void read_mtl(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
              const std::filesystem::path& mesh_folder, std::vector<Material>& materials,
              ReadMeshReport& report) {
    MtlReader(bytes, name, folder, mesh_folder, materials, report).read();
}

}  // namespace splitcubes::io
