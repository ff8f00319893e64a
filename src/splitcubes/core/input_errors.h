// Several errors of one input.
#pragma once

#include <splitcubes/core/error.h>

#include <memory>
#include <span>
#include <string>

namespace splitcubes {

/// All errors of one input: what() has one line for each, in the form of InputError.
class InputErrors : public InputError {
  public:
    /// errors: at least one.
    explicit InputErrors(std::span<const InputError> errors);
    const char* what() const noexcept override { return lines_->c_str(); }

  private:
    std::shared_ptr<const std::string> lines_;  // shared, so that copying the exception does not throw
};

}  // namespace splitcubes
