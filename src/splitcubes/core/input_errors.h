// Several things wrong with one input.
#pragma once

#include <splitcubes/core/error.h>

#include <memory>
#include <span>
#include <string>

namespace splitcubes {

/// All that is wrong with one input: what() has a line for each error, each written
/// like that of an InputError.
class InputErrors : public InputError {
  public:
    /// At least one.
    explicit InputErrors(std::span<const InputError> errors);
    const char* what() const noexcept override { return lines_->c_str(); }

  private:
    std::shared_ptr<const std::string> lines_;  // shared: exceptions are copied without throwing
};

}  // namespace splitcubes
