// Draws what a viewer shows with the project's renderer.
#pragma once

#include <splitcubes/gl/context.h>
#include <splitcubes/render/renderer.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/view/quality.h>
#include <splitcubes/view/viewer.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::view {

/// The colour scale that is shown.
struct Legend {
    std::string title;      // empty: none
    double high = 1;        // value at the end of the scale, which begins at 0
    bool reversed = false;  // the colours run from the end of the scale to its beginning
    bool is_of_links = false;
};
/// Colour of a link, sRGB, as `render --links` has it: from blue, seen, over yellow to red, hidden.
render::Color link_colour(double visibility);

/// A number at a point of the picture.
struct NumberLabel {
    Vec3 at = Vec3::Zero();  // m, world
    std::string text;
};

class StateRenderer {
  public:
    /// The context must outlive it and be current in all calls.
    explicit StateRenderer(const gl::Context& context);

    /// Draws into a framebuffer object of the context; 0: the window. Pixels: those of the framebuffer, which
    /// may be more than the viewer counts on displays of high resolution.
    /// area: the part of it that is seen; without extent: all of it.
    void draw(const Viewer& viewer, int width, int height, unsigned framebuffer,
              Quality quality = Quality::fine, const render::PixelArea& area = {});
    /// quality: fine or quick.
    render::Picture picture(const Viewer& viewer, int width, int height, Quality quality = Quality::fine);
    const Legend& legend() const { return legend_; }
    /// Numbers at the arrows of the last picture, for whoever draws text over it.
    const std::vector<NumberLabel>& labels() const { return labels_; }
    std::size_t triangles() const { return triangles_; }
    /// Bytes that were copied to the driver for surfaces.
    std::size_t bytes_copied() const;

  private:
    struct BodyBuffers {
        render::LiveSurface surface;
        std::uint64_t revision = 0;
        std::uint64_t state = 0, scene = 0;
        Colouring labelled = Colouring::material;  // what the labels of its triangles stand for
    };
    void update_options(const Viewer& viewer, int width, int height, Quality quality,
                        const render::PixelArea& area = {});
    void update_surface(BodyBuffers& buffers, const BodyState& body, const PublishedState& state,
                        Colouring colouring);
    std::shared_ptr<const render::Picture> picture_of(const std::shared_ptr<const SurfacePicture>& picture);
    void add_line(std::vector<Vec3> points, const render::Color& color, double width, double lift);
    void add_arrow(const Viewer& viewer, const Vec3& at, const Vec3& force, double length,
                   const render::Color& color);
    void add_forces(const Viewer& viewer);
    void add_links(const Viewer& viewer);
    void add_contacts(const Viewer& viewer);
    void update_style(const Viewer& viewer, const PublishedState& state);
    void add_lines(const Viewer& viewer);
    void add_points(const Viewer& viewer);
    void add_colliders(const PublishedState& state);
    void add_parts(const std::vector<scene::InstrumentPart>& parts, const Isometry& frame);
    void add_instruments(const PublishedState& state);
    void add_forceps(const PublishedState& state);
    void add_hand_instrument(const Viewer& viewer);
    void make_list(const Viewer& viewer);

    const gl::Context& context_;
    std::unique_ptr<render::Renderer> renderer_;
    std::vector<BodyBuffers> bodies_;
    render::DrawList list_;
    Legend legend_;
    std::vector<NumberLabel> labels_;
    std::map<std::shared_ptr<const SurfacePicture>, std::shared_ptr<const render::Picture>> pictures_;
    std::size_t triangles_ = 0;
    HandInstrument hand_;  // that the next member is of
    std::vector<scene::InstrumentPart> hand_parts_;
};

}  // namespace splitcubes::view
