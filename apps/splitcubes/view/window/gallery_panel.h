// The gallery: tiles with thumbnails, to choose what is opened.
#pragma once

#include <splitcubes/view/draw/thumbnails.h>
#include <splitcubes/view/viewer.h>

#include <optional>
#include <vector>

namespace splitcubes::view {

class GalleryPanel {
  public:
    /// makes: whether thumbnails that are not in the cache are made.
    GalleryPanel(const gl::Context& context, bool makes) : context_(context), makes_(makes) {}
    ~GalleryPanel();
    GalleryPanel(const GalleryPanel&) = delete;
    GalleryPanel& operator=(const GalleryPanel&) = delete;

    /// Within a frame of ImGui, over all of the picture. A choice comes back as an event.
    void draw(const Viewer& viewer, std::vector<ViewerInput>& out);
    /// Stops to make thumbnails.
    void close();
    /// Tells whether something is going to change without an event.
    bool is_busy() const { return thumbnails_ && !thumbnails_->is_complete(); }

  private:
    static void draw_opening(const Viewer& viewer);
    void tile(std::size_t item, std::vector<ViewerInput>& out);

    const gl::Context& context_;
    bool makes_;
    std::optional<Thumbnails> thumbnails_;
    std::vector<unsigned> textures_;  // an item; 0: none
};

/// Tells whether the gallery is what the window shows.
bool shows_gallery(const Viewer& viewer);

}  // namespace splitcubes::view
