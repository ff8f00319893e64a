// Walks through the words of a text file, line by line. Internal to the module.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace splitcubes::io {

/// Words are separated by blanks. Lines end with LF, CR LF or CR; a backslash
/// before a line's end continues the line. Every message carries name:line.
class TextCursor {
  public:
    TextCursor(std::string_view text, std::string name, std::size_t first_line = 1)
        : text_(text), name_(std::move(name)), line_(first_line) {}

    /// The next word of this line; empty at its end.
    std::string_view word_on_line() {
        skip_blanks();
        const std::size_t begin = at_;
        while (at_ < text_.size() && !is_blank(text_[at_]) && !is_line_end(text_[at_]) && !at_continuation())
            ++at_;
        return text_.substr(begin, at_ - begin);
    }
    /// Returns the rest of this line, without the blanks around it.
    std::string_view rest_of_line() {
        skip_blanks();
        const std::size_t begin = at_;
        std::size_t end = at_;
        for (; at_ < text_.size() && !is_line_end(text_[at_]); ++at_)
            if (!is_blank(text_[at_])) end = at_ + 1;
        return text_.substr(begin, end - begin);
    }
    /// The next word of the file; empty at its end.
    std::string_view word() {
        for (;;) {
            const std::string_view found = word_on_line();
            if (!found.empty() || !next_line()) return found;
        }
    }
    /// Goes to the start of the next line; false at the file's end.
    bool next_line();

    std::size_t line() const { return line_; }
    std::size_t bytes_left() const { return text_.size() - at_; }

    /// A finite number; a sign, digits, a decimal point, whatever the locale.
    double number(std::string_view word, const char* what) const;
    std::int64_t integer(std::string_view word, const char* what) const;

    /// Throws InputError at this line, or at another one.
    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        fail_at(line_, problem, remedy);
    }
    [[noreturn]] void fail_at(std::size_t line, const std::string& problem, const std::string& remedy) const;

  private:
    static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
    static bool is_line_end(char c) { return c == '\n' || c == '\r'; }
    bool at_continuation() const {
        return text_[at_] == '\\' && at_ + 1 < text_.size() && is_line_end(text_[at_ + 1]);
    }
    void skip_blanks() {
        while (at_ < text_.size()) {
            if (is_blank(text_[at_]))
                ++at_;
            else if (at_continuation()) {
                ++at_;
                pass_line_end();
            } else
                return;
        }
    }
    void pass_line_end() {
        const bool pair = text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n';
        at_ += pair ? 2 : 1;
        ++line_;
    }

    std::string_view text_;
    std::string name_;
    std::size_t at_ = 0;    // byte of the text
    std::size_t line_ = 1;  // counted from 1
};

/// 'word' for a message, control characters replaced, cut to a bearable length.
std::string in_quotes(std::string_view word);

}  // namespace splitcubes::io
