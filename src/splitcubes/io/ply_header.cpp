#include <splitcubes/core/error.h>
#include <splitcubes/io/ply_header.h>
#include <splitcubes/io/text_cursor.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

namespace splitcubes::io {

namespace {

std::optional<PlyType> type_named(std::string_view name) {
    static constexpr std::array<std::pair<std::string_view, PlyType>, 16> names = {{
        {"char", PlyType::int8},
        {"int8", PlyType::int8},
        {"uchar", PlyType::uint8},
        {"uint8", PlyType::uint8},
        {"short", PlyType::int16},
        {"int16", PlyType::int16},
        {"ushort", PlyType::uint16},
        {"uint16", PlyType::uint16},
        {"int", PlyType::int32},
        {"int32", PlyType::int32},
        {"uint", PlyType::uint32},
        {"uint32", PlyType::uint32},
        {"float", PlyType::float32},
        {"float32", PlyType::float32},
        {"double", PlyType::float64},
        {"float64", PlyType::float64},
    }};
    for (const auto& [text, type] : names)
        if (text == name) return type;
    return std::nullopt;
}

class HeaderReader {
  public:
    HeaderReader(Bytes bytes, const std::string& name) : text_(as_text(bytes)), name_(name) {}

    PlyHeader read() {
        // Which line end is used must be known from the first line: behind the
        // header's last one binary data may begin with any byte.
        if (!text_.starts_with("ply") || text_.size() < 4 || (text_[3] != '\n' && text_[3] != '\r'))
            fail("the file does not begin with a line 'ply'", "it is no PLY file");
        line_end_ = text_.substr(3).starts_with("\r\n") ? "\r\n" : text_.substr(3, 1);
        next_line();
        read_format();
        while (next_line()) {
            const std::string_view keyword = word(0);
            if (keyword == "end_header") return finished();
            if (keyword == "element")
                read_element();
            else if (keyword == "property")
                read_property();
            else if (keyword == "comment")
                header_.comments.push_back(comment());
            else if (keyword != "obj_info" && !keyword.empty())
                fail(in_quotes(keyword) + " is no header line",
                     "it should be element, property, comment or end_header");
        }
        fail("the file ends within the header", "the line end_header is missing");
    }

  private:
    PlyHeader finished() {
        header_.body_offset = at_;
        header_.body_line = line_ + 1;
        return std::move(header_);
    }

    bool next_line() {
        const std::size_t end = text_.find(line_end_, at_);
        if (end == text_.npos) return false;
        words_.clear();
        const std::string_view line = text_.substr(at_, end - at_);
        line_text_ = line;
        for (std::size_t begin = line.find_first_not_of(" \t"); begin != line.npos;
             begin = line.find_first_not_of(" \t", begin)) {
            const std::size_t stop = std::min(line.find_first_of(" \t", begin), line.size());
            words_.push_back(line.substr(begin, stop - begin));
            begin = stop;
        }
        at_ = end + line_end_.size();
        ++line_;
        return true;
    }
    std::string_view word(std::size_t i) const { return i < words_.size() ? words_[i] : std::string_view(); }

    /// Returns the text after the line's first word.
    std::string comment() const {
        if (words_.size() < 2) return {};
        return std::string(line_text_.substr(static_cast<std::size_t>(words_[1].data() - line_text_.data())));
    }

    void read_format() {
        while (next_line() && (word(0) == "comment" || word(0) == "obj_info" || word(0).empty())) continue;
        if (word(0) != "format") fail("the line 'format' is missing", "it should follow the line 'ply'");
        if (word(1) == "ascii")
            header_.encoding = PlyEncoding::ascii;
        else if (word(1) == "binary_little_endian")
            header_.encoding = PlyEncoding::little_endian;
        else if (word(1) == "binary_big_endian")
            header_.encoding = PlyEncoding::big_endian;
        else
            fail("unknown format " + in_quotes(word(1)),
                 "ascii, binary_little_endian and binary_big_endian are known");
        if (word(2) != "1.0") fail("unknown version " + in_quotes(word(2)), "version 1.0 is known");
    }

    void read_element() {
        PlyElement element;
        element.name = std::string(word(1));
        element.line = line_;
        const std::string_view digits = word(2);
        const auto [stop, error] =
            std::from_chars(digits.data(), digits.data() + digits.size(), element.count);
        if (words_.size() != 3 || error != std::errc() || stop != digits.data() + digits.size())
            fail("the element's count " + in_quotes(digits) + " is not a whole number",
                 "write 'element NAME COUNT'");
        if (header_.elements.size() == max_names)
            fail("there are more than " + std::to_string(max_names) + " elements", "");
        if (header_.find(element.name))
            fail("element " + in_quotes(element.name) + " stands here twice", "remove one");
        header_.elements.push_back(std::move(element));
    }

    void read_property() {
        if (header_.elements.empty())
            fail("a property stands before the first element", "move it behind one");
        PlyProperty property;
        property.is_list = word(1) == "list";
        const std::size_t at = property.is_list ? 3 : 1;
        if (words_.size() != at + 2)
            fail("a property needs a type and a name",
                 "write 'property TYPE NAME' or 'property list COUNT_TYPE TYPE NAME'");
        property.type = known_type(word(at));
        property.name = std::string(word(at + 1));
        if (property.is_list) {
            property.count_type = known_type(word(2));
            if (property.count_type >= PlyType::float32)
                fail("a list's length has type " + in_quotes(word(2)), "it must be a whole number");
        }
        std::vector<PlyProperty>& properties = header_.elements.back().properties;
        if (properties.size() == max_names)
            fail("an element has more than " + std::to_string(max_names) + " properties", "");
        if (header_.elements.back().find(property.name))
            fail("property " + in_quotes(property.name) + " stands here twice", "remove one");
        properties.push_back(std::move(property));
    }

    PlyType known_type(std::string_view name) const {
        const std::optional<PlyType> type = type_named(name);
        if (!type) fail("unknown type " + in_quotes(name), "char to double and int8 to float64 are known");
        return *type;
    }

    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        throw InputError(name_ + ":" + std::to_string(std::max<std::size_t>(line_, 1)), problem, remedy);
    }

    // Keeps the search for repeated names from growing with the square of a hostile header.
    static constexpr std::size_t max_names = 1000;

    std::string_view text_;
    const std::string& name_;
    PlyHeader header_;
    std::string_view line_end_;
    std::size_t at_ = 0;    // byte behind the current line
    std::size_t line_ = 0;  // the current line, counted from 1
    std::string_view line_text_;
    std::vector<std::string_view> words_;
};

template <class Named>
const Named* find_named(const std::vector<Named>& list, const std::string& name) {
    const auto found = std::find_if(list.begin(), list.end(), [&](const Named& n) { return n.name == name; });
    return found == list.end() ? nullptr : &*found;
}

}  // namespace

std::size_t byte_count(PlyType type) {
    switch (type) {
        case PlyType::int8:
        case PlyType::uint8:
            return 1;
        case PlyType::int16:
        case PlyType::uint16:
            return 2;
        case PlyType::int32:
        case PlyType::uint32:
        case PlyType::float32:
            return 4;
        case PlyType::float64:
            return 8;
    }
    return 8;
}

std::size_t PlyElement::min_bytes(PlyEncoding encoding) const {
    // In text a number is at least one digit and what parts it from the next.
    if (encoding == PlyEncoding::ascii) return 2 * properties.size();
    std::size_t bytes = 0;
    for (const PlyProperty& p : properties) bytes += byte_count(p.is_list ? p.count_type : p.type);
    return bytes;
}

const PlyProperty* PlyElement::find(const std::string& property) const {
    return find_named(properties, property);
}

const PlyElement* PlyHeader::find(const std::string& element) const {
    return find_named(elements, element);
}

PlyHeader read_ply_header(Bytes bytes, const std::string& name) {
    return HeaderReader(bytes, name).read();
}

}  // namespace splitcubes::io
