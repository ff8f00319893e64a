// JSON values for messages.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace splitcubes::scene {

/// Returns the text of a value with numbers in plain notation (plain_number); long text is truncated.
std::string plain_json(const nlohmann::ordered_json& json);

}  // namespace splitcubes::scene
