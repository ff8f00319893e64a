#include "interface_style.h"
#include "panels.h"
#include "window.h"

#include <splitcubes/gl/objects.h>

#include <algorithm>

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

namespace splitcubes::view {

namespace {

class Offscreen : public OffscreenPanels {
  public:
    Offscreen() {
        IMGUI_CHECKVERSION();
        ImGui::CreateContext();
        set_interface_style(1);
        ImGui_ImplOpenGL3_Init("#version 330 core");
    }
    ~Offscreen() override {
        ImGui_ImplOpenGL3_Shutdown();
        ImGui::DestroyContext();
    }

    void observe(const PublishedState& state) override { history_.add(state); }

    render::Picture picture(const Viewer& viewer, StateRenderer& renderer) override {
        const int width = static_cast<int>(viewer.size().width),
                  height = static_cast<int>(viewer.size().height);
        gl::Renderbuffer colour(GL_RGBA8, width, height, 1);
        gl::Framebuffer target;
        target.attach(GL_COLOR_ATTACHMENT0, colour);
        target.check("the picture with panels");
        observe(*viewer.state());
        renderer.draw(viewer, width, height, target.id());
        // The first frame finds out how large windows are.
        for (int k = 0; k < 3; ++k) layout(viewer, renderer);
        target.bind();
        glViewport(0, 0, width, height);
        ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
        return read(target, width, height);
    }

  private:
    void layout(const Viewer& viewer, StateRenderer& renderer) {
        ImGuiIO& io = ImGui::GetIO();
        io.DisplaySize = {static_cast<float>(viewer.size().width), static_cast<float>(viewer.size().height)};
        io.DeltaTime = 1.0F / 60;
        ImGui_ImplOpenGL3_NewFrame();
        ImGui::NewFrame();
        std::vector<ViewerInput> ignored;
        panels_.draw(viewer,
                     {.history = history_,
                      .latencies = latencies_,
                      .legend = renderer.legend(),
                      .timeline = std::pair{std::int64_t{0}, viewer.state()->step}},
                     ignored);
        ImGui::Render();
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
    StepHistory history_;
    Latencies latencies_;
};

}  // namespace

std::unique_ptr<OffscreenPanels> make_offscreen_panels() {
    return std::make_unique<Offscreen>();
}

}  // namespace splitcubes::view
