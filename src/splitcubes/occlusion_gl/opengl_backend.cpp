#include <splitcubes/core/error.h>
#include <splitcubes/gl/objects.h>
#include <splitcubes/gl/program.h>
#include <splitcubes/occlusion_gl/opengl_backend.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>

namespace splitcubes::occlusion {

namespace {

// Stencil bits of a texel.
constexpr GLuint not_a_sample = 1, outside = 2, obscured = 4;

using Corner = std::array<float, 3>;  // local coordinates, disk radii

// A pair that must be drawn.
struct Tile {
    std::size_t pair;             // index into the queries
    std::vector<Corner> corners;  // boundary triangles first
    GLsizei boundary_count = 0;   // corners
    GLint first = 0;              // first corner in the batch's buffer
    int x = 0, y = 0;             // lowest texel in the atlas
};

Tile make_tile(const geometry::OccluderGrid& occluders, const PairQuery& pair, std::size_t pair_index) {
    Tile tile{pair_index, {}};
    if (coincide(pair)) return tile;
    const Disk disk = make_disk(pair);
    std::vector<Corner> cuts;
    occluders.visit(double_cone_bounds(pair), [&](const geometry::OccluderTriangle& triangle) {
        std::vector<Corner>& out = triangle.boundary ? tile.corners : cuts;
        for (const Vec3& corner : triangle.corner) {
            const Vec3 p = disk.local(corner);
            out.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
        }
    });
    tile.boundary_count = static_cast<GLsizei>(tile.corners.size());
    tile.corners.insert(tile.corners.end(), cuts.begin(), cuts.end());
    return tile;
}

class Queries {
  public:
    explicit Queries(std::size_t count) : ids_(count) {
        glGenQueries(static_cast<GLsizei>(count), ids_.data());
    }
    ~Queries() { glDeleteQueries(static_cast<GLsizei>(ids_.size()), ids_.data()); }
    Queries(const Queries&) = delete;
    Queries& operator=(const Queries&) = delete;

    void begin(std::size_t k) const { glBeginQuery(GL_SAMPLES_PASSED, ids_[k]); }
    static void end() { glEndQuery(GL_SAMPLES_PASSED); }
    // Waits for the result. Clamps values that do not fit an int; they are no valid counts either.
    int result(std::size_t k) const {
        GLuint count = 0;
        glGetQueryObjectuiv(ids_[k], GL_QUERY_RESULT, &count);
        return static_cast<int>(std::min<GLuint>(count, 1U << 30));
    }

  private:
    std::vector<GLuint> ids_;
};

// OpenGL objects that are made once per context.
struct Device {
    gl::Program triangles = gl::Program::from_files("disk.vert", "disk.frag");
    gl::Program rim = gl::Program::from_files("screen.vert", "disk_rim.frag");
    gl::Program all = gl::Program::from_files("screen.vert", "disk.frag");
    gl::Renderbuffer stencil;
    gl::Framebuffer framebuffer;
    gl::VertexArray layout, nothing;
    gl::Buffer corners;
    Queries queries;

    Device(int atlas_size, std::size_t tile_count)
        : stencil(GL_DEPTH24_STENCIL8, atlas_size, atlas_size, 0), queries(2 * tile_count) {
        framebuffer.attach(GL_DEPTH_STENCIL_ATTACHMENT, stencil);
        glDrawBuffer(GL_NONE);
        glReadBuffer(GL_NONE);
        framebuffer.check("occlusion disks");
        layout.bind();
        glBindBuffer(GL_ARRAY_BUFFER, corners.id());
        glEnableVertexAttribArray(0);
        glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), nullptr);
        gl::check_errors("the set-up of occlusion disks");
    }
};

}  // namespace

bool are_counts_possible(const DiskCounts& counts, const DiskRaster& raster) {
    return 0 <= counts.visible && counts.visible <= counts.inside && counts.inside <= raster.sample_count;
}

struct OpenGlBackend::Impl {
    std::shared_ptr<const gl::HeadlessContext> context;
    VisibilityOptions options;
    OpenGlOptions drawing;
    DiskRaster raster;
    OpenGlStatistics statistics;
    std::optional<Device> device;

    Impl(std::shared_ptr<const gl::HeadlessContext> in, const VisibilityOptions& visibility,
         const OpenGlOptions& draw_options)
        : context(std::move(in)), options(visibility), drawing(draw_options), raster(visibility.disk_size) {
        check_options(options);
        if (drawing.atlas_size < 32 || drawing.atlas_size > 512 || drawing.atlas_size % 32 != 0)
            throw InputError("occlusion atlas size", "must be a multiple of 32 in 32 .. 512, got " +
                                                         std::to_string(drawing.atlas_size));
        context->make_current();
        device.emplace(drawing.atlas_size, tiles_per_batch());
    }

    int tiles_a_row() const { return drawing.atlas_size / raster.size; }
    std::size_t tiles_per_batch() const { return static_cast<std::size_t>(tiles_a_row() * tiles_a_row()); }

    void lay_out(std::span<Tile> tiles) const;
    void enter(const Tile& tile) const;
    void draw(std::span<const Tile> tiles) const;
    std::vector<std::uint8_t> texels() const;
    DiskMasks masks_of(const Tile& tile, std::span<const std::uint8_t> texels) const;
    DiskCounts counts_of(const Tile& tile, std::span<const std::uint8_t> texels) const {
        return count_samples(masks_of(tile, texels), raster);
    }
    std::vector<DiskCounts> count(std::span<const Tile> tiles);
    template <class Use>
    void for_batches(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                     const Parallel& parallel, const Use& use);
};

// Assigns atlas texels to the tiles and uploads their triangles.
void OpenGlBackend::Impl::lay_out(std::span<Tile> tiles) const {
    std::vector<Corner> corners;
    for (std::size_t k = 0; k < tiles.size(); ++k) {
        tiles[k].x = static_cast<int>(k) % tiles_a_row() * raster.size;
        tiles[k].y = static_cast<int>(k) / tiles_a_row() * raster.size;
        tiles[k].first = static_cast<GLint>(corners.size());
        corners.insert(corners.end(), tiles[k].corners.begin(), tiles[k].corners.end());
    }
    glBindBuffer(GL_ARRAY_BUFFER, device->corners.id());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(Corner)), corners.data(),
                 GL_STREAM_DRAW);
}

void OpenGlBackend::Impl::enter(const Tile& tile) const {
    glViewport(tile.x, tile.y, raster.size, raster.size);
    glScissor(tile.x, tile.y, raster.size, raster.size);
}

void OpenGlBackend::Impl::draw(std::span<const Tile> tiles) const {
    const bool uses_queries = !drawing.count_texels;
    device->framebuffer.bind();
    for (const GLenum off : {GL_DEPTH_TEST, GL_CULL_FACE, GL_BLEND, GL_MULTISAMPLE, GL_SCISSOR_TEST})
        glDisable(off);
    glEnable(GL_STENCIL_TEST);
    glStencilMask(0xff);
    glClearStencil(0);
    glClear(GL_STENCIL_BUFFER_BIT);
    glViewport(0, 0, drawing.atlas_size, drawing.atlas_size);

    device->nothing.bind();
    device->rim.use();
    device->rim.set("tile_size", static_cast<float>(raster.size));
    glStencilFunc(GL_ALWAYS, not_a_sample, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glDrawArrays(GL_TRIANGLES, 0, 3);

    device->layout.bind();
    device->triangles.use();
    const double range = far_depth - near_depth;
    const std::array<float, 2> depth_map{static_cast<float>((far_depth + near_depth) / range),
                                         static_cast<float>(-2 * far_depth * near_depth / range)};
    device->triangles.set("depth_map", depth_map);
    glEnable(GL_SCISSOR_TEST);
    glStencilOp(GL_KEEP, GL_KEEP, GL_INVERT);
    glStencilMask(outside);
    for (const Tile& tile : tiles) {
        if (tile.boundary_count == 0) continue;
        enter(tile);
        glDrawArrays(GL_TRIANGLES, tile.first, tile.boundary_count);
    }
    if (uses_queries) {
        device->nothing.bind();
        device->all.use();
        glStencilMask(0);
        glStencilFunc(GL_EQUAL, 0, not_a_sample | outside);
        for (std::size_t k = 0; k < tiles.size(); ++k) {
            if (tiles[k].boundary_count == 0) continue;
            enter(tiles[k]);
            device->queries.begin(2 * k);
            glDrawArrays(GL_TRIANGLES, 0, 3);
            Queries::end();
            if (k % 64 == 63) glFlush();
        }
        device->layout.bind();
        device->triangles.use();
    }
    // An inverted texel no longer passes, so it is counted once.
    glStencilFunc(GL_EQUAL, 0, not_a_sample | outside | obscured);
    glStencilMask(obscured);
    for (std::size_t k = 0; k < tiles.size(); ++k) {
        enter(tiles[k]);
        if (uses_queries) device->queries.begin(2 * k + 1);
        glDrawArraysInstanced(GL_TRIANGLES, tiles[k].first, static_cast<GLsizei>(tiles[k].corners.size()), 2);
        if (uses_queries) Queries::end();
        if (k % 64 == 63) glFlush();
    }
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_SCISSOR_TEST);
    glStencilMask(0xff);
    gl::check_errors("the drawing of occlusion disks");
}

// Returns the atlas, row by row from the lowest.
std::vector<std::uint8_t> OpenGlBackend::Impl::texels() const {
    const auto side = static_cast<std::size_t>(drawing.atlas_size);
    std::vector<std::uint8_t> out(side * side);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, drawing.atlas_size, drawing.atlas_size, GL_STENCIL_INDEX, GL_UNSIGNED_BYTE,
                 out.data());
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    gl::check_errors("the reading of occlusion disks");
    return out;
}

DiskMasks OpenGlBackend::Impl::masks_of(const Tile& tile, std::span<const std::uint8_t> texels) const {
    DiskMasks masks;
    for (int row = 0; row < raster.size; ++row)
        for (int column = 0; column < raster.size; ++column) {
            const auto at = static_cast<std::size_t>((tile.y + row) * drawing.atlas_size + tile.x + column);
            const auto bit = static_cast<std::size_t>(row * raster.size + column);
            const std::uint64_t flag = std::uint64_t{1} << (bit % 64);
            if ((texels[at] & outside) != 0) masks.outside[bit / 64] |= flag;
            if ((texels[at] & obscured) != 0) masks.obscured[bit / 64] |= flag;
        }
    return masks;
}

// Returns the counts of the tiles drawn last.
std::vector<DiskCounts> OpenGlBackend::Impl::count(std::span<const Tile> tiles) {
    std::vector<DiskCounts> out(tiles.size());
    bool doubtful = drawing.count_texels;
    if (!drawing.count_texels)
        for (std::size_t k = 0; k < tiles.size(); ++k) {
            const bool has_boundary = tiles[k].boundary_count > 0;
            out[k].inside = has_boundary ? device->queries.result(2 * k) : raster.sample_count;
            out[k].visible = out[k].inside - device->queries.result(2 * k + 1);
            statistics.queries += has_boundary ? 2 : 1;
            if (are_counts_possible(out[k], raster)) continue;
            ++statistics.wrong_counts;
            doubtful = true;
        }
    statistics.disks += tiles.size();
    if (!doubtful && !drawing.check_queries) return out;
    if (doubtful && !drawing.count_texels) ++statistics.counted_again;
    const std::vector<std::uint8_t> atlas = texels();
    for (std::size_t k = 0; k < tiles.size(); ++k) {
        const DiskCounts counts = counts_of(tiles[k], atlas);
        if (!drawing.count_texels && are_counts_possible(out[k], raster) &&
            (counts.inside != out[k].inside || counts.visible != out[k].visible))
            ++statistics.wrong_counts;
        out[k] = counts;
    }
    return out;
}

// Draws the pairs that have triangles nearby, a batch at a time, and calls use(tiles) after each batch.
template <class Use>
void OpenGlBackend::Impl::for_batches(const geometry::OccluderGrid& occluders,
                                      std::span<const PairQuery> pairs, const Parallel& parallel,
                                      const Use& use) {
    context->make_current();
    const std::size_t batch = tiles_per_batch();
    for (std::size_t begin = 0; begin < pairs.size(); begin += batch) {
        std::vector<Tile> tiles(std::min(batch, pairs.size() - begin));
        parallel.for_each(tiles.size(), 16, [&](std::size_t k) {
            tiles[k] = make_tile(occluders, pairs[begin + k], begin + k);
        });
        std::erase_if(tiles, [](const Tile& tile) { return tile.corners.empty(); });
        if (tiles.empty()) continue;
        lay_out(tiles);
        draw(tiles);
        use(tiles);
    }
}

OpenGlBackend::OpenGlBackend(std::shared_ptr<const gl::HeadlessContext> context,
                             const VisibilityOptions& options, const OpenGlOptions& drawing)
    : impl_(std::make_unique<Impl>(std::move(context), options, drawing)) {}

OpenGlBackend::~OpenGlBackend() {
    // The objects must be deleted in their context; a lost context has already freed them.
    try {
        impl_->context->make_current();
    } catch (const JobError&) {
    }
}

void OpenGlBackend::evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                             std::span<float> visibility, const Parallel& parallel) {
    assert(visibility.size() == pairs.size());
    std::fill(visibility.begin(), visibility.end(), 1.0F);
    impl_->for_batches(occluders, pairs, parallel, [&](std::span<const Tile> tiles) {
        const std::vector<DiskCounts> counts = impl_->count(tiles);
        for (std::size_t k = 0; k < tiles.size(); ++k)
            visibility[tiles[k].pair] =
                visibility_of(counts[k], occluders, pairs[tiles[k].pair], impl_->options);
    });
}

std::vector<DiskMasks> OpenGlBackend::masks(const geometry::OccluderGrid& occluders,
                                            std::span<const PairQuery> pairs, const Parallel& parallel) {
    std::vector<DiskMasks> out(pairs.size());
    impl_->for_batches(occluders, pairs, parallel, [&](std::span<const Tile> tiles) {
        const std::vector<std::uint8_t> atlas = impl_->texels();
        for (const Tile& tile : tiles) out[tile.pair] = impl_->masks_of(tile, atlas);
    });
    return out;
}

const OpenGlStatistics& OpenGlBackend::statistics() const {
    return impl_->statistics;
}

}  // namespace splitcubes::occlusion
