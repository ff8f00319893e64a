#include <splitcubes/core/error.h>
#include <splitcubes/gl/objects.h>

#include <sstream>

namespace splitcubes::gl {

namespace {

template <class Generate>
GLuint make(Generate generate) {
    GLuint id = 0;
    generate(1, &id);
    return id;
}

struct PixelLayout {
    GLenum format;
    GLenum type;
};

/// Returns a pixel layout that glTexImage2D accepts together with the internal format without data: depth and
/// integer formats require their own kind.
PixelLayout matching_layout(GLenum internal_format) {
    switch (internal_format) {
        case GL_DEPTH_COMPONENT16:
        case GL_DEPTH_COMPONENT24:
        case GL_DEPTH_COMPONENT32:
        case GL_DEPTH_COMPONENT32F:
            return {GL_DEPTH_COMPONENT, GL_FLOAT};
        case GL_DEPTH24_STENCIL8:
            return {GL_DEPTH_STENCIL, GL_UNSIGNED_INT_24_8};
        case GL_R8UI:
        case GL_R16UI:
        case GL_R32UI:
            return {GL_RED_INTEGER, GL_UNSIGNED_INT};
        case GL_RG32UI:
            return {GL_RG_INTEGER, GL_UNSIGNED_INT};
        case GL_RGBA32UI:
            return {GL_RGBA_INTEGER, GL_UNSIGNED_INT};
        case GL_R8I:
        case GL_R16I:
        case GL_R32I:
            return {GL_RED_INTEGER, GL_INT};
        default:
            return {GL_RGBA, GL_FLOAT};
    }
}

}  // namespace

void remove_buffer(GLuint id) {
    glDeleteBuffers(1, &id);
}
void remove_vertex_array(GLuint id) {
    glDeleteVertexArrays(1, &id);
}
void remove_texture(GLuint id) {
    glDeleteTextures(1, &id);
}
void remove_renderbuffer(GLuint id) {
    glDeleteRenderbuffers(1, &id);
}
void remove_framebuffer(GLuint id) {
    glDeleteFramebuffers(1, &id);
}

Buffer::Buffer() : Name(make(glGenBuffers)) {}

void Buffer::upload(GLenum target, const void* data, std::size_t byte_count, GLenum usage) {
    glBindBuffer(target, id());
    glBufferData(target, static_cast<GLsizeiptr>(byte_count), data, usage);
}

VertexArray::VertexArray() : Name(make(glGenVertexArrays)) {}

Texture::Texture(GLenum internal_format, int width, int height, GLenum filter)
    : Name(make(glGenTextures)), width_(width), height_(height) {
    glBindTexture(GL_TEXTURE_2D, id());
    const PixelLayout layout = matching_layout(internal_format);
    glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(internal_format), width, height, 0, layout.format,
                 layout.type, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
}

void Texture::bind(int unit) const {
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    glBindTexture(GL_TEXTURE_2D, id());
}

Renderbuffer::Renderbuffer(GLenum internal_format, int width, int height, int samples)
    : Name(make(glGenRenderbuffers)) {
    glBindRenderbuffer(GL_RENDERBUFFER, id());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, internal_format, width,
                                     height);
}

Framebuffer::Framebuffer() : Name(make(glGenFramebuffers)) {}

void Framebuffer::attach(GLenum attachment, const Texture& texture) {
    bind();
    glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture.id(), 0);
}

void Framebuffer::attach(GLenum attachment, const Renderbuffer& buffer) {
    bind();
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer.id());
}

void Framebuffer::check(const std::string& name) const {
    bind();
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    if (status == GL_FRAMEBUFFER_COMPLETE) return;
    std::ostringstream text;
    text << "OpenGL: the framebuffer for " << name << " is not complete (0x" << std::hex << status << ")";
    throw JobError(text.str());
}

void check_errors(const std::string& where) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) return;
    std::ostringstream text;
    text << "OpenGL: error 0x" << std::hex << error << " in " << where;
    throw JobError(text.str());
}

}  // namespace splitcubes::gl
