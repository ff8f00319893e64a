// Live surfaces: colours, veils and wires.
#include <splitcubes/render/renderer_impl.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace splitcubes::render {

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
    program.set("field_range", floats(Vec2(style.field_low, style.field_high)));
    program.set("roughness", static_cast<float>(style.roughness));
    program.set("opacity", static_cast<float>(style.opacity));
    program.set("now_ms", static_cast<float>(style.now_ms));
    program.set("age_range_ms", static_cast<float>(style.age_range_ms));
    program.set("inside", style.inside);
    if (LiveLook(surface).looks == 2) set_live_pictures(program, surface);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * surface.impl_->triangles.size()), GL_UNSIGNED_INT,
                   nullptr);
}

// Back faces lie slightly behind, as those of meshes.
void Renderer::Impl::draw_live(const Program& program, const FrameSetup& frame, const DrawList& list,
                               bool veiled, const LiveLook* look) {
    set_camera(program, frame);
    set_clip(program, frame, list.clip);
    glEnable(GL_CLIP_DISTANCE0);
    for (std::size_t k = 0; k < list.surfaces.size(); ++k) {
        const LiveSurface& surface = *list.surfaces[k];
        const bool is_meant = look == nullptr || LiveLook(surface) == *look;
        if (is_meant && (surface.style.opacity < 1) == veiled) draw_live_surface(program, surface, k);
    }
    glDisable(GL_CLIP_DISTANCE0);
}

// By programs that do no more than the surfaces need.
void Renderer::Impl::shade_live(const FrameSetup& frame, const DrawList& list, bool veiled,
                                bool shows_section) {
    std::set<LiveLook> looks;
    for (const LiveSurface* surface : list.surfaces) looks.insert(LiveLook(*surface));
    for (const LiveLook& look : looks) {
        std::vector<std::string> defines = light_defines();
        defines.push_back("COLOURING " + std::to_string(static_cast<int>(look.colouring)));
        defines.emplace_back(look.looks > 0 ? "WITH_FINISHES" : "MATT");
        if (look.looks > 1) defines.emplace_back("WITH_PICTURES");
        if (shows_section && look.colouring == SurfaceColouring::material)
            defines.emplace_back("WITH_SECTION");
        const Program& program = programs.live.with(defines);
        program.use();
        set_lighting(program, frame);
        bind_finishes(program, list);
        draw_live(program, frame, list, veiled, &look);
    }
}

// Where back faces are seen, so that the ground under a body does not hide its section. Culling and the marks
// of back faces are those of draw_live_colours().
void Renderer::Impl::move_sections(const FrameSetup& frame, const DrawList& list) {
    programs.section.use();
    set_camera(programs.section, frame);
    set_clip(programs.section, frame, list.clip);
    glStencilFunc(GL_EQUAL, 1, 1);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    glDepthFunc(GL_ALWAYS);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glEnable(GL_CLIP_DISTANCE0);
    for (std::size_t k = 0; k < list.surfaces.size(); ++k) {
        const LiveStyle& style = list.surfaces[k]->style;
        if (style.inside >= 0 && !(style.opacity < 1) && style.colouring == SurfaceColouring::material)
            draw_live_surface(programs.section, *list.surfaces[k], k);
    }
    glDisable(GL_CLIP_DISTANCE0);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthFunc(GL_LESS);
    glDisable(GL_STENCIL_TEST);
}

void Renderer::Impl::draw_live_colours(const FrameSetup& frame, const DrawList& list) {
    if (list.surfaces.empty()) return;
    glEnable(GL_CULL_FACE);
    glEnable(GL_POLYGON_OFFSET_FILL);
    // Behind a clip plane back faces are not beside front faces, and the ground is close to them.
    const bool clips = list.clip.normal.norm() > 0;
    const float behind = clips ? 0.0F : 2.0F;
    for (const bool back : {false, true}) {
        if (back && !frame.shows_inside) continue;
        if (back && clips) {
            glClear(GL_STENCIL_BUFFER_BIT);
            glEnable(GL_STENCIL_TEST);
            glStencilFunc(GL_ALWAYS, 1, 1);
            glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
        }
        glCullFace(back ? GL_FRONT : GL_BACK);
        glPolygonOffset(back ? behind : 0.0F, back ? 4 * behind : 0.0F);
        shade_live(frame, list, false, back && clips);
        if (back && clips) move_sections(frame, list);
    }
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_CULL_FACE);
}

// Only the part of each surface that is nearest to the eye lies over the rest of the picture.
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
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    draw_live(programs.wire, frame, list);
    draw_live(programs.wire, frame, list, true);
    glDisable(GL_BLEND);
    glDisable(GL_POLYGON_OFFSET_LINE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

}  // namespace splitcubes::render
