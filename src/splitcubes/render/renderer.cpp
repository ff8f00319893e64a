#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/gl/objects.h>
#include <splitcubes/gl/program.h>
#include <splitcubes/render/device_objects.h>
#include <splitcubes/render/frame_setup.h>
#include <splitcubes/render/live_buffers.h>
#include <splitcubes/render/packed_scene.h>
#include <splitcubes/render/renderer.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::render {

namespace {

using gl::Program;

constexpr int finish_unit = 2, picture_unit = 3;  // texture units
constexpr int corner_unit = 4, live_picture_unit = 7;

std::array<float, 16> floats(const Eigen::Matrix4d& matrix) {
    std::array<float, 16> out{};
    for (int i = 0; i < 16; ++i) out[static_cast<std::size_t>(i)] = static_cast<float>(matrix.data()[i]);
    return out;
}

std::array<float, 3> floats(const Vec3& value) {
    return {static_cast<float>(value.x()), static_cast<float>(value.y()), static_cast<float>(value.z())};
}

std::array<float, 2> floats(const Vec2& value) {
    return {static_cast<float>(value.x()), static_cast<float>(value.y())};
}

Vec3 rotated(const Eigen::Matrix4d& matrix, const Vec3& direction) {
    return matrix.topLeftCorner<3, 3>() * direction;
}

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

struct Renderer::Impl {
    const gl::Context* context;
    RenderOptions options;
    Programs programs;
    SceneBuffers buffers;
    std::optional<ShadowTarget> shadow;
    std::optional<ScreenTargets> screen;
    /// Pictures that were drawn last, and their textures.
    std::vector<std::pair<std::shared_ptr<const Picture>, std::unique_ptr<PictureTexture>>> textures;
    std::vector<std::array<int, 16>> live_finishes;  // per live surface: finish of each material, -1: none

    Impl(const gl::Context& with, const RenderOptions& wanted) : context(&with) { apply(wanted); }

    ~Impl() {
        // The members' names are valid in this context only.
        try {
            context->make_current();
        } catch (const JobError&) {
            // A lost context has already freed its objects.
        }
    }

    // Drivers have undocumented limits.
    void make_screen_targets(const RenderOptions& wanted) {
        try {
            screen.emplace(wanted.width, wanted.height, wanted.samples);
        } catch (const JobError&) {
            throw InputError(
                "picture of " + std::to_string(wanted.width) + " x " + std::to_string(wanted.height),
                "is larger than this OpenGL draws with " + std::to_string(wanted.samples) +
                    " samples a pixel",
                "choose a smaller one");
        }
    }

    void apply(const RenderOptions& wanted) {
        check_options(wanted);
        if (!shadow || wanted.shadow_map_size != options.shadow_map_size)
            shadow.emplace(wanted.shadow_map_size);
        if (!screen || wanted.width != options.width || wanted.height != options.height ||
            wanted.samples != options.samples) {
            make_screen_targets(wanted);
        }
        options = wanted;
    }

    void render(const DrawList& list, const Camera& camera);
    void draw_shadow(const FrameSetup& frame, const PackedScene& scene, const DrawList& list);
    void draw_surfaces(const FrameSetup& frame, const PackedScene& scene, const DrawList& list);
    void show_everything_lit();
    /// Those that are opaque, or the others; looks: see LiveSurface, below 0: any.
    void draw_live(const Program& program, const FrameSetup& frame, const DrawList& list, bool veiled = false,
                   int looks = -1);
    void shade_live(const FrameSetup& frame, const DrawList& list, bool veiled);
    void draw_live_surface(const Program& program, const LiveSurface& surface, std::size_t index);
    void set_live_pictures(const Program& program, const LiveSurface& surface);
    void draw_live_colours(const FrameSetup& frame, const DrawList& list);
    void draw_veils(const FrameSetup& frame, const DrawList& list);
    void draw_wires(const FrameSetup& frame, const DrawList& list);
    void draw_points(const FrameSetup& frame, const DrawList& list);
    void find_visibility(const FrameSetup& frame);
    void draw_picture(const FrameSetup& frame, const PackedScene& scene, const DrawList& list);
    void bind_finishes(const Program& program, const DrawList& list) const;
    const PictureTexture& texture_of(const std::shared_ptr<const Picture>& picture);
    void draw_meshes(const Program& program, const PackedScene& scene);
    void draw_lines(const FrameSetup& frame, const PackedScene& scene);
    void set_ground(const Program& program, const FrameSetup& frame) const;
    void set_lighting(const Program& program, const FrameSetup& frame) const;
    void cover_screen() const {
        buffers.none.bind();
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    void draw_ground_square() const {
        buffers.none.bind();
        glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
};

namespace {

void set_camera(const Program& program, const FrameSetup& frame) {
    program.set("view_from_world", floats(frame.view_from_world));
    program.set("clip_from_view", floats(frame.clip_from_view));
}

/// Returns the maximum distance of a neighbour from the plane for its visibility to be blended, m.
float plane_tolerance(const FrameSetup& frame) {
    return static_cast<float>(0.02 * frame.radius);
}

}  // namespace

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

// Samplers of different kinds may not share a unit, even where the shader does not read them.
void Renderer::Impl::set_live_pictures(const Program& program, const LiveSurface& surface) {
    surface.impl_->bind_corners(corner_unit);
    program.set("corner_uv", corner_unit);
    program.set("corner_index", corner_unit + 1);
    program.set("corner_position", corner_unit + 2);
    const auto& pictures = surface.style.pictures;
    std::vector<std::shared_ptr<const Picture>> bound;
    for (std::size_t k = 0; k < 16; ++k) {
        int number = -1;
        if (k < pictures.size() && pictures[k] && surface.impl_->corner_uv.size() > 0) {
            const auto known = std::find(bound.begin(), bound.end(), pictures[k]);
            number = static_cast<int>(known - bound.begin());
            if (known == bound.end() && bound.size() < LiveStyle::max_pictures) bound.push_back(pictures[k]);
            if (number >= static_cast<int>(bound.size())) number = -1;
        }
        program.set(("picture_of[" + std::to_string(k) + "]").c_str(), number);
    }
    for (std::size_t k = 0; k < LiveStyle::max_pictures; ++k) {
        const auto unit = live_picture_unit + static_cast<int>(k);
        program.set(("picture_" + std::to_string(k)).c_str(), unit);
        if (k < bound.size()) texture_of(bound[k]).bind(static_cast<GLuint>(unit));
    }
}

void Renderer::Impl::draw_live_surface(const Program& program, const LiveSurface& surface,
                                       std::size_t index) {
    const LiveStyle& style = surface.style;
    surface.impl_->bind();
    program.set("materials", 1);
    for (std::size_t k = 0; k < style.palette.size(); ++k)
        program.set(("palette[" + std::to_string(k) + "]").c_str(), floats(linear(style.palette[k])));
    for (std::size_t k = 0; k < live_finishes[index].size(); ++k)
        program.set(("finish_of[" + std::to_string(k) + "]").c_str(), live_finishes[index][k]);
    program.set("colouring", static_cast<int>(style.colouring));
    program.set("field_range", floats(Vec2(style.field_low, style.field_high)));
    program.set("roughness", static_cast<float>(style.roughness));
    program.set("opacity", static_cast<float>(style.opacity));
    program.set("now_ms", static_cast<float>(style.now_ms));
    program.set("age_range_ms", static_cast<float>(style.age_range_ms));
    if (&program == &programs.live[2]) set_live_pictures(program, surface);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * surface.impl_->triangles.size()), GL_UNSIGNED_INT,
                   nullptr);
}

namespace {

void set_clip(const Program& program, const FrameSetup& frame, const ClipPlane& clip) {
    program.set("origin", floats(frame.origin));
    const bool hides = clip.normal.norm() > 0;
    const Vec3 normal = hides ? Vec3(clip.normal.normalized()) : Vec3(Vec3::Zero());
    program.set(
        "clip_plane",
        std::array<float, 4>{static_cast<float>(normal.x()), static_cast<float>(normal.y()),
                             static_cast<float>(normal.z()), hides ? static_cast<float>(clip.offset) : 1.0F});
}

}  // namespace

// Back faces lie slightly behind, as those of meshes.
void Renderer::Impl::draw_live(const Program& program, const FrameSetup& frame, const DrawList& list,
                               bool veiled, int looks) {
    set_camera(program, frame);
    set_clip(program, frame, list.clip);
    glEnable(GL_CLIP_DISTANCE0);
    for (std::size_t k = 0; k < list.surfaces.size(); ++k) {
        const LiveSurface& surface = *list.surfaces[k];
        const bool is_meant = looks < 0 || surface.looks() == looks;
        if (is_meant && (surface.style.opacity < 1) == veiled) draw_live_surface(program, surface, k);
    }
    glDisable(GL_CLIP_DISTANCE0);
}

// By programs that do no more than the surfaces need.
void Renderer::Impl::shade_live(const FrameSetup& frame, const DrawList& list, bool veiled) {
    for (int looks = 0; looks < 3; ++looks) {
        const auto needs = [looks](const LiveSurface* surface) { return surface->looks() == looks; };
        if (std::none_of(list.surfaces.begin(), list.surfaces.end(), needs)) continue;
        const Program& program = programs.live[static_cast<std::size_t>(looks)];
        program.use();
        set_lighting(program, frame);
        bind_finishes(program, list);
        draw_live(program, frame, list, veiled, looks);
    }
}

void Renderer::Impl::draw_live_colours(const FrameSetup& frame, const DrawList& list) {
    if (list.surfaces.empty()) return;
    glEnable(GL_CULL_FACE);
    glEnable(GL_POLYGON_OFFSET_FILL);
    // Behind a clip plane back faces are not beside front faces, and the ground is close to them.
    const float behind = list.clip.normal.norm() > 0 ? 0.0F : 2.0F;
    for (const bool back : {false, true}) {
        glCullFace(back ? GL_FRONT : GL_BACK);
        glPolygonOffset(back ? behind : 0.0F, back ? 4 * behind : 0.0F);
        shade_live(frame, list, false);
    }
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_CULL_FACE);
}

// Of each surface only what is nearest to the eye lies over the rest of the picture.
void Renderer::Impl::draw_veils(const FrameSetup& frame, const DrawList& list) {
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    shade_live(frame, list, true);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthFunc(GL_LEQUAL);
    shade_live(frame, list, true);
    glDepthFunc(GL_LESS);
    glDisable(GL_BLEND);
}

void Renderer::Impl::draw_wires(const FrameSetup& frame, const DrawList& list) {
    const bool any = std::any_of(list.surfaces.begin(), list.surfaces.end(),
                                 [](const LiveSurface* surface) { return surface->style.wireframe; });
    if (!any) return;
    programs.wire.use();
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glEnable(GL_POLYGON_OFFSET_LINE);
    glPolygonOffset(-1.0F, -4.0F);
    draw_live(programs.wire, frame, list);
    draw_live(programs.wire, frame, list, true);
    glDisable(GL_POLYGON_OFFSET_LINE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
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

void Renderer::Impl::draw_surfaces(const FrameSetup& frame, const PackedScene& scene, const DrawList& list) {
    screen->surface_target.bind();
    glViewport(0, 0, screen->half_width, screen->half_height);
    // Empty pixels face the eye and are very far away.
    const std::array<float, 4> nothing = {0, 0, 1, static_cast<float>(1e4 * frame.radius)};
    glClearBufferfv(GL_COLOR, 0, nothing.data());
    glClear(GL_DEPTH_BUFFER_BIT);
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
}

void Renderer::Impl::find_visibility(const FrameSetup& frame) {
    glDisable(GL_DEPTH_TEST);
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
    glEnable(GL_DEPTH_TEST);
    programs.mesh.use();
    set_camera(programs.mesh, frame);
    set_lighting(programs.mesh, frame);
    bind_finishes(programs.mesh, list);
    draw_meshes(programs.mesh, scene);
    draw_live_colours(frame, list);
    if (frame.ground_visible) {
        programs.ground.use();
        set_ground(programs.ground, frame);
        set_lighting(programs.ground, frame);
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
    glBlitFramebuffer(0, 0, width, height, 0, 0, to_width, to_height, GL_COLOR_BUFFER_BIT,
                      scales ? GL_LINEAR : GL_NEAREST);
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
