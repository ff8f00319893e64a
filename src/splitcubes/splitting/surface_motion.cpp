// Motion of the surface's vertices with its nodes.
#include <splitcubes/core/prefetch.h>
#include <splitcubes/geometry/affine_sums.h>
#include <splitcubes/splitting/surface.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <cassert>

namespace splitcubes::splitting {

using geometry::AffineDisplacement;

namespace {

constexpr std::size_t block_size = 128;  // vertices that are summed together

static_assert(block_size % geometry::transform_width == 0);

// Vertices with the weighted mean motion of their nodes.
class VertexBlock {
  public:
    // count: at most block_size.
    void gather(const Surface& surface, const RestGrid& rest, std::size_t first, std::size_t count,
                std::span<const AffineDisplacement> motion) {
        count_ = count;
        std::uint32_t next = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const SurfaceVertex& vertex = surface.vertices()[first + i];
            prefetch_ahead(surface, first + i);
            for (std::size_t k = 0; k < 3; ++k) {
                point_[k][i] = vertex.rest[static_cast<Eigen::Index>(k)];
                normal_[k][i] = static_cast<double>(vertex.normal[static_cast<Eigen::Index>(k)]);
            }
            rows_[i].begin = next;
            double total = 1;
            if (vertex.alive())
                total = surface.visit_influences(rest, vertex, [&](std::uint32_t node, double weight) {
                    prefetch(motion[node].entries());
                    prefetch(motion[node].entries() + AffineDisplacement::entry_count - 1);
                    node_[next] = node;
                    weight_[next++] = weight;
                });
            factor_[i] = 1 / total;
            rows_[i].count = next - rows_[i].begin;
        }
        geometry::sum_affine(std::span(rows_).first(count_), node_.data(), weight_.data(), motion.data(),
                             sum_.data());
    }
    void transform(Vec3* positions, Vec3* normals) const {
        geometry::transform_points(count_, sum_.data(),
                                   {{point_[0].data(), point_[1].data(), point_[2].data()},
                                    {normal_[0].data(), normal_[1].data(), normal_[2].data()},
                                    factor_.data()},
                                   positions, normals);
        // Unused vertices stay at rest.
        for (std::size_t i = 0; i < count_; ++i)
            if (rows_[i].count == 0) {
                positions[i] = Vec3(point_[0][i], point_[1][i], point_[2][i]);
                normals[i] = Vec3(normal_[0][i], normal_[1][i], normal_[2][i]);
            }
    }

  private:
    // Vertices are read in sequence, but the cell of each is an indirect access.
    static void prefetch_ahead(const Surface& surface, std::size_t i) {
        const std::span<const SurfaceVertex> vertices = surface.vertices();
        prefetch(vertices.data() + std::min(i + tuning::surface::vertices_ahead, vertices.size() - 1));
        const SurfaceVertex& later =
            vertices[std::min(i + tuning::surface::cells_ahead, vertices.size() - 1)];
        const SurfaceCell& cell = surface.cells()[later.cell];
        prefetch(&cell.lowest_node);
        prefetch(&cell.node.back());
    }

    using Numbers = std::array<double, block_size>;
    std::size_t count_ = 0;
    std::array<Numbers, 3> point_{}, normal_{};  // rest space, m
    Numbers factor_{};                           // makes the weights sum to one
    std::array<geometry::AffineRow, block_size> rows_;
    std::array<std::uint32_t, 8 * block_size> node_;
    std::array<double, 8 * block_size> weight_;
    std::array<AffineDisplacement, block_size> sum_;
};

}  // namespace

void deform(const Surface& surface, const RestGrid& rest, std::span<const AffineDisplacement> motion,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel) {
    const std::vector<SurfaceVertex>& vertices = surface.vertices();
    assert(motion.size() == surface.nodes().size());
    // Reserves memory for further cuts, so that no single step has to copy everything.
    for (std::vector<Vec3>* out : {&positions, &normals}) {
        if (out->capacity() < vertices.size()) out->reserve(vertices.size() + vertices.size() / 2);
        out->resize(vertices.size());
    }
    parallel.for_chunks(vertices.size(), 4 * block_size, [&](std::size_t begin, std::size_t end) {
        VertexBlock block;
        for (std::size_t first = begin; first < end; first += block_size) {
            block.gather(surface, rest, first, std::min(block_size, end - first), motion);
            block.transform(positions.data() + first, normals.data() + first);
        }
    });
}

void deform(const Surface& surface, const RestGrid& rest, std::span<const geometry::Frame> frames,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel) {
    assert(frames.size() == surface.nodes().size());
    std::vector<AffineDisplacement> motion(frames.size());
    parallel.for_each(frames.size(), 512, [&](std::size_t n) {
        motion[n] = AffineDisplacement(rest.node_position(surface.nodes()[n]), frames[n]);
    });
    deform(surface, rest, motion, positions, normals, parallel);
}

}  // namespace splitcubes::splitting
