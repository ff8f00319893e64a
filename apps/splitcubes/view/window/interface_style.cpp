#include "interface_style.h"

#include <filesystem>

#include <imgui.h>

namespace splitcubes::view {

void set_interface_style(float scale) {
    constexpr float font_size = 14;
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    const char* font = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
    std::error_code ignored;
    if (std::filesystem::is_regular_file(font, ignored))
        io.Fonts->AddFontFromFileTTF(font, font_size * scale);
    else
        io.FontGlobalScale = scale;
    ImGui::StyleColorsDark();
    ImGuiStyle& style = ImGui::GetStyle();
    style.WindowRounding = 0;
    style.FrameRounding = 3;
    style.GrabRounding = 3;
    style.WindowBorderSize = 0;
    style.ItemSpacing = {6, 4};
    style.Colors[ImGuiCol_WindowBg] = {0.11F, 0.12F, 0.14F, 1};
    style.Colors[ImGuiCol_Button] = {0.24F, 0.27F, 0.32F, 1};
    style.Colors[ImGuiCol_ButtonHovered] = {0.30F, 0.38F, 0.50F, 1};
    style.Colors[ImGuiCol_ButtonActive] = {0.18F, 0.45F, 0.78F, 1};
    style.Colors[ImGuiCol_FrameBg] = {0.20F, 0.22F, 0.26F, 1};
    style.Colors[ImGuiCol_SliderGrab] = {0.35F, 0.60F, 0.95F, 0.55F};
    style.Colors[ImGuiCol_SliderGrabActive] = {0.45F, 0.70F, 1, 0.75F};
    style.Colors[ImGuiCol_TextDisabled] = {0.62F, 0.65F, 0.70F, 1};
    style.ScaleAllSizes(scale);
}

}  // namespace splitcubes::view
