#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/gl/objects.h>
#include <splitcubes/render/renderer_impl.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::render {

namespace {

void check_options(const RenderOptions& options) {
    GLint size_limit = 0;
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &size_limit);
    GLint sample_limit = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &sample_limit);
    const auto in_range = [](const char* name, int value, int low, int high) {
        if (value >= low && value <= high) return;
        throw InputError(std::string("render options: ") + name,
                         "is out of range (" + std::to_string(value) + ")",
                         "choose " + std::to_string(low) + " to " + std::to_string(high));
    };
    in_range("width", options.width, 1, size_limit);
    in_range("height", options.height, 1, size_limit);
    in_range("samples", options.samples, 1, sample_limit);
    in_range("shadow_map_size", options.shadow_map_size, 16, size_limit);
    // Colour and depth of every sample, the resolved picture and its copies; a software rasteriser keeps them
    // all in the program's own memory.
    const double pixels = static_cast<double>(options.width) * options.height;
    require_memory("picture of " + std::to_string(options.width) + " x " + std::to_string(options.height),
                   pixels * (24.0 + 12.0 * options.samples), "choose a smaller one");
    const auto direction = [](const char* name, const Vec3& value) {
        if (value.allFinite() && value.norm() > 0) return;
        throw InputError(std::string("render options: ") + name, "has no direction");
    };
    direction("up", options.up);
    if (options.to_light) direction("to_light", *options.to_light);
}

}  // namespace

Renderer::Impl::Impl(const gl::Context& with, const RenderOptions& wanted) : context(&with) {
    apply(wanted);
}

Renderer::Impl::~Impl() {
    // The members' names are valid in this context only.
    try {
        context->make_current();
    } catch (const JobError&) {
        // A lost context has already freed its objects.
    }
}

// Drivers have undocumented limits.
void Renderer::Impl::make_screen_targets(const RenderOptions& wanted) {
    try {
        screen.emplace(wanted.width, wanted.height, wanted.samples);
    } catch (const JobError&) {
        throw InputError(
            "picture of " + std::to_string(wanted.width) + " x " + std::to_string(wanted.height),
            "is larger than this OpenGL draws with " + std::to_string(wanted.samples) + " samples a pixel",
            "choose a smaller one");
    }
}

void Renderer::Impl::apply(const RenderOptions& wanted) {
    check_options(wanted);
    if (!shadow || wanted.shadow_map_size != options.shadow_map_size) shadow.emplace(wanted.shadow_map_size);
    if (!screen || wanted.width != options.width || wanted.height != options.height ||
        wanted.samples != options.samples) {
        make_screen_targets(wanted);
    }
    options = wanted;
}

void Renderer::Impl::set_ground(const Program& program, const FrameSetup& frame) const {
    set_camera(program, frame);
    program.set("ground_center", floats(frame.ground_center));
    program.set("ground_u", floats(frame.ground_u));
    program.set("ground_v", floats(frame.ground_v));
    program.set("ground_color", floats(linear(options.ground_color)));
}

void Renderer::Impl::set_lighting(const Program& program, const FrameSetup& frame) const {
    screen->blurred.bind(0);
    program.set("visibility_map", 0);
    program.set("light_in_view", floats(rotated(frame.view_from_world, frame.to_light)));
    program.set("up_in_view", floats(rotated(frame.view_from_world, frame.up)));
    program.set("background_color", floats(linear(options.background)));
    program.set("picture_size", floats(Vec2(options.width, options.height)));
    program.set("plane_tolerance", plane_tolerance(frame));
    program.set("tan_half_fov", floats(frame.tan_half_fov));
}

void Renderer::Impl::bind_finishes(const Program& program, const DrawList& list) const {
    buffers.finish_texture.bind(finish_unit, GL_RGBA32F, buffers.finishes);
    program.set("finishes", finish_unit);
    program.set("picture_map", picture_unit);
    program.set("hatch_period", static_cast<float>(list.hatch_period));
}

const PictureTexture& Renderer::Impl::texture_of(const std::shared_ptr<const Picture>& picture) {
    constexpr std::size_t max_kept = 16;
    for (const auto& [known, texture] : textures)
        if (known == picture) return *texture;
    if (textures.size() >= max_kept) textures.erase(textures.begin());
    textures.emplace_back(picture, std::make_unique<PictureTexture>(*picture));
    return *textures.back().second;
}

/// Draws front faces, then back faces slightly further away: of two coincident faces, as on a closed cut, the
/// one that faces the viewer is visible.
void Renderer::Impl::draw_meshes(const Program& program, const PackedScene& scene) {
    buffers.triangles.bind();
    glEnable(GL_CULL_FACE);
    glEnable(GL_POLYGON_OFFSET_FILL);
    for (const bool back : {false, true}) {
        glCullFace(back ? GL_FRONT : GL_BACK);
        for (const PackedScene::Range& range : scene.ranges) {
            const float offset = (back ? 2.0F : 0.0F) + (range.recessed ? 1.0F : 0.0F);
            glPolygonOffset(offset, 4.0F * offset);
            program.set("roughness", range.roughness);
            program.set("finish", range.finish);
            program.set("has_picture", range.picture ? 1 : 0);
            if (range.picture) texture_of(range.picture).bind(picture_unit);
            glDrawArrays(GL_TRIANGLES, static_cast<GLint>(range.first), static_cast<GLsizei>(range.count));
        }
    }
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_CULL_FACE);
}

void Renderer::Impl::draw_shadow(const FrameSetup& frame, const PackedScene& scene, const DrawList& list) {
    shadow->framebuffer.bind();
    glViewport(0, 0, shadow->depth.width(), shadow->depth.height());
    glEnable(GL_DEPTH_TEST);
    glClear(GL_DEPTH_BUFFER_BIT);
    if (!options.shadows) return;
    programs.shadow.use();
    programs.shadow.set("view_from_world", floats(frame.light_view_from_world));
    programs.shadow.set("clip_from_view", floats(frame.light_clip_from_view));
    buffers.triangles.bind();
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(1.0F, 2.0F);
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(scene.vertices.size()));
    if (!list.surfaces.empty()) {
        programs.live_shadow.use();
        FrameSetup light = frame;
        light.view_from_world = frame.light_view_from_world;
        light.clip_from_view = frame.light_clip_from_view;
        draw_live(programs.live_shadow, light, list);
        draw_live(programs.live_shadow, light, list, true);
    }
    glDisable(GL_POLYGON_OFFSET_FILL);
}

void Renderer::Impl::draw_points(const FrameSetup& frame, const DrawList& list) {
    if (list.points.empty()) return;
    programs.points.use();
    set_camera(programs.points, frame);
    set_clip(programs.points, frame, list.clip);
    programs.points.set("picture_height", static_cast<float>(options.height));
    glEnable(GL_PROGRAM_POINT_SIZE);
    glEnable(GL_CLIP_DISTANCE0);
    if (list.points_on_top) glClear(GL_DEPTH_BUFFER_BIT);
    buffers.points.bind();
    for (const PointSet& set : list.points) {
        std::vector<float> data(set.positions);
        data.insert(data.end(), set.colours.begin(), set.colours.end());
        data.resize(2 * set.positions.size());
        buffers.point_data.upload<float>(GL_ARRAY_BUFFER, std::span<const float>(data));
        programs.points.set("radius", static_cast<float>(set.radius));
        SceneBuffers::attribute(0, 3, 12, 0);
        SceneBuffers::attribute(1, 3, 12, 4 * set.positions.size());
        glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(set.positions.size() / 3));
    }
    glDisable(GL_CLIP_DISTANCE0);
    glDisable(GL_PROGRAM_POINT_SIZE);
}

// divisor: of the target's resolution; margin: pixels around it that are needed beside it.
void Renderer::Impl::begin_area(int divisor, int margin) const {
    const PixelArea& area = options.area;
    if (area.width <= 0 || area.height <= 0) return;
    const int left = area.x / divisor - margin, bottom = area.y / divisor - margin;
    const int right = (area.x + area.width + divisor - 1) / divisor + margin,
              top = (area.y + area.height + divisor - 1) / divisor + margin;
    glScissor(left, bottom, right - left, top - bottom);
    glEnable(GL_SCISSOR_TEST);
}

void Renderer::Impl::draw_surfaces(const FrameSetup& frame, const PackedScene& scene, const DrawList& list) {
    screen->surface_target.bind();
    glViewport(0, 0, screen->half_width, screen->half_height);
    // Empty pixels face the eye and are very far away.
    const std::array<float, 4> nothing = {0, 0, 1, static_cast<float>(1e4 * frame.radius)};
    glClearBufferfv(GL_COLOR, 0, nothing.data());
    glClear(GL_DEPTH_BUFFER_BIT);
    begin_area(2, 64);
    programs.mesh_surface.use();
    set_camera(programs.mesh_surface, frame);
    draw_meshes(programs.mesh_surface, scene);
    if (!list.surfaces.empty()) {
        programs.live_surface.use();
        draw_live(programs.live_surface, frame, list);
    }
    if (frame.ground_visible) {
        programs.ground_surface.use();
        set_ground(programs.ground_surface, frame);
        draw_ground_square();
    }
    glDisable(GL_SCISSOR_TEST);
}

void Renderer::Impl::find_visibility(const FrameSetup& frame) {
    glDisable(GL_DEPTH_TEST);
    begin_area(2, 8);
    const double texel = frame.light_extent / options.shadow_map_size;
    const Program& program = programs.visibility;
    screen->visibility_target.bind();
    program.use();
    screen->surface.bind(0);
    shadow->depth.bind(1);
    program.set("surface_map", 0);
    program.set("shadow_map", 1);
    program.set("light_from_view",
                floats(Eigen::Matrix4d(frame.light_from_world * frame.view_from_world.inverse())));
    program.set("light_in_view", floats(rotated(frame.view_from_world, frame.to_light)));
    program.set("tan_half_fov", floats(frame.tan_half_fov));
    program.set("ao_radius", static_cast<float>(options.ambient_occlusion ? 0.3 * frame.radius : 0.0));
    program.set("shadow_extent", static_cast<float>(options.shadows ? frame.light_extent : 0.0));
    program.set("shadow_depth", static_cast<float>(frame.light_depth));
    program.set("shadow_bias", static_cast<float>(2 * texel + 0.002 * frame.radius));
    program.set("light_softness", 0.14F);
    program.set("search_radius", static_cast<float>(0.12 * frame.radius));
    cover_screen();

    screen->blurred_target.bind();
    programs.blur.use();
    screen->visibility.bind(1);
    programs.blur.set("surface_map", 0);
    programs.blur.set("visibility_map", 1);
    programs.blur.set("tan_half_fov", floats(frame.tan_half_fov));
    programs.blur.set("plane_tolerance", plane_tolerance(frame));
    cover_screen();
    glDisable(GL_SCISSOR_TEST);
}

void Renderer::Impl::draw_lines(const FrameSetup& frame, const PackedScene& scene) {
    if (scene.segments.empty()) return;
    programs.line.use();
    set_camera(programs.line, frame);
    programs.line.set("picture_size", floats(Vec2(options.width, options.height)));
    programs.line.set("near_distance", static_cast<float>(frame.near_distance));
    buffers.lines.bind();
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 12, static_cast<GLsizei>(scene.segments.size()));
}

void Renderer::Impl::draw_picture(const FrameSetup& frame, const PackedScene& scene, const DrawList& list) {
    screen->picture_target.bind();
    glViewport(0, 0, options.width, options.height);
    glEnable(GL_FRAMEBUFFER_SRGB);
    glClear(GL_DEPTH_BUFFER_BIT);
    begin_area(1, 0);
    glEnable(GL_DEPTH_TEST);
    const Program& mesh = programs.mesh.with(light_defines());
    mesh.use();
    set_camera(mesh, frame);
    set_lighting(mesh, frame);
    bind_finishes(mesh, list);
    draw_meshes(mesh, scene);
    draw_live_colours(frame, list);
    if (frame.ground_visible) {
        const Program& ground = programs.ground.with(light_defines());
        ground.use();
        set_ground(ground, frame);
        set_lighting(ground, frame);
        draw_ground_square();
    }
    // The background is drawn last, at maximum depth, so that only its visible part is shaded.
    glDepthFunc(GL_LEQUAL);
    programs.background.use();
    set_lighting(programs.background, frame);
    cover_screen();
    glDepthFunc(GL_LESS);
    draw_wires(frame, list);
    draw_points(frame, list);
    draw_lines(frame, scene);
    if (std::any_of(list.surfaces.begin(), list.surfaces.end(),
                    [](const LiveSurface* surface) { return surface->style.opacity < 1; }))
        draw_veils(frame, list);
    // Samples are averaged as linear light, not as sRGB values.
    glBindFramebuffer(GL_READ_FRAMEBUFFER, screen->picture_target.id());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, screen->final_target.id());
    glBlitFramebuffer(0, 0, options.width, options.height, 0, 0, options.width, options.height,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glDisable(GL_FRAMEBUFFER_SRGB);
    glDisable(GL_SCISSOR_TEST);
}

void Renderer::Impl::render(const DrawList& list, const Camera& camera) {
    const FrameSetup frame = set_up_frame(list, camera, options);
    PackedScene scene = pack(list, frame.origin, options.height / 720.0);
    live_finishes.clear();
    for (const LiveSurface* surface : list.surfaces) {
        const auto& finishes = surface->style.finishes;
        live_finishes.emplace_back().fill(-1);
        for (std::size_t k = 0; k < std::min<std::size_t>(finishes.size(), 16); ++k)
            if (finishes[k]) live_finishes.back()[k] = scene.finishes.add(*finishes[k]);
    }
    context->make_current();
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_LESS);
    glFrontFace(GL_CCW);
    buffers.vertices.upload<PackedScene::Vertex>(GL_ARRAY_BUFFER, scene.vertices);
    buffers.segments.upload<PackedScene::Segment>(GL_ARRAY_BUFFER, scene.segments);
    // A buffer without bytes is none that a texture can read.
    const std::vector<float> no_finish(4, 0.0F);
    buffers.finishes.upload<float>(GL_TEXTURE_BUFFER,
                                   scene.finishes.data().empty() ? no_finish : scene.finishes.data());
    if (options.shadows || options.ambient_occlusion) {
        draw_shadow(frame, scene, list);
        draw_surfaces(frame, scene, list);
        find_visibility(frame);
    } else {
        show_everything_lit();
    }
    draw_picture(frame, scene, list);
    gl::check_errors("Renderer");
}

void Renderer::Impl::show_everything_lit() {
    screen->blurred_target.bind();
    const std::array<float, 4> lit = {1, 1, 1, 1};
    glClearBufferfv(GL_COLOR, 0, lit.data());
}

Renderer::Renderer(const gl::Context& context, const RenderOptions& options) {
    context.make_current();
    impl_ = std::make_unique<Impl>(context, options);
}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

Picture Renderer::draw(const DrawList& list, const Camera& camera) {
    impl_->render(list, camera);
    const auto width = static_cast<std::size_t>(impl_->options.width);
    const auto height = static_cast<std::size_t>(impl_->options.height);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->screen->final_target.id());
    std::vector<std::uint8_t> rgba(4 * width * height);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 0, impl_->options.width, impl_->options.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    gl::check_errors("reading the picture");
    Picture picture{.width = impl_->options.width, .height = impl_->options.height, .rgb = {}};
    picture.rgb.resize(3 * width * height);
    for (std::size_t row = 0; row < height; ++row) {
        // OpenGL counts rows from the bottom.
        const std::uint8_t* from = rgba.data() + 4 * width * (height - 1 - row);
        std::uint8_t* to = picture.rgb.data() + 3 * width * row;
        for (std::size_t column = 0; column < width; ++column) {
            std::copy_n(from + 4 * column, 3, to + 3 * column);
        }
    }
    return picture;
}

void Renderer::draw_into(const DrawList& list, const Camera& camera, unsigned framebuffer) {
    draw_into(list, camera, framebuffer, impl_->options.width, impl_->options.height);
}

void Renderer::draw_into(const DrawList& list, const Camera& camera, unsigned framebuffer, int to_width,
                         int to_height) {
    impl_->render(list, camera);
    const int width = impl_->options.width;
    const int height = impl_->options.height;
    const bool scales = to_width != width || to_height != height;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->screen->final_target.id());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    const PixelArea& area = impl_->options.area;
    if (area.width > 0) {
        const auto x = [&](int pixel) { return static_cast<int>(std::int64_t{pixel} * to_width / width); };
        const auto y = [&](int pixel) { return static_cast<int>(std::int64_t{pixel} * to_height / height); };
        glScissor(x(area.x), y(area.y), x(area.x + area.width) - x(area.x),
                  y(area.y + area.height) - y(area.y));
        glEnable(GL_SCISSOR_TEST);
    }
    glBlitFramebuffer(0, 0, width, height, 0, 0, to_width, to_height, GL_COLOR_BUFFER_BIT,
                      scales ? GL_LINEAR : GL_NEAREST);
    glDisable(GL_SCISSOR_TEST);
    gl::check_errors("showing the picture");
}

const RenderOptions& Renderer::options() const {
    return impl_->options;
}

void Renderer::set_options(const RenderOptions& options) {
    impl_->context->make_current();
    impl_->apply(options);
}

}  // namespace splitcubes::render
