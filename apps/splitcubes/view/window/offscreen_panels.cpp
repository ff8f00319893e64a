#include "gallery_panel.h"
#include "interface_style.h"
#include "panels.h"
#include "window.h"

#include <splitcubes/gl/objects.h>

#include <algorithm>
#include <array>

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

namespace splitcubes::view {

namespace {

class Offscreen : public OffscreenPanels {
  public:
    explicit Offscreen(const gl::Context& context) : gallery_(context, false) {
        IMGUI_CHECKVERSION();
        ImGui::CreateContext();
        set_interface_style(1);
        ImGui_ImplOpenGL3_Init("#version 330 core");
    }
    ~Offscreen() override {
        gallery_.close();
        ImGui_ImplOpenGL3_Shutdown();
        ImGui::DestroyContext();
    }

    void observe(const PublishedState& state) override {
        history_.add(state);
        last_step_ = std::max(last_step_, state.step);
    }

    render::Picture picture(const Viewer& viewer, StateRenderer& renderer) override {
        const int width = static_cast<int>(viewer.size().width),
                  height = static_cast<int>(viewer.size().height);
        gl::Renderbuffer colour(GL_RGBA8, width, height, 1);
        gl::Framebuffer target;
        target.attach(GL_COLOR_ATTACHMENT0, colour);
        target.check("the picture with panels");
        if (!shows_gallery(viewer)) {
            observe(*viewer.state());
            renderer.draw(viewer, width, height, target.id(), Quality::fine,
                          picture_area(viewer, width, height));
        }
        // The first frame finds out how large windows are.
        for (int k = 0; k < 3; ++k) layout(viewer, renderer);
        target.bind();
        glViewport(0, 0, width, height);
        if (!shows_gallery(viewer)) fill_behind_panels(viewer, width, height);
        ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
        return read(target, width, height);
    }

  private:
    void layout(const Viewer& viewer, StateRenderer& renderer) {
        ImGuiIO& io = ImGui::GetIO();
        io.DisplaySize = {static_cast<float>(viewer.size().width), static_cast<float>(viewer.size().height)};
        io.DeltaTime = 1.0F / 60;
        seconds_ += io.DeltaTime / 3;
        io.MousePos = {static_cast<float>(viewer.pointer().first),
                       static_cast<float>(viewer.pointer().second)};
        ImGui_ImplOpenGL3_NewFrame();
        ImGui::NewFrame();
        std::vector<ViewerInput> ignored;
        if (shows_gallery(viewer)) {
            gallery_.draw(viewer, ignored);
            panels_.draw_help(viewer);
        } else {
            panels_.draw(viewer,
                         {.history = history_,
                          .latencies = latencies_,
                          .legend = renderer.legend(),
                          .timeline = std::pair{std::int64_t{0}, std::max(last_step_, viewer.state()->step)},
                          .seconds = seconds_,
                          .labels = renderer.labels(),
                          .quality = "fine"},
                         ignored);
        }
        if (viewer.pointer().first > 0) draw_pointer(viewer);
        ImGui::Render();
    }
    // As a desktop would; a ring while a button is down.
    static void draw_pointer(const Viewer& viewer) {
        const auto x = static_cast<float>(viewer.pointer().first),
                   y = static_cast<float>(viewer.pointer().second);
        ImDrawList* list = ImGui::GetForegroundDrawList();
        if (viewer.is_button_down()) list->AddCircle({x, y}, 13, IM_COL32(20, 80, 200, 220), 24, 3);
        const std::array<ImVec2, 3> arrow = {ImVec2{x, y}, ImVec2{x, y + 17}, ImVec2{x + 12, y + 12}};
        list->AddTriangleFilled(arrow[0], arrow[1], arrow[2], IM_COL32(255, 255, 255, 255));
        list->AddTriangle(arrow[0], arrow[1], arrow[2], IM_COL32(20, 20, 20, 255), 1.5F);
    }
    static render::Picture read(const gl::Framebuffer& target, int width, int height) {
        render::Picture out{.width = width, .height = height, .rgb = {}};
        const auto row = 3 * static_cast<std::size_t>(width);
        std::vector<std::uint8_t> pixels(row * static_cast<std::size_t>(height));
        glBindFramebuffer(GL_READ_FRAMEBUFFER, target.id());
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
        glPixelStorei(GL_PACK_ALIGNMENT, 4);
        for (int y = height - 1; y >= 0; --y) {
            const auto first = pixels.begin() + static_cast<std::ptrdiff_t>(row) * y;
            out.rgb.insert(out.rgb.end(), first, first + static_cast<std::ptrdiff_t>(row));
        }
        return out;
    }

    Panels panels_;
    GalleryPanel gallery_;
    std::int64_t last_step_ = 0;
    double seconds_ = 0;  // of pictures, at 60 a second
    StepHistory history_;
    Latencies latencies_;
};

}  // namespace

std::unique_ptr<OffscreenPanels> make_offscreen_panels(const gl::Context& context) {
    return std::make_unique<Offscreen>(context);
}

}  // namespace splitcubes::view
