// OpenGL objects that the renderer keeps: programs, targets, vertex arrays.
#pragma once

#include <splitcubes/gl/objects.h>
#include <splitcubes/gl/program.h>
#include <splitcubes/render/packed_scene.h>
#include <splitcubes/render/picture.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::render {

/// A program by what its fragment shader is to do; made when it is needed first.
class ProgramVariants {
  public:
    ProgramVariants(std::string vertex_file, std::string fragment_file)
        : vertex_(std::move(vertex_file)), fragment_(std::move(fragment_file)) {}
    const gl::Program& with(const std::vector<std::string>& defines) {
        const auto known = programs_.find(defines);
        if (known != programs_.end()) return known->second;
        return programs_.emplace(defines, gl::Program::from_files(vertex_, fragment_, defines)).first->second;
    }

  private:
    std::string vertex_, fragment_;
    std::map<std::vector<std::string>, gl::Program> programs_;
};

struct Programs {
    gl::Program shadow = gl::Program::from_files("mesh.vert", "shadow.frag");
    gl::Program mesh_surface = gl::Program::from_files("mesh.vert", "surface.frag");
    gl::Program ground_surface = gl::Program::from_files("ground.vert", "surface.frag");
    gl::Program visibility = gl::Program::from_files("screen.vert", "visibility.frag");
    gl::Program blur = gl::Program::from_files("screen.vert", "visibility_blur.frag");
    gl::Program background = gl::Program::from_files("screen.vert", "background.frag");
    ProgramVariants ground{"ground.vert", "ground.frag"};
    ProgramVariants mesh{"mesh.vert", "mesh.frag"};
    gl::Program live_shadow = gl::Program::from_files("live.vert", "shadow.frag");
    gl::Program live_surface = gl::Program::from_files("live.vert", "surface.frag");
    ProgramVariants live{"live.vert", "live.frag"};
    gl::Program section = gl::Program::from_files("live.vert", "section.frag");
    gl::Program wire = gl::Program::from_files("live.vert", "wire.frag");
    gl::Program points = gl::Program::from_files("points.vert", "points.frag");
    gl::Program line = gl::Program::from_files("line.vert", "line.frag");
};

struct ShadowTarget {
    gl::Texture depth;
    gl::Framebuffer framebuffer;

    explicit ShadowTarget(int size) : depth(GL_DEPTH_COMPONENT32F, size, size, GL_NEAREST) {
        framebuffer.attach(GL_DEPTH_ATTACHMENT, depth);
        glDrawBuffer(GL_NONE);
        glReadBuffer(GL_NONE);
        framebuffer.check("the shadow map");
    }
};

/// Targets that depend on the picture's size. The screen-space passes run at half of it: their results are
/// soft, and the cost is a quarter.
struct ScreenTargets {
    int half_width;
    int half_height;
    gl::Texture surface;
    gl::Texture visibility;
    gl::Texture blurred;
    gl::Renderbuffer surface_depth;
    gl::Renderbuffer color;        // multisampled
    gl::Renderbuffer depth;        // multisampled
    gl::Renderbuffer final_color;  // one sample per pixel, sRGB
    gl::Framebuffer surface_target;
    gl::Framebuffer visibility_target;
    gl::Framebuffer blurred_target;
    gl::Framebuffer picture_target;
    gl::Framebuffer final_target;

    ScreenTargets(int width, int height, int samples)
        : half_width((width + 1) / 2),
          half_height((height + 1) / 2),
          surface(GL_RGBA32F, half_width, half_height, GL_NEAREST),
          visibility(GL_RGBA32F, half_width, half_height, GL_NEAREST),
          blurred(GL_RGBA32F, half_width, half_height, GL_NEAREST),
          surface_depth(GL_DEPTH_COMPONENT32F, half_width, half_height, 1),
          color(GL_SRGB8_ALPHA8, width, height, samples),
          depth(GL_DEPTH24_STENCIL8, width, height, samples),
          final_color(GL_SRGB8_ALPHA8, width, height, 1) {
        surface_target.attach(GL_COLOR_ATTACHMENT0, surface);
        surface_target.attach(GL_DEPTH_ATTACHMENT, surface_depth);
        surface_target.check("surfaces");
        visibility_target.attach(GL_COLOR_ATTACHMENT0, visibility);
        visibility_target.check("visibility");
        blurred_target.attach(GL_COLOR_ATTACHMENT0, blurred);
        blurred_target.check("blurred visibility");
        picture_target.attach(GL_COLOR_ATTACHMENT0, color);
        picture_target.attach(GL_DEPTH_STENCIL_ATTACHMENT, depth);
        picture_target.check("the picture (" + std::to_string(samples) + " samples)");
        final_target.attach(GL_COLOR_ATTACHMENT0, final_color);
        final_target.check("the final picture");
    }
};

/// A buffer that shaders read by index.
struct BufferTexture {
    GLuint id = 0;
    BufferTexture() { glGenTextures(1, &id); }
    ~BufferTexture() { glDeleteTextures(1, &id); }
    BufferTexture(const BufferTexture&) = delete;
    BufferTexture& operator=(const BufferTexture&) = delete;
    void bind(GLuint unit, GLenum format, const gl::Buffer& buffer) const {
        glActiveTexture(GL_TEXTURE0 + unit);
        glBindTexture(GL_TEXTURE_BUFFER, id);
        glTexBuffer(GL_TEXTURE_BUFFER, format, buffer.id());
    }
};

/// A picture that is laid on surfaces, repeated in both directions.
struct PictureTexture {
    GLuint id = 0;
    explicit PictureTexture(const Picture& picture);
    ~PictureTexture() { glDeleteTextures(1, &id); }
    PictureTexture(const PictureTexture&) = delete;
    PictureTexture& operator=(const PictureTexture&) = delete;
    void bind(GLuint unit) const {
        glActiveTexture(GL_TEXTURE0 + unit);
        glBindTexture(GL_TEXTURE_2D, id);
    }
};

/// Vertex arrays of one picture's scene.
struct SceneBuffers {
    gl::VertexArray triangles;
    gl::Buffer vertices;
    gl::VertexArray lines;
    gl::Buffer segments;
    gl::VertexArray points;
    gl::Buffer point_data;
    gl::Buffer finishes;
    BufferTexture finish_texture;
    gl::VertexArray none;  // for passes that compute vertices from their index

    SceneBuffers() {
        triangles.bind();
        glBindBuffer(GL_ARRAY_BUFFER, vertices.id());
        attribute(0, 3, sizeof(PackedScene::Vertex), offsetof(PackedScene::Vertex, position));
        attribute(1, 3, sizeof(PackedScene::Vertex), offsetof(PackedScene::Vertex, normal));
        attribute(2, 3, sizeof(PackedScene::Vertex), offsetof(PackedScene::Vertex, color));
        attribute(3, 4, sizeof(PackedScene::Vertex), offsetof(PackedScene::Vertex, rest));
        attribute(4, 3, sizeof(PackedScene::Vertex), offsetof(PackedScene::Vertex, extra));
        lines.bind();
        glBindBuffer(GL_ARRAY_BUFFER, segments.id());
        attribute(0, 3, sizeof(PackedScene::Segment), offsetof(PackedScene::Segment, from));
        attribute(1, 3, sizeof(PackedScene::Segment), offsetof(PackedScene::Segment, to));
        attribute(2, 3, sizeof(PackedScene::Segment), offsetof(PackedScene::Segment, color));
        attribute(3, 2, sizeof(PackedScene::Segment), offsetof(PackedScene::Segment, shape));
        for (GLuint index = 0; index < 4; ++index) glVertexAttribDivisor(index, 1);
    }

    static void attribute(GLuint index, GLint size, std::size_t stride, std::size_t offset) {
        glEnableVertexAttribArray(index);
        glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                              reinterpret_cast<const void*>(offset));
    }
};

}  // namespace splitcubes::render
