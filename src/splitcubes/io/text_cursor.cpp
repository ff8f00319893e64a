#include <splitcubes/core/error.h>
#include <splitcubes/io/text_cursor.h>

#include <charconv>
#include <cmath>
#include <system_error>

namespace splitcubes::io {

namespace {

/// std::from_chars knows no leading plus.
std::string_view without_plus(std::string_view word) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    return word;
}

}  // namespace

std::string in_quotes(std::string_view word) {
    std::string out(1, '\'');
    out += printable(std::string(word.substr(0, 200)));
    out += '\'';
    return out;
}

bool TextCursor::next_line() {
    at_ = std::min(text_.find_first_of("\r\n", at_), text_.size());
    if (at_ == text_.size()) return false;
    pass_line_end();
    return true;
}

double TextCursor::number(std::string_view word, const char* what) const {
    const std::string_view digits = without_plus(word);
    const char* const end = digits.data() + digits.size();
    double value = 0;
    const auto [stop, error] = std::from_chars(digits.data(), end, value);
    if (word.empty()) fail(std::string("a number for ") + what + " is missing", "complete the line");
    if (stop != end || error == std::errc::invalid_argument)
        fail(in_quotes(word) + " is not a number (" + what + ")", "write it like -1.5e-3");
    // Too small for a double is zero; too large is an error.
    const bool underflow = error == std::errc::result_out_of_range &&
                           (digits.find("e-") != digits.npos || digits.find("E-") != digits.npos);
    if (underflow) return 0;
    if (error != std::errc() || !std::isfinite(value))
        fail(in_quotes(word) + " is not a finite number (" + what + ")", "coordinates must be finite");
    return value;
}

std::int64_t TextCursor::integer(std::string_view word, const char* what) const {
    const std::string_view digits = without_plus(word);
    const char* const end = digits.data() + digits.size();
    std::int64_t value = 0;
    const auto [stop, error] = std::from_chars(digits.data(), end, value);
    if (word.empty()) fail(std::string("a number for ") + what + " is missing", "complete the line");
    if (stop != end || error != std::errc())
        fail(in_quotes(word) + " is not a whole number (" + what + ")", "write it with digits only");
    return value;
}

void TextCursor::fail_at(std::size_t line, const std::string& problem, const std::string& remedy) const {
    throw InputError(name_ + ":" + std::to_string(line), problem, remedy);
}

}  // namespace splitcubes::io
