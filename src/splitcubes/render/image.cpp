#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <splitcubes/render/image.h>

#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

// Compiles only the PNG parts, with internal linkage.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wunknown-warning-option"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wshadow"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace splitcubes::render {

namespace {

void append(void* context, void* data, int size) {
    auto& bytes = *static_cast<std::vector<char>*>(context);
    const char* begin = static_cast<const char*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
}

}  // namespace

void write_png(const std::filesystem::path& path, const Picture& picture) {
    const std::string name = printable(path.string(), 300);
    if (picture.width <= 0 || picture.height <= 0 ||
        picture.rgb.size() !=
            3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height)) {
        throw InputError(name, "the picture has no pixels or not as many as its size says");
    }
    std::vector<char> bytes;
    if (stbi_write_png_to_func(append, &bytes, picture.width, picture.height, 3, picture.rgb.data(),
                               3 * picture.width) == 0) {
        throw JobError(name + ": the picture could not be encoded");
    }
    write_file(path, {bytes.data(), bytes.size()});
}

Picture read_png(const std::filesystem::path& path) {
    const std::string name = printable(path.string(), 300);
    int width = 0;
    int height = 0;
    int channels = 0;
    const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
        stbi_load(path.c_str(), &width, &height, &channels, 3), stbi_image_free);
    if (!pixels)
        throw InputError(name, std::string("is not a PNG that can be read (") + stbi_failure_reason() + ")");
    Picture picture{.width = width, .height = height, .rgb = {}};
    picture.rgb.assign(pixels.get(),
                       pixels.get() + 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    return picture;
}

}  // namespace splitcubes::render
