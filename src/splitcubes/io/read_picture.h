// Pictures: one value per pixel, for maps that are data, or colours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::io {

/// A picture's brightness: the mean of red, green and blue as the file has them, 0 to 1.
struct BrightnessPicture {
    int width = 0, height = 0;
    std::vector<float> brightness;  // rows from top to bottom

    /// At texture coordinates, (0, 0) being the lower left corner: bilinear between the
    /// pixels' centres, the picture repeated in both directions. Of a picture that is not empty.
    double at(double u, double v) const;
};

/// A picture's colours.
struct ColourPicture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // sRGB, rows from top to bottom
};

/// Read colours with the formats, limits and errors of read_brightness. name: of the file, for messages.
ColourPicture read_colours(const std::filesystem::path& path);
ColourPicture read_colours_from_memory(std::span<const std::byte> bytes, const std::string& name);

/// Reads PNG, JPEG, BMP, TGA or PNM. Throws InputError, whose location is the file, for what is
/// none of these, is damaged, or has more than 2^26 pixels.
BrightnessPicture read_brightness(const std::filesystem::path& path);

}  // namespace splitcubes::io
