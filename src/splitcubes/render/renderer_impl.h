// The renderer's objects and passes.
#pragma once

#include <splitcubes/gl/program.h>
#include <splitcubes/render/device_objects.h>
#include <splitcubes/render/frame_setup.h>
#include <splitcubes/render/live_buffers.h>
#include <splitcubes/render/packed_scene.h>
#include <splitcubes/render/renderer.h>

#include <array>
#include <compare>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::render {

using gl::Program;

inline constexpr int finish_unit = 2, picture_unit = 3;  // texture units
inline constexpr int corner_unit = 4, live_picture_unit = 7;

inline std::array<float, 16> floats(const Eigen::Matrix4d& matrix) {
    std::array<float, 16> out{};
    for (int i = 0; i < 16; ++i) out[static_cast<std::size_t>(i)] = static_cast<float>(matrix.data()[i]);
    return out;
}

inline std::array<float, 3> floats(const Vec3& value) {
    return {static_cast<float>(value.x()), static_cast<float>(value.y()), static_cast<float>(value.z())};
}

inline std::array<float, 2> floats(const Vec2& value) {
    return {static_cast<float>(value.x()), static_cast<float>(value.y())};
}

/// A program for surfaces.
struct LiveLook {
    SurfaceColouring colouring;
    int looks;  // LiveSurface::looks(), of materials

    explicit LiveLook(const LiveSurface& surface)
        : colouring(surface.style.colouring),
          looks(colouring == SurfaceColouring::material ? surface.looks() : 0) {}
    auto operator<=>(const LiveLook&) const = default;
};

inline Vec3 rotated(const Eigen::Matrix4d& matrix, const Vec3& direction) {
    return matrix.topLeftCorner<3, 3>() * direction;
}

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

    Impl(const gl::Context& with, const RenderOptions& wanted);
    ~Impl();
    void make_screen_targets(const RenderOptions& wanted);
    void apply(const RenderOptions& wanted);

    void render(const DrawList& list, const Camera& camera);
    void draw_shadow(const FrameSetup& frame, const PackedScene& scene, const DrawList& list);
    void draw_surfaces(const FrameSetup& frame, const PackedScene& scene, const DrawList& list);
    void show_everything_lit();
    void begin_area(int divisor, int margin) const;
    /// Those that are opaque, or the others; look: what colours them, null: any.
    void draw_live(const Program& program, const FrameSetup& frame, const DrawList& list, bool veiled = false,
                   const LiveLook* look = nullptr);
    /// shows_section: in place of back faces a clip plane is seen.
    void shade_live(const FrameSetup& frame, const DrawList& list, bool veiled, bool shows_section = false);
    void draw_live_surface(const Program& program, const LiveSurface& surface, std::size_t index);
    std::vector<std::string> light_defines() const {
        return is_all_lit() ? std::vector<std::string>{"ALL_LIT"} : std::vector<std::string>();
    }
    bool is_all_lit() const { return !options.shadows && !options.ambient_occlusion; }
    void set_live_pictures(const Program& program, const LiveSurface& surface);
    void draw_live_colours(const FrameSetup& frame, const DrawList& list);
    void move_sections(const FrameSetup& frame, const DrawList& list);
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

inline void set_camera(const Program& program, const FrameSetup& frame) {
    program.set("view_from_world", floats(frame.view_from_world));
    program.set("clip_from_view", floats(frame.clip_from_view));
}

/// Returns the maximum distance of a neighbour from the plane for its visibility to be blended, m.
inline float plane_tolerance(const FrameSetup& frame) {
    return static_cast<float>(0.02 * frame.radius);
}

inline void set_clip(const Program& program, const FrameSetup& frame, const ClipPlane& clip) {
    program.set("origin", floats(frame.origin));
    const Eigen::Matrix4d& view = frame.view_from_world;
    program.set("eye", floats(Vec3(frame.origin -
                                   view.topLeftCorner<3, 3>().transpose() * view.topRightCorner<3, 1>())));
    const bool hides = clip.normal.norm() > 0;
    const Vec3 normal = hides ? Vec3(clip.normal.normalized()) : Vec3(Vec3::Zero());
    program.set(
        "clip_plane",
        std::array<float, 4>{static_cast<float>(normal.x()), static_cast<float>(normal.y()),
                             static_cast<float>(normal.z()), hides ? static_cast<float>(clip.offset) : 1.0F});
}

}  // namespace splitcubes::render
