#include <splitcubes/render/live_buffers.h>
#include <splitcubes/render/live_surface.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::render {

void SlotBuffer::reserve(std::size_t slots) {
    if (slots <= capacity_) return;
    const std::size_t capacity = std::max(slots, capacity_ + capacity_ / 2);
    gl::Buffer larger;
    glBindBuffer(GL_COPY_WRITE_BUFFER, larger.id());
    glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(capacity * bytes_each_), nullptr,
                 GL_DYNAMIC_DRAW);
    if (size_ > 0) {
        glBindBuffer(GL_COPY_READ_BUFFER, buffer_.id());
        glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0,
                            static_cast<GLsizeiptr>(size_ * bytes_each_));
    }
    buffer_ = std::move(larger);
    capacity_ = capacity;
}

void SlotBuffer::write(const void* array, std::size_t size, const SlotRange& range) {
    reserve(size);
    size_ = size;
    const std::size_t first = std::min(range.first, size), count = std::min(range.count, size - first);
    if (count == 0) return;
    glBindBuffer(target_, buffer_.id());
    glBufferSubData(target_, static_cast<GLintptr>(first * bytes_each_),
                    static_cast<GLsizeiptr>(count * bytes_each_),
                    static_cast<const char*>(array) + first * bytes_each_);
    bytes_copied_ += count * bytes_each_;
}

LiveSurface::Impl::Impl() {
    glGenTextures(1, &material_texture);
    glGenTextures(static_cast<GLsizei>(corner_textures.size()), corner_textures.data());
}

LiveSurface::Impl::~Impl() {
    glDeleteTextures(1, &material_texture);
    glDeleteTextures(static_cast<GLsizei>(corner_textures.size()), corner_textures.data());
}

// Buffers change their names when they grow.
void LiveSurface::Impl::bind() const {
    array.bind();
    const auto attribute = [](GLuint index, const SlotBuffer& buffer, GLint components) {
        glBindBuffer(GL_ARRAY_BUFFER, buffer.id());
        glEnableVertexAttribArray(index);
        glVertexAttribPointer(index, components, GL_FLOAT, GL_FALSE, 0, nullptr);
    };
    attribute(0, positions, 3);
    attribute(1, normals, 3);
    attribute(2, field, 1);
    attribute(4, rest, 4);
    attribute(5, marks, 1);
    glBindBuffer(GL_ARRAY_BUFFER, pieces.id());
    glEnableVertexAttribArray(3);
    glVertexAttribIPointer(3, 1, GL_INT, 0, nullptr);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, triangles.id());
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_BUFFER, material_texture);
    glTexBuffer(GL_TEXTURE_BUFFER, GL_R32I, materials.id());
}

// A texture without a buffer would be of another kind than the shader's.
void LiveSurface::Impl::bind_corners(GLuint first_unit) const {
    const auto texture = [&](GLuint k, GLenum format, const SlotBuffer& buffer) {
        glActiveTexture(GL_TEXTURE0 + first_unit + k);
        glBindTexture(GL_TEXTURE_BUFFER, corner_textures[k]);
        glTexBuffer(GL_TEXTURE_BUFFER, format, buffer.size() > 0 ? buffer.id() : positions.id());
    };
    texture(0, GL_RG32F, corner_uv);
    texture(1, GL_R32UI, triangles);
    texture(2, GL_R32F, positions);
}

LiveSurface::LiveSurface() : impl_(std::make_unique<Impl>()) {}
LiveSurface::~LiveSurface() = default;
LiveSurface::LiveSurface(LiveSurface&&) noexcept = default;
LiveSurface& LiveSurface::operator=(LiveSurface&&) noexcept = default;

void LiveSurface::set_topology(const SurfaceSlots& slots) {
    const SlotRange triangles{0, slots.triangles.size() / 3}, vertices{0, slots.pieces.size()};
    patch_topology(slots, {&triangles, 1}, {&vertices, 1});
}

void LiveSurface::patch_topology(const SurfaceSlots& slots, std::span<const SlotRange> triangles,
                                 std::span<const SlotRange> vertices) {
    const std::size_t triangle_count = slots.triangles.size() / 3;
    const auto each = [](SlotBuffer& buffer, const void* array, std::size_t size,
                         std::span<const SlotRange> ranges) {
        const std::size_t before = buffer.size();
        for (const SlotRange& range : ranges) buffer.write(array, size, range);
        if (size > before) buffer.write(array, size, {before, size - before});
        if (size < before) buffer.write(array, size, {0, 0});
    };
    each(impl_->triangles, slots.triangles.data(), triangle_count, triangles);
    each(impl_->materials, slots.materials.data(), triangle_count, triangles);
    if (slots.corner_uv.size() == 6 * triangle_count)
        each(impl_->corner_uv, slots.corner_uv.data(), triangle_count, triangles);
    each(impl_->pieces, slots.pieces.data(), slots.pieces.size(), vertices);
    const std::size_t count = slots.pieces.size();
    if (slots.rest.size() == 4 * count) {
        each(impl_->rest, slots.rest.data(), count, vertices);
    } else if (impl_->rest.size() != count) {
        impl_->rest.write(std::vector<float>(4 * count, 0.0F).data(), count, {0, count});
    }
    if (impl_->marks.size() != count) set_marks(std::vector<float>(count, 0.0F));
    impl_->piece_of_vertex.assign(slots.pieces.begin(), slots.pieces.end());
}

void LiveSurface::set_marks(std::span<const float> marks) {
    impl_->marks.write(marks.data(), marks.size(), {0, marks.size()});
}

void LiveSurface::set_vertices(std::span<const float> positions, std::span<const float> normals,
                               std::span<const float> field) {
    const std::size_t count = positions.size() / 3;
    impl_->positions.write(positions.data(), count, {0, count});
    impl_->normals.write(normals.data(), count, {0, count});
    const std::vector<float> none(field.empty() ? count : 0, 0.0F);
    impl_->field.write(field.empty() ? none.data() : field.data(), count, {0, count});
    Eigen::AlignedBox3f box;
    for (std::size_t v = 0; v < std::min(count, impl_->piece_of_vertex.size()); ++v)
        if (impl_->piece_of_vertex[v] >= 0) box.extend(Eigen::Map<const Vec3f>(positions.data() + 3 * v));
    impl_->bounds = {};
    if (!box.isEmpty()) impl_->bounds = {box.min().cast<double>(), box.max().cast<double>()};
}

const geometry::Box& LiveSurface::bounds() const {
    return impl_->bounds;
}

int LiveSurface::looks() const {
    const auto is_there = [](const auto& one) { return one != nullptr; };
    if (impl_->corner_uv.size() > 0 && std::any_of(style.pictures.begin(), style.pictures.end(), is_there))
        return 2;
    return std::any_of(style.finishes.begin(), style.finishes.end(), is_there) ? 1 : 0;
}

std::size_t LiveSurface::bytes_copied() const {
    return impl_->positions.bytes_copied() + impl_->normals.bytes_copied() + impl_->field.bytes_copied() +
           impl_->pieces.bytes_copied() + impl_->triangles.bytes_copied() + impl_->materials.bytes_copied() +
           impl_->rest.bytes_copied() + impl_->marks.bytes_copied() + impl_->corner_uv.bytes_copied();
}

// As colour_scale() of live.frag.
Vec3 scale_colour(double share) {
    const double t = std::clamp(share, 0.0, 1.0);
    const std::array<Vec3, 5> stops = {Vec3(0.19, 0.29, 0.64), Vec3(0.13, 0.63, 0.71), Vec3(0.45, 0.78, 0.38),
                                       Vec3(0.96, 0.82, 0.25), Vec3(0.80, 0.15, 0.15)};
    const double at = 4 * t;
    const auto k = static_cast<std::size_t>(std::min(3.0, std::floor(at)));
    return stops[k] + (at - static_cast<double>(k)) * (stops[k + 1] - stops[k]);
}

// As piece_colour() of live.frag: hues apart by the golden ratio.
Vec3 piece_colour(std::int32_t piece) {
    const double hue = 6 * (0.05 + 0.61803399 * piece - std::floor(0.05 + 0.61803399 * piece));
    Vec3 out;
    const Vec3 shift(0, 4, 2);
    for (int k = 0; k < 3; ++k) {
        const double offset = std::fmod(hue + shift[k], 6.0);
        const double wave = std::clamp(std::abs(offset - 3) - 1, 0.0, 1.0);
        out[k] = 0.85 - 0.55 * (1 - wave);
    }
    return out;
}

}  // namespace splitcubes::render
