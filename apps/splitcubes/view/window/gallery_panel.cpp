#include "gallery_panel.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include <imgui.h>

namespace splitcubes::view {

namespace {

unsigned texture_of(const render::Picture& picture) {
    GLuint out = 0;
    glGenTextures(1, &out);
    glBindTexture(GL_TEXTURE_2D, out);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, picture.width, picture.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 picture.rgb.data());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    return out;
}

}  // namespace

bool shows_gallery(const Viewer& viewer) {
    return viewer.display().gallery || !viewer.state() || viewer.state()->bodies.empty();
}

GalleryPanel::~GalleryPanel() {
    close();
}

void GalleryPanel::close() {
    for (const unsigned texture : textures_)
        if (texture != 0) glDeleteTextures(1, &texture);
    textures_.clear();
    thumbnails_.reset();
}

void GalleryPanel::tile(std::size_t item, std::vector<ViewerInput>& out) {
    const GalleryItem& shown = thumbnails_->items()[item];
    const float width = std::round(13 * ImGui::GetFontSize()),
                height = std::round(width * thumbnail_height / thumbnail_width);
    ImGui::PushID(static_cast<int>(item));
    ImGui::BeginGroup();
    bool is_chosen = false;
    if (textures_[item] != 0)
        is_chosen =
            ImGui::ImageButton(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(textures_[item])),
                               {width, height}, {0, 0}, {1, 1}, 3);
    else
        is_chosen = ImGui::Button(thumbnails_->is_complete() ? "no picture" : "being drawn ...",
                                  {width + 6, height + 6});
    ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width);
    ImGui::TextUnformatted(shown.title.c_str());
    ImGui::PopTextWrapPos();
    ImGui::EndGroup();
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", shown.file.string().c_str());
    if (is_chosen) out.push_back({.kind = InputKind::act, .name = "open", .text = shown.file.string()});
    ImGui::PopID();
}

void GalleryPanel::draw_opening(const Viewer& viewer) {
    ImGui::SetNextWindowPos(
        {0.5F * static_cast<float>(viewer.size().width), 0.5F * static_cast<float>(viewer.size().height)}, 0,
        {0.5F, 0.5F});
    ImGui::Begin("opening", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs);
    ImGui::Text("Opening %s ...", std::filesystem::path(viewer.opening()).filename().c_str());
    ImGui::End();
}

void GalleryPanel::draw(const Viewer& viewer, std::vector<ViewerInput>& out) {
    if (!viewer.opening().empty()) return draw_opening(viewer);
    if (!thumbnails_) {
        thumbnails_.emplace(context_, gallery_items(scenes_folder()), makes_);
        textures_.assign(thumbnails_->items().size(), 0);
    }
    thumbnails_->advance();
    for (std::size_t k = 0; k < textures_.size(); ++k)
        if (const render::Picture* picture = thumbnails_->picture(k); picture != nullptr && textures_[k] == 0)
            textures_[k] = texture_of(*picture);
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize(
        {static_cast<float>(viewer.size().width), static_cast<float>(viewer.size().height)});
    ImGui::Begin("gallery", nullptr,
                 ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::TextUnformatted(
        "What do you want to cut?  Click on a picture, or drop a scene, a mesh, a recording, a saved state "
        "or the folder of a run here.  F1: help.");
    const bool is_open = viewer.state() && !viewer.state()->bodies.empty();
    if (is_open && ImGui::Button("Back (G)"))
        out.push_back({.kind = InputKind::set, .name = "gallery", .value = 0});
    if (viewer.state() && !is_open && !viewer.state()->notice.empty())
        ImGui::TextColored({1, 0.65F, 0.4F, 1}, "%s", viewer.state()->notice.c_str());
    if (thumbnails_->items().empty())
        ImGui::TextDisabled("No scenes were found; set SPLITCUBES_SCENES to their folder.");
    ImGui::Separator();
    ImGui::BeginChild("tiles");
    const float step = std::round(13 * ImGui::GetFontSize()) + 20;
    const int columns = std::max(1, static_cast<int>(ImGui::GetContentRegionAvail().x / step));
    if (!thumbnails_->items().empty() && ImGui::BeginTable("items", columns)) {
        for (std::size_t k = 0; k < thumbnails_->items().size(); ++k) {
            ImGui::TableNextColumn();
            tile(k, out);
        }
        ImGui::EndTable();
    }
    ImGui::EndChild();
    ImGui::End();
}

}  // namespace splitcubes::view
