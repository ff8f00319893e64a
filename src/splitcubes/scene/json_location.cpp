#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_location.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <map>
#include <system_error>

namespace splitcubes::scene {

namespace {

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/// Scans a JSON text once. With a target path it records the line of the deepest value on that path.
class Scanner {
  public:
    Scanner(std::string_view text, const std::string& name, int max_depth, bool with_location)
        : text_(text), name_(name), max_depth_(max_depth), with_location_(with_location) {}

    void scan(const JsonPath* target) {
        target_ = target;
        if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;
        skip_space();
        found_line_ = line_;
        if (at_end()) fail("there is no JSON value", "write one");
        value(0, target != nullptr);
        skip_space();
        if (!at_end()) fail("text after the end of the JSON value: " + here(), "remove it");
    }
    int found_line() const { return found_line_; }
    void set_max_memory(std::size_t bytes) { max_memory_ = bytes; }
    void collect_unheld(std::vector<UnrepresentableNumber>* unheld) { unheld_ = unheld; }

  private:
    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        throw InputError(
            with_location_ ? name_ + ":" + std::to_string(line_) + ":" + std::to_string(column()) : name_,
            problem, remedy);
    }
    // Counts UTF-8 characters: all bytes except continuation bytes.
    std::size_t column() const {
        const std::string_view before = text_.substr(0, at_);
        const std::size_t end_of_last = before.rfind('\n');
        const std::string_view line = before.substr(end_of_last == before.npos ? 0 : end_of_last + 1);
        const auto is_first = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; };
        return 1 + static_cast<std::size_t>(std::count_if(line.begin(), line.end(), is_first));
    }
    bool at_end() const { return at_ >= text_.size(); }
    char peek() const { return at_end() ? '\0' : text_[at_]; }
    std::string here() const {
        if (at_end()) return "the end of the file";
        std::size_t length = 1;
        while (length < 20 && at_ + length < text_.size() && is_path_word(text_[at_]) &&
               is_path_word(text_[at_ + length]))
            ++length;
        return "'" + printable(std::string(text_.substr(at_, length))) + "'";
    }

    void skip_space() {
        while (!at_end()) {
            const char c = text_[at_];
            if (c == '\n') ++line_;
            if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
                ++at_;
            } else if (c == '/') {
                skip_comment();
            } else {
                return;
            }
        }
    }

    void skip_comment() {
        const std::string_view start = text_.substr(at_, 2);
        if (start == "//") {
            while (!at_end() && text_[at_] != '\n') ++at_;
        } else if (start == "/*") {
            const std::size_t end = text_.find("*/", at_ + 2);
            if (end == std::string_view::npos) fail("a comment that is not closed", "close it with */");
            for (; at_ < end + 2; ++at_) {
                if (text_[at_] == '\n') ++line_;
            }
        } else {
            fail("a single '/'", "comments start with // or /*");
        }
    }

    // on_path: all steps so far match the target.
    void value(int depth, bool on_path) {
        if (depth > max_depth_) {
            fail("nested more than " + std::to_string(max_depth_) + " deep", "a scene needs no such depth");
        }
        const char c = peek();
        take_memory(value_memory + (c == '{' || c == '[' ? array_memory : 0));
        if (c == '{') {
            object(depth, on_path);
        } else if (c == '[') {
            array(depth, on_path);
        } else if (c == '"') {
            string();
        } else if (c == '-' || is_digit(c)) {
            number();
        } else {
            literal();
        }
    }

    void take_memory(std::size_t bytes) {
        memory_ += bytes;
        if (memory_ > max_memory_)
            fail("has more values than fit in " + std::to_string(max_memory_) + " bytes of memory",
                 "give a file with fewer");
    }

    void object(int depth, bool on_path) {
        const int open_line = line_;
        std::map<std::string, int> key_lines;
        ++at_;
        skip_space();
        if (peek() == '}') {
            ++at_;
            return;
        }
        while (true) {
            if (peek() != '"') {
                fail("a key in quotes is missing before " + here(),
                     peek() == '}' ? "remove the comma before it" : "write \"key\": value");
            }
            const int key_line = line_;
            const std::size_t key_at = at_;
            const std::string key = string();
            if (key.size() > max_key_length) {
                at_ = key_at;
                fail("a key has " + std::to_string(key.size()) + " bytes", "no key of a scene is so long");
            }
            const auto [old, fresh] = key_lines.emplace(key, key_line);
            if (!fresh) {
                at_ = key_at;
                fail("key '" + printable(key) + "' stands twice in one object, first on line " +
                         std::to_string(old->second),
                     "remove one of the two");
            }
            if (key_lines.size() > max_object_keys) {
                fail("an object has more than " + std::to_string(max_object_keys) + " keys",
                     "no object of a scene has so many");
            }
            const bool match = step_matches(depth, on_path, {key, -1});
            if (match) found_line_ = key_line;
            skip_space();
            if (peek() != ':')
                fail("a ':' is missing after key '" + printable(key) + "'", "write \"key\": value");
            ++at_;
            skip_space();
            if (unheld_) path_.push_back({key, -1});
            value(depth + 1, match);
            if (unheld_) path_.pop_back();
            if (!next_element('}', open_line)) return;
        }
    }

    void array(int depth, bool on_path) {
        const int open_line = line_;
        ++at_;
        skip_space();
        if (peek() == ']') {
            ++at_;
            return;
        }
        for (int index = 0;; ++index) {
            const bool match = step_matches(depth, on_path, {"", index});
            if (match) found_line_ = line_;
            if (unheld_) path_.push_back({"", index});
            value(depth + 1, match);
            if (unheld_) path_.pop_back();
            if (!next_element(']', open_line)) return;
        }
    }

    bool step_matches(int depth, bool on_path, const PathStep& step) const {
        const auto level = static_cast<std::size_t>(depth);
        return on_path && level < target_->size() && (*target_)[level] == step;
    }

    // Advances past an element: true if a comma leads to another, false at the end.
    bool next_element(char close, int open_line) {
        skip_space();
        if (peek() == close) {
            ++at_;
            return false;
        }
        if (peek() != ',') {
            fail(std::string("',' or '") + close + "' is missing before " + here(),
                 "what it would end was opened on line " + std::to_string(open_line));
        }
        ++at_;
        skip_space();
        if (peek() == ']') fail("a value is missing after ','", "remove the comma before ']'");
        return true;
    }

    void literal() {
        for (const std::string_view word : {"true", "false", "null"}) {
            if (text_.substr(at_, word.size()) == word &&
                (at_ + word.size() >= text_.size() || !is_path_word(text_[at_ + word.size()]))) {
                at_ += word.size();
                return;
            }
        }
        fail("a value is missing, there is " + here(),
             "write a number, \"text\", true, false, null, [ ] or { }");
    }

    void number() {
        const std::size_t start = at_;
        bool good = true;
        const auto digits = [&] {
            good = good && is_digit(peek());
            while (is_digit(peek())) ++at_;
        };
        if (peek() == '-') ++at_;
        const bool leading_zero = peek() == '0';
        const std::size_t whole = at_;
        digits();
        good = good && (!leading_zero || at_ == whole + 1);
        if (peek() == '.') {
            ++at_;
            digits();
        }
        if (peek() == 'e' || peek() == 'E') {
            ++at_;
            if (peek() == '+' || peek() == '-') ++at_;
            digits();
        }
        while (is_path_word(peek()) || peek() == '.') {
            good = false;
            ++at_;
        }
        const std::string_view token = text_.substr(start, at_ - start);
        const std::string shown = printable(std::string(token), 30);
        if (!good) {
            at_ = start;
            fail("'" + shown + "' is not a number", "write numbers like 0.5, -2 or 1e-3");
        }
        double result = 0;
        const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), result);
        if (error != std::errc::result_out_of_range || target_ != nullptr) return;
        if (unheld_ != nullptr) {
            const bool few = unheld_->size() < max_unrepresentable_paths;
            unheld_->push_back({start, token.size(), few ? path_ : JsonPath()});
            return;
        }
        at_ = start;
        fail("number " + shown + " is out of range", "sizes from 1e-307 to 1.7e308 can be held");
    }

    std::string string() {
        std::string out;
        ++at_;
        while (true) {
            if (at_end() || peek() == '\n') fail("a text that is not closed by a quote", "end it with \"");
            const char c = text_[at_];
            if (c == '"') break;
            if (static_cast<unsigned char>(c) < 0x20)
                fail("a control character in a text", "write it as an escape, \\t");
            if (c == '\\') {
                escape(out);
            } else {
                character(out);
            }
        }
        ++at_;
        take_memory(text_memory + out.size());
        return out;
    }

    void escape(std::string& out) {
        static constexpr std::string_view codes = "\"\\/bfnrt";
        static constexpr std::string_view meant = "\"\\/\b\f\n\r\t";
        ++at_;
        const std::size_t which = at_end() ? std::string_view::npos : codes.find(peek());
        if (which != std::string_view::npos) {
            out += meant[which];
            ++at_;
            return;
        }
        if (peek() != 'u') fail("unknown escape '\\' before " + here(), "a backslash itself is written \\\\");
        std::uint32_t code = hex_quad();
        if (code >= 0xD800 && code < 0xE000) {
            const bool low_follows = code < 0xDC00 && text_.substr(at_, 2) == "\\u";
            if (low_follows) ++at_;
            const std::uint32_t low = low_follows ? hex_quad() : 0;
            if (low < 0xDC00 || low >= 0xE000)
                fail("half of a surrogate pair", "write both halves, \\uD83D\\uDE00");
            code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        }
        append_utf8(code, out);
    }

    // Reads \u and four digits; starts at the u, stops after the digits.
    std::uint32_t hex_quad() {
        ++at_;
        const std::string_view token = text_.substr(std::min(at_, text_.size()), 4);
        std::uint32_t code = 0;
        const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), code, 16);
        if (token.size() != 4 || error != std::errc{} || end != token.data() + 4) {
            fail("\\u is not followed by four hexadecimal digits", "write it like \\u00e9");
        }
        at_ += 4;
        return code;
    }

    static void append_utf8(std::uint32_t code, std::string& out) {
        const auto tail = [&](int shift) { out += static_cast<char>(0x80 | ((code >> shift) & 0x3F)); };
        if (code < 0x80) {
            out += static_cast<char>(code);
        } else if (code < 0x800) {
            out += static_cast<char>(0xC0 | (code >> 6));
            tail(0);
        } else if (code < 0x10000) {
            out += static_cast<char>(0xE0 | (code >> 12));
            tail(6);
            tail(0);
        } else {
            out += static_cast<char>(0xF0 | (code >> 18));
            tail(12);
            tail(6);
            tail(0);
        }
    }

    // Reads one UTF-8 character (RFC 3629, section 4: no overlong forms, no surrogates).
    void character(std::string& out) {
        const auto byte = [&](std::size_t offset) {
            return at_ + offset < text_.size() ? static_cast<unsigned char>(text_[at_ + offset]) : 0u;
        };
        const unsigned first = byte(0);
        std::size_t length = 1;
        unsigned low = 0x80;
        unsigned high = 0xBF;
        if (first >= 0xC2 && first <= 0xDF) {
            length = 2;
        } else if (first >= 0xE0 && first <= 0xEF) {
            length = 3;
            if (first == 0xE0) low = 0xA0;
            if (first == 0xED) high = 0x9F;
        } else if (first >= 0xF0 && first <= 0xF4) {
            length = 4;
            if (first == 0xF0) low = 0x90;
            if (first == 0xF4) high = 0x8F;
        } else if (first >= 0x80) {
            length = 0;
        }
        bool good = length > 0 && (length == 1 || (byte(1) >= low && byte(1) <= high));
        for (std::size_t k = 2; k < length; ++k) good = good && byte(k) >= 0x80 && byte(k) <= 0xBF;
        if (!good) fail("a text that is not UTF-8", "save the file as UTF-8");
        out.append(text_.substr(at_, length));
        at_ += length;
    }

    std::string_view text_;
    const std::string& name_;
    int max_depth_;
    bool with_location_;
    std::vector<UnrepresentableNumber>* unheld_ = nullptr;
    JsonPath path_;  // path of the current value, tracked while numbers are collected
    // Bytes of parsed values besides the characters of texts, allocator overhead included.
    static constexpr std::size_t value_memory = 16, array_memory = 48, text_memory = 48;
    std::size_t memory_ = 0, max_memory_ = std::numeric_limits<std::size_t>::max();
    const JsonPath* target_ = nullptr;
    std::size_t at_ = 0;
    int line_ = 1;
    int found_line_ = 1;
};

}  // namespace

void check_json(std::string_view text, const std::string& name, int max_depth, bool with_location,
                std::vector<UnrepresentableNumber>* unheld) {
    Scanner scanner(text, name, max_depth, with_location);
    scanner.collect_unheld(unheld);
    scanner.scan(nullptr);
}

void check_json_within(std::string_view text, const std::string& name, int max_depth,
                       std::size_t max_memory) {
    Scanner scanner(text, name, max_depth, true);
    scanner.set_max_memory(max_memory);
    scanner.scan(nullptr);
}

int line_of(std::string_view text, const JsonPath& path) {
    const std::string name;
    Scanner scanner(text, name, std::numeric_limits<int>::max(), true);
    scanner.scan(&path);
    return scanner.found_line();
}

}  // namespace splitcubes::scene
