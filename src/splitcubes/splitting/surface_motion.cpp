// The surface's vertices go where its nodes carry them.
#include <splitcubes/geometry/affine_sums.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cassert>

namespace splitcubes::splitting {

using geometry::AffineDisplacement;

namespace {

constexpr std::size_t block_size = 128;  // vertices whose sums are taken together

// Columns are cross products of the other two columns.
Mat3 cofactor_of(const Mat3& matrix) {
    Mat3 out;
    for (int k = 0; k < 3; ++k) out.col(k) = matrix.col((k + 1) % 3).cross(matrix.col((k + 2) % 3));
    return out;
}

// The mean motion of the nodes that carry each of some vertices.
class MeanMotions {
  public:
    // vertices: at most block_size. None is where a vertex is out of use.
    void take(const Surface& surface, const RestGrid& rest, std::span<const SurfaceVertex> vertices,
              std::span<const AffineDisplacement> motion) {
        std::uint32_t next = 0;
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            rows_[i].begin = next;
            if (vertices[i].alive())
                total_[i] = surface.visit_carriers(rest, vertices[i], [&](std::uint32_t node, double weight) {
                    node_[next] = node;
                    weight_[next++] = weight;
                });
            rows_[i].count = next - rows_[i].begin;
        }
        geometry::sum_affine(std::span(rows_).first(vertices.size()), node_.data(), weight_.data(),
                             motion.data(), sum_.data());
        for (std::size_t i = 0; i < vertices.size(); ++i)
            if (rows_[i].count > 0) sum_[i].scale(1 / total_[i]);
    }
    const AffineDisplacement& operator[](std::size_t i) const { return sum_[i]; }

  private:
    std::array<geometry::AffineRow, block_size> rows_;
    std::array<double, block_size> total_;  // of the weights
    std::array<std::uint32_t, 8 * block_size> node_;
    std::array<double, 8 * block_size> weight_;
    std::array<AffineDisplacement, block_size> sum_;
};

// Where a vertex goes and what becomes of its normal.
void carry(const SurfaceVertex& vertex, const AffineDisplacement& motion, Vec3& position, Vec3& normal) {
    position = vertex.rest;
    normal = vertex.normal.cast<double>();
    if (!vertex.alive()) return;
    position = motion.image(vertex.rest);
    const Vec3 turned = cofactor_of(motion.jacobian()) * normal;
    const double length = turned.norm();
    if (length > 1e-9) normal = turned / length;
}

}  // namespace

void deform(const Surface& surface, const RestGrid& rest, std::span<const AffineDisplacement> motion,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel) {
    const std::vector<SurfaceVertex>& vertices = surface.vertices();
    assert(motion.size() == surface.nodes().size());
    // Room for cuts to come, lest one step copies all.
    for (std::vector<Vec3>* out : {&positions, &normals}) {
        if (out->capacity() < vertices.size()) out->reserve(vertices.size() + vertices.size() / 2);
        out->resize(vertices.size());
    }
    parallel.for_chunks(vertices.size(), 4 * block_size, [&](std::size_t begin, std::size_t end) {
        MeanMotions mean;
        for (std::size_t first = begin; first < end; first += block_size) {
            const std::size_t count = std::min(block_size, end - first);
            mean.take(surface, rest, std::span(vertices).subspan(first, count), motion);
            for (std::size_t i = 0; i < count; ++i)
                carry(vertices[first + i], mean[i], positions[first + i], normals[first + i]);
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
