#include <splitcubes/core/error.h>
#include <splitcubes/io/read_picture.h>

#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>

// None of its names in other files.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wunknown-warning-option"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wsign-compare"
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_NO_STDIO
#define STBI_NO_HDR
#define STBI_NO_GIF
#define STBI_NO_PSD
#define STBI_NO_PIC
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace splitcubes::io {

namespace {

constexpr std::uintmax_t max_bytes = std::uintmax_t{1} << 28;
constexpr std::int64_t max_pixels = std::int64_t{1} << 26;
constexpr const char* picture_remedy = "give a PNG, JPEG, BMP, TGA or PNM file";

std::vector<stbi_uc> bytes_of(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        throw InputError(path.string(), "there is no such file", picture_remedy);
    if (std::filesystem::file_size(path, error) > max_bytes)
        throw InputError(path.string(), "is longer than " + std::to_string(max_bytes) + " bytes",
                         picture_remedy);
    std::ifstream file(path, std::ios::binary);
    std::vector<stbi_uc> bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file) throw InputError(path.string(), "cannot be read", "check its permissions");
    return bytes;
}

// Of a pixel's number from -1 to count.
int wrapped(double pixel, int count) {
    return (static_cast<int>(pixel) + count) % count;
}

}  // namespace

double BrightnessPicture::at(double u, double v) const {
    if (!std::isfinite(u) || !std::isfinite(v)) return at(0, 0);
    const double x = (u - std::floor(u)) * width - 0.5, y = (1 - (v - std::floor(v))) * height - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const auto pixel = [&](double column, double row) {
        return static_cast<double>(
            brightness[static_cast<std::size_t>(wrapped(row, height)) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(wrapped(column, width))]);
    };
    const double s = x - left, t = y - top;
    return (1 - t) * ((1 - s) * pixel(left, top) + s * pixel(left + 1, top)) +
           t * ((1 - s) * pixel(left, top + 1) + s * pixel(left + 1, top + 1));
}

ColourPicture read_colours_from_memory(std::span<const std::byte> bytes, const std::string& name) {
    if (bytes.size() > max_bytes)
        throw InputError(name, "is longer than " + std::to_string(max_bytes) + " bytes", picture_remedy);
    const auto* const data = reinterpret_cast<const stbi_uc*>(bytes.data());
    const auto length = static_cast<int>(bytes.size());
    ColourPicture out;
    int channels = 0;
    if (stbi_info_from_memory(data, length, &out.width, &out.height, &channels) == 0)
        throw InputError(name, "is not a picture that can be read", picture_remedy);
    if (out.width <= 0 || out.height <= 0 || std::int64_t{out.width} * out.height > max_pixels)
        throw InputError(name,
                         "is " + std::to_string(out.width) + " x " + std::to_string(out.height) +
                             " pixels, more than are taken",
                         "scale it down");
    const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
        stbi_load_from_memory(data, length, &out.width, &out.height, &channels, 3), stbi_image_free);
    if (!pixels)
        throw InputError(name, std::string("cannot be read (") + stbi_failure_reason() + ")", picture_remedy);
    out.rgb.assign(pixels.get(), pixels.get() + std::size_t{3} * static_cast<std::size_t>(out.width) *
                                                    static_cast<std::size_t>(out.height));
    return out;
}

ColourPicture read_colours(const std::filesystem::path& path) {
    const std::vector<stbi_uc> bytes = bytes_of(path);
    return read_colours_from_memory(std::as_bytes(std::span(bytes)), path.string());
}

BrightnessPicture read_brightness(const std::filesystem::path& path) {
    const ColourPicture colours = read_colours(path);
    BrightnessPicture out{colours.width, colours.height, {}};
    out.brightness.resize(colours.rgb.size() / 3);
    for (std::size_t k = 0; k < out.brightness.size(); ++k) {
        const std::uint8_t* const p = colours.rgb.data() + 3 * k;
        out.brightness[k] = static_cast<float>(p[0] + p[1] + p[2]) / (3 * 255.0F);
    }
    return out;
}

}  // namespace splitcubes::io
