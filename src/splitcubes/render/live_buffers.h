// Driver objects of live surfaces.
#pragma once

#include <splitcubes/gl/objects.h>
#include <splitcubes/render/live_surface.h>

#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <vector>

namespace splitcubes::render {

/// A buffer that grows by halves and keeps its contents.
class SlotBuffer {
  public:
    SlotBuffer(GLenum target, std::size_t bytes_each) : target_(target), bytes_each_(bytes_each) {}
    /// Copies slots first .. first + count - 1 out of an array of `size` slots.
    void write(const void* array, std::size_t size, const SlotRange& range);
    GLuint id() const { return buffer_.id(); }
    std::size_t size() const { return size_; }  // slots
    std::size_t bytes_copied() const { return bytes_copied_; }

  private:
    void reserve(std::size_t slots);

    gl::Buffer buffer_;
    GLenum target_;
    std::size_t bytes_each_;
    std::size_t size_ = 0, capacity_ = 0, bytes_copied_ = 0;
};

struct LiveSurface::Impl {
    gl::VertexArray array;
    SlotBuffer positions{GL_ARRAY_BUFFER, 12}, normals{GL_ARRAY_BUFFER, 12}, field{GL_ARRAY_BUFFER, 4},
        pieces{GL_ARRAY_BUFFER, 4}, rest{GL_ARRAY_BUFFER, 16}, marks{GL_ARRAY_BUFFER, 4},
        triangles{GL_COPY_WRITE_BUFFER, 12}, materials{GL_COPY_WRITE_BUFFER, 4},
        corner_uv{GL_COPY_WRITE_BUFFER, 24};
    GLuint material_texture = 0;
    std::array<GLuint, 3> corner_textures{};    // coordinates, indices and positions of triangles' corners
    std::vector<std::int32_t> piece_of_vertex;  // copy, for bounds
    geometry::Box bounds;

    Impl();
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    /// Binds arrays and the texture of materials to unit 1.
    void bind() const;
    /// Binds what pictures need to three units from the first on.
    void bind_corners(GLuint first_unit) const;
};

}  // namespace splitcubes::render
