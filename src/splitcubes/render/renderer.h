// Renderer for lists of triangles and lines: key light with a soft shadow, sky light with ambient occlusion,
// an infinite ground.
#pragma once

#include <splitcubes/gl/context.h>
#include <splitcubes/math/types.h>
#include <splitcubes/render/camera.h>
#include <splitcubes/render/draw_list.h>
#include <splitcubes/render/picture.h>

#include <memory>
#include <optional>

namespace splitcubes::render {

/// A part of a picture, pixels from the lower left corner.
struct PixelArea {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const PixelArea&) const = default;
};

struct RenderOptions {
    int width = 1280;  // pixels
    int height = 720;  // pixels
    bool ground = true;
    double ground_height = 0;  // m along up
    Vec3 up = Vec3::UnitZ();   // world, of any length; direction of the sky
    int samples = 4;           // per pixel: 1 or a number that the driver supports
    bool shadows = true;
    bool ambient_occlusion = true;
    int shadow_map_size = 2048;  // texels per side
    /// Direction to the key light, world. If absent, the light is above and to the left of the camera and
    /// moves with it.
    std::optional<Vec3> to_light;
    Color background = Color(0.925, 0.935, 0.945);
    Color ground_color = Color(0.86, 0.865, 0.87);
    /// Only this part of the picture is drawn; without extent: all of it.
    PixelArea area = {};
};

/// The renderer. The same list, camera and options give the same picture byte for byte on the same driver.
class Renderer {
  public:
    /// Makes a renderer. The context must outlive it. Throws InputError for options out of range, JobError if
    /// the driver cannot create the required objects.
    explicit Renderer(const gl::Context& context, const RenderOptions& options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// Draws a picture. Throws InputError if a mesh's arrays do not match or the camera's eye and target
    /// coincide.
    Picture draw(const DrawList& list, const Camera& camera);

    /// Draws into a framebuffer object of the context (0: the window), from the lower left corner, width x
    /// height pixels.
    void draw_into(const DrawList& list, const Camera& camera, unsigned framebuffer);
    /// The same, scaled to the framebuffer's size, pixels.
    void draw_into(const DrawList& list, const Camera& camera, unsigned framebuffer, int to_width,
                   int to_height);

    const RenderOptions& options() const;
    /// Sets new options; rebuilds only what depends on them.
    void set_options(const RenderOptions& options);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace splitcubes::render
