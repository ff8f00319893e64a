#include <splitcubes/core/input_errors.h>

#include <cassert>

namespace splitcubes {

namespace {
std::string lines_of(std::span<const InputError> errors) {
    std::string lines;
    for (const InputError& error : errors) lines += (lines.empty() ? "" : "\n") + std::string(error.what());
    return lines;
}
}  // namespace

InputErrors::InputErrors(std::span<const InputError> errors)
    : InputError(errors.front()), lines_(std::make_shared<const std::string>(lines_of(errors))) {
    assert(!errors.empty());
}

}  // namespace splitcubes
