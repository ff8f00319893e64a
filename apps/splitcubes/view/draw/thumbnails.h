// Small pictures of what can be opened, drawn once and kept in the cache.
#pragma once

#include "state_renderer.h"

#include <splitcubes/view/gallery.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace splitcubes::view {

inline constexpr int thumbnail_width = 240, thumbnail_height = 150;  // pixels

/// Simulates in a thread of its own, draws in the caller's. Reads what is in the cache at once.
class Thumbnails {
  public:
    /// context: must outlive it. makes: whether those that are not in the cache are made.
    Thumbnails(const gl::Context& context, std::vector<GalleryItem> items, bool makes);
    ~Thumbnails();
    Thumbnails(const Thumbnails&) = delete;
    Thumbnails& operator=(const Thumbnails&) = delete;

    const std::vector<GalleryItem>& items() const { return items_; }
    /// Null while there is none.
    const render::Picture* picture(std::size_t item) const {
        return pictures_[item] ? &*pictures_[item] : nullptr;
    }
    /// Draws one whose state has come. Returns its index.
    std::optional<std::size_t> advance();
    bool is_complete() const { return open_ == 0; }

  private:
    void simulate();

    const gl::Context& context_;
    std::vector<GalleryItem> items_;
    std::vector<std::optional<render::Picture>> pictures_;
    std::vector<std::size_t> missing_;
    std::size_t open_ = 0;  // of those missing
    std::optional<StateRenderer> renderer_;
    std::mutex mutex_;  // of the next member
    std::vector<std::pair<std::size_t, State>> ready_;
    std::atomic<bool> stops_{false};
    std::thread thread_;
};

}  // namespace splitcubes::view
