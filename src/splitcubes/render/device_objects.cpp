#include <splitcubes/core/error.h>
#include <splitcubes/render/device_objects.h>

#include <string>

namespace splitcubes::render {

PictureTexture::PictureTexture(const Picture& picture) {
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (picture.width < 1 || picture.height < 1 || picture.width > limit || picture.height > limit)
        throw InputError(
            "picture of " + std::to_string(picture.width) + " x " + std::to_string(picture.height),
            "is not laid on a surface", "give one of 1 to " + std::to_string(limit) + " pixels a side");
    // The first row of a texture is the lowest one.
    const auto row = 3 * static_cast<std::size_t>(picture.width);
    std::vector<std::uint8_t> rows(picture.rgb.size());
    for (std::size_t k = 0; k < static_cast<std::size_t>(picture.height); ++k)
        std::copy_n(picture.rgb.data() + (static_cast<std::size_t>(picture.height) - 1 - k) * row, row,
                    rows.data() + k * row);
    glGenTextures(1, &id);
    glBindTexture(GL_TEXTURE_2D, id);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8, picture.width, picture.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 rows.data());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_REPEAT);
}

}  // namespace splitcubes::render
