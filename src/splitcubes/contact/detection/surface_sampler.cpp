#include <splitcubes/contact/detection/surface_sampler.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::body {

namespace {

// Corners of a cell that a cut entered without separating it: its cut faces are one fan, which has no usable
// normal.
constexpr std::uint8_t all_corners = 0xff;

// Vertex that may become the sample of its box in rest space.
struct SampleCandidate {
    std::uint64_t box;  // and main direction of the vertex normal; see key_of
    ContactSample point;
};

// Returns the key of a box of side^3 cells and a main direction: 2 axis, plus 1 if it points against the
// axis.
std::uint64_t key_of(const Vec3i& cell, int side, int direction) {
    auto key = static_cast<std::uint64_t>(direction);
    // 20 bits each: a grid has at most 2^20 nodes along an axis.
    for (int k = 0; k < 3; ++k) key = key << 20 | static_cast<std::uint64_t>(cell[k] / side);
    return key;
}

int main_direction(const Vec3f& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return 2 * axis + (normal[axis] < 0);
}

// Hash table (open addressing) that gives each pair of box and piece an index, in order of first appearance.
class BoxIndices {
  public:
    explicit BoxIndices(std::size_t count) : table_(std::bit_ceil(2 * count + 1), {0, -1, 0}) {}
    /// Returns the index of the pair; a new pair gets the number of pairs before it.
    std::size_t index_of(std::uint64_t box, std::int32_t piece) {
        Slot& slot = slot_of(box, piece);
        if (slot.piece < 0) slot = {box, piece, count_++};
        return slot.index;
    }

  private:
    struct Slot {
        std::uint64_t box;
        std::int32_t piece;  // -1: empty
        std::uint32_t index;
    };
    Slot& slot_of(std::uint64_t box, std::int32_t piece) {
        const std::size_t mask = table_.size() - 1;
        const std::uint64_t mixed = (box ^ static_cast<std::uint64_t>(piece) << 40) * 0x9e3779b97f4a7c15ULL;
        std::size_t at = mixed >> 24 & mask;
        while (table_[at].piece >= 0 && (table_[at].box != box || table_[at].piece != piece))
            at = (at + 1) & mask;
        return table_[at];
    }
    std::vector<Slot> table_;
    std::uint32_t count_ = 0;
};

// Samples of a piece in one box that share a normal.
struct SampleFace {
    Vec3f normal;               // of the first sample
    std::uint32_t best;         // index of the sample that pushes
    float square;               // cells^2, its squared distance from the preferred position
    std::uint32_t next = none;  // next face of the same box and main direction

    static constexpr std::uint32_t none = ~0U;
};

// Returns the squared distance, in cells, of a cell from the point at `share` along each side of its box.
float share_distance(const Vec3i& cell, int side, float share) {
    float square = 0;
    for (int k = 0; k < 3; ++k) {
        const float off = static_cast<float>(cell[k] % side) - share * static_cast<float>(side - 1);
        square += off * off;
    }
    return square;
}

}  // namespace

// Lists one vertex per surface cell and fan; in each box of half a phyxel spacing only the first one of each
// piece and main direction of the normal.
void SurfaceSampler::rebuild(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                             const splitting::Pieces& pieces, double spacing, const Parallel& parallel) {
    constexpr std::size_t chunk = 4096;
    const double cell = grid.rest().cell_size;
    const int side = std::max(1, static_cast<int>(std::floor(0.5 * spacing / cell)));
    const std::vector<splitting::SurfaceVertex>& vertices = surface.vertices();
    std::vector<std::vector<SampleCandidate>> found((vertices.size() + chunk - 1) / chunk);
    const auto look_at = [&](std::size_t v) {
        const splitting::SurfaceVertex& vertex = vertices[v];
        if (!vertex.alive() || vertex.kind != splitting::VertexKind::centre) return;
        if (vertex.corners == all_corners || !(vertex.normal.cwiseAbs().maxCoeff() > 0)) return;
        found[v / chunk].push_back(
            {key_of(vertex.lowest_node, side, main_direction(vertex.normal)),
             {static_cast<std::uint32_t>(v), pieces.piece_of(grid, surface.influence(vertex)),
              static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v)}});
    };
    parallel.for_each(vertices.size(), chunk, look_at);
    std::size_t count = 0;
    for (const std::vector<SampleCandidate>& candidates : found) count += candidates.size();
    BoxIndices seen(count);
    samples_.clear();
    for (const std::vector<SampleCandidate>& candidates : found)
        for (const SampleCandidate& candidate : candidates)
            if (seen.index_of(candidate.box, candidate.point.piece) == samples_.size())
                samples_.push_back(candidate.point);
    const int spacing_in_cells =
        std::max(1, static_cast<int>(std::floor(tuning::samples::max_box_share * spacing / cell)));
    choose_active_samples(surface, spacing_in_cells);
    choose_cut_face_samples(surface, spacing_in_cells);
    revision_ = surface.revision();
}

// Lets one sample per spacing push on a flat face: the phyxels have no finer motion that more samples could
// constrain. Where normals vary within a spacing, one sample per normal pushes.
void SurfaceSampler::choose_active_samples(const splitting::Surface& surface, int side) {
    const std::vector<splitting::SurfaceVertex>& vertices = surface.vertices();
    BoxIndices indices(samples_.size());
    std::vector<SampleFace> faces;
    std::vector<std::uint32_t> face_of(samples_.size());
    std::vector<std::uint32_t> first;  // per box: its first face
    for (std::uint32_t k = 0; k < samples_.size(); ++k) {
        const splitting::SurfaceVertex& vertex = vertices[samples_[k].vertex];
        const int direction = main_direction(vertex.normal);
        const std::size_t box =
            indices.index_of(key_of(vertex.lowest_node, side, direction), samples_[k].piece);
        if (box == first.size()) first.push_back(SampleFace::none);
        const Vec3f normal = vertex.normal.normalized();
        const float square = share_distance(
            vertex.lowest_node, side,
            direction % 2 == 0 ? tuning::samples::preferred_along : tuning::samples::preferred_against);
        std::uint32_t* at = &first[box];
        while (*at != SampleFace::none &&
               !(faces[*at].normal.dot(normal) > tuning::samples::flat_face_cosine))
            at = &faces[*at].next;
        const bool is_new_face = *at == SampleFace::none;
        const std::uint32_t index = is_new_face ? static_cast<std::uint32_t>(faces.size()) : *at;
        *at = index;
        face_of[k] = index;
        // `at` is not used below: it may point into `faces`, which grows now.
        if (is_new_face) {
            faces.push_back({normal, k, square});
        } else if (square < faces[index].square) {
            faces[index].best = k;
            faces[index].square = square;
        }
    }
    for (std::uint32_t k = 0; k < samples_.size(); ++k)
        samples_[k].representative = samples_[faces[face_of[k]].best].vertex;
}

// Chooses which samples of cut faces push on each other. Pushing samples in one cell whose corners are
// disjoint are on the two faces of a cut. The opposite face fits, so one sample per spacing is enough on
// rough cut faces, too; and of two opposite samples the first searches for both.
void SurfaceSampler::choose_cut_face_samples(const splitting::Surface& surface, int side) {
    const std::vector<splitting::SurfaceVertex>& vertices = surface.vertices();
    const auto cosine = [&](std::uint32_t a, std::uint32_t b) {
        const Vec3f &one = vertices[samples_[a].vertex].normal, &other = vertices[samples_[b].vertex].normal;
        return one.dot(other) / (one.norm() * other.norm());
    };
    const std::vector<std::uint32_t> opposite = opposite_samples(surface);
    BoxIndices indices(samples_.size());
    std::vector<SampleFace> cut_faces;
    std::vector<std::uint32_t> cut_face_of(samples_.size(), SampleFace::none), first;
    for (std::uint32_t k = 0; k < samples_.size(); ++k) {
        if (opposite[k] == SampleFace::none) continue;
        const splitting::SurfaceVertex& vertex = vertices[samples_[k].vertex];
        const std::size_t box = indices.index_of(
            key_of(vertex.lowest_node, side, main_direction(vertex.normal)), samples_[k].piece);
        if (box == first.size()) first.push_back(SampleFace::none);
        const float square = share_distance(vertex.lowest_node, side, 0.5F);
        std::uint32_t index = first[box];
        while (index != SampleFace::none &&
               !(cosine(cut_faces[index].best, k) > tuning::samples::one_cut_face_cosine))
            index = cut_faces[index].next;
        if (index == SampleFace::none) {
            index = static_cast<std::uint32_t>(cut_faces.size());
            cut_faces.push_back({{}, k, square, first[box]});
            first[box] = index;
        } else if (square < cut_faces[index].square) {
            cut_faces[index].best = k;
            cut_faces[index].square = square;
        }
        cut_face_of[k] = index;
    }
    for (std::uint32_t k = 0; k < samples_.size(); ++k) {
        if (cut_face_of[k] == SampleFace::none) continue;
        const std::uint32_t best = cut_faces[cut_face_of[k]].best, other = opposite[k];
        samples_[k].face_delegate = samples_[best].vertex;
        // A sample that delegates to its opposite sample cannot be a delegate itself.
        if (best == k && other < k && cut_faces[cut_face_of[other]].best == other &&
            samples_[other].opposite == samples_[other].vertex)
            samples_[k].opposite = samples_[other].vertex;
    }
}

// Returns, for each pushing sample, one in its cell that a cut has separated from it; SampleFace::none if
// there is none.
std::vector<std::uint32_t> SurfaceSampler::opposite_samples(const splitting::Surface& surface) const {
    const std::vector<splitting::SurfaceVertex>& vertices = surface.vertices();
    BoxIndices indices(samples_.size());
    std::vector<std::uint32_t> last;  // per cell: its last sample so far
    std::vector<std::uint32_t> before(samples_.size(), SampleFace::none),
        out(samples_.size(), SampleFace::none);
    for (std::uint32_t k = 0; k < samples_.size(); ++k) {
        if (!samples_[k].pushes()) continue;
        const splitting::SurfaceVertex& vertex = vertices[samples_[k].vertex];
        const std::size_t cell = indices.index_of(key_of(vertex.lowest_node, 1, 0), 0);
        if (cell == last.size()) last.push_back(SampleFace::none);
        for (std::uint32_t at = last[cell]; at != SampleFace::none; at = before[at]) {
            if ((vertices[samples_[at].vertex].corners & vertex.corners) != 0) continue;
            if (out[k] == SampleFace::none) out[k] = at;
            if (out[at] == SampleFace::none) out[at] = k;
        }
        before[k] = last[cell];
        last[cell] = k;
    }
    return out;
}

}  // namespace splitcubes::body
