// A picture in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::render {

/// 8 bits per channel, sRGB, rows from the top, no padding.
struct Picture {
    int width = 0;                  // pixels
    int height = 0;                 // pixels
    std::vector<std::uint8_t> rgb;  // 3 * width * height

    const std::uint8_t* pixel(int column, int row) const {
        return rgb.data() + 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(column));
    }
};

}  // namespace splitcubes::render
