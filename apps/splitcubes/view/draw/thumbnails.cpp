#include "thumbnails.h"

#include <splitcubes/render/image.h>

#include <exception>
#include <filesystem>
#include <utility>

namespace splitcubes::view {

Thumbnails::Thumbnails(const gl::Context& context, std::vector<GalleryItem> items, bool makes)
    : context_(context), items_(std::move(items)), pictures_(items_.size()) {
    for (std::size_t k = 0; k < items_.size(); ++k) {
        const std::filesystem::path file = thumbnail_file(items_[k].file);
        std::error_code error;
        try {
            if (std::filesystem::is_regular_file(file, error)) pictures_[k] = render::read_png(file);
        } catch (const std::exception&) {
            pictures_[k].reset();  // a damaged one is made again
        }
        if (!pictures_[k]) missing_.push_back(k);
    }
    open_ = missing_.size();
    if (makes && open_ > 0) thread_ = std::thread([this] { simulate(); });
}

Thumbnails::~Thumbnails() {
    stops_ = true;
    if (thread_.joinable()) thread_.join();
}

void Thumbnails::simulate() {
    for (const std::size_t item : missing_) {
        State state = thumbnail_state(items_[item].file, [this] { return stops_.load(); });
        if (stops_) return;
        const std::lock_guard lock(mutex_);
        ready_.emplace_back(item, std::move(state));
    }
}

std::optional<std::size_t> Thumbnails::advance() {
    std::pair<std::size_t, State> next;
    {
        const std::lock_guard lock(mutex_);
        if (ready_.empty()) return std::nullopt;
        next = std::move(ready_.back());
        ready_.pop_back();
    }
    --open_;
    if (!next.second || next.second->bodies.empty()) return std::nullopt;
    renderer_.emplace(context_);  // buffers know states of one simulation only
    Viewer viewer;
    viewer.take({.kind = InputKind::resize, .x = thumbnail_width, .y = thumbnail_height});
    viewer.take({.kind = InputKind::set, .name = "forces", .value = 0});
    viewer.show(next.second);
    pictures_[next.first] = renderer_->picture(viewer, thumbnail_width, thumbnail_height);
    try {
        const std::filesystem::path file = thumbnail_file(items_[next.first].file);
        std::filesystem::create_directories(file.parent_path());
        render::write_png(file, *pictures_[next.first]);
    } catch (const std::exception&) {
        return next.first;  // it is drawn again in the next session
    }
    return next.first;
}

}  // namespace splitcubes::view
