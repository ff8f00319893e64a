// Owning wrappers of OpenGL objects. Each belongs to the context that is current when it is made and must be
// destroyed while that context is current.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace splitcubes::gl {

/// Owner of an OpenGL name. `Remove` is called with the name on destruction.
template <void (*Remove)(GLuint)>
class Name {
  public:
    explicit Name(GLuint id) : id_(id) {}
    ~Name() {
        if (id_ != 0) Remove(id_);
    }
    Name(Name&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
    Name& operator=(Name&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    GLuint id() const { return id_; }

  private:
    GLuint id_;
};

void remove_buffer(GLuint id);
void remove_vertex_array(GLuint id);
void remove_texture(GLuint id);
void remove_renderbuffer(GLuint id);
void remove_framebuffer(GLuint id);

class Buffer : public Name<remove_buffer> {
  public:
    Buffer();
    /// Replaces the contents; binds to `target`, GL_ARRAY_BUFFER for vertices.
    void upload(GLenum target, const void* data, std::size_t byte_count, GLenum usage = GL_STREAM_DRAW);
    template <class Value>
    void upload(GLenum target, std::span<const Value> values, GLenum usage = GL_STREAM_DRAW) {
        upload(target, values.data(), values.size_bytes(), usage);
    }
};

class VertexArray : public Name<remove_vertex_array> {
  public:
    VertexArray();
    void bind() const { glBindVertexArray(id()); }
};

/// A 2D texture with one mipmap level, clamped to its edge.
class Texture : public Name<remove_texture> {
  public:
    /// filter: GL_NEAREST or GL_LINEAR. The contents are undefined at first.
    Texture(GLenum internal_format, int width, int height, GLenum filter);
    void bind(int unit) const;
    int width() const { return width_; }
    int height() const { return height_; }

  private:
    int width_;
    int height_;
};

class Renderbuffer : public Name<remove_renderbuffer> {
  public:
    /// samples: 0 or 1 for no multisampling.
    Renderbuffer(GLenum internal_format, int width, int height, int samples);
};

class Framebuffer : public Name<remove_framebuffer> {
  public:
    Framebuffer();
    void bind() const { glBindFramebuffer(GL_FRAMEBUFFER, id()); }
    void attach(GLenum attachment, const Texture& texture);
    void attach(GLenum attachment, const Renderbuffer& buffer);
    /// Throws JobError, with `name`, if the framebuffer is not complete.
    void check(const std::string& name) const;
};

/// Throws JobError, with `where`, if the driver has reported an error.
void check_errors(const std::string& where);

}  // namespace splitcubes::gl
