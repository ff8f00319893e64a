// JSON values for messages.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace splitcubes::scene {

/// The text of a value with its numbers as people write them (plain_number); of a long one the beginning.
std::string plain_json(const nlohmann::ordered_json& json);

}  // namespace splitcubes::scene
