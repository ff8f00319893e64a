// Draws lists of triangles and lines into pictures: key light with a soft
// shadow, light from the sky with ambient occlusion, an endless ground.
#pragma once

#include <splitcubes/gl/context.h>
#include <splitcubes/math/types.h>
#include <splitcubes/render/camera.h>
#include <splitcubes/render/draw_list.h>
#include <splitcubes/render/picture.h>

#include <memory>
#include <optional>

namespace splitcubes::render {

struct RenderOptions {
    int width = 1280;  // pixels
    int height = 720;  // pixels
    bool ground = true;
    double ground_height = 0;  // m along up
    Vec3 up = Vec3::UnitZ();   // unit or not, world; where the sky is
    int samples = 4;           // a pixel: 1 or what the driver's multisampling offers
    bool shadows = true;
    bool ambient_occlusion = true;
    int shadow_map_size = 2048;  // texels a side
    /// Towards the key light, world. When absent the light stands above and to
    /// the left of the camera and moves with it.
    std::optional<Vec3> to_light;
    Color background = Color(0.925, 0.935, 0.945);
    Color ground_color = Color(0.86, 0.865, 0.87);
};

/// The same list, camera and options give the same picture byte for byte on the
/// same driver.
class Renderer {
  public:
    /// The context must outlive the renderer. Throws InputError on options out of
    /// range, JobError when the driver cannot build what is needed.
    explicit Renderer(const gl::Context& context, const RenderOptions& options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// Throws InputError when a mesh's arrays do not fit together or the camera
    /// looks at where it stands.
    Picture draw(const DrawList& list, const Camera& camera);

    /// The same into a framebuffer object of the context (0: the window), lower
    /// left corner, width x height pixels.
    void draw_into(const DrawList& list, const Camera& camera, unsigned framebuffer);

    const RenderOptions& options() const;
    /// Takes new options; remakes only what depends on them.
    void set_options(const RenderOptions& options);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace splitcubes::render
