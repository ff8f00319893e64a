// What a body shows to contact: the samples of its skin.
#include <splitcubes/body/body.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::body {

namespace {

// Normals' product above which the samples in a box of a spacing are of one flat face.
constexpr float flat_face = 0.998F;
// Spacings, that a box has at most: whole cells.
constexpr double widest_box = 1.15;
// Where in its box the sample of a flat face that pushes lies, as shares: of faces that look along an axis,
// and against it. So those of the two lips of a cut do not lie on each other.
constexpr float place_along = 0.2F, place_against = 0.8F;

// A vertex that may stand for its box of rest space.
struct SkinCandidate {
    std::uint64_t box;  // and the main direction of its normal
    SkinPoint point;
};

// A box of so many cells along each side, and a main direction: 2 axis, and 1 where it points against the
// axis.
std::uint64_t key_of(const Vec3i& place, int side, int direction) {
    auto key = static_cast<std::uint64_t>(direction);
    // 20 bits each: a grid has no more nodes along an axis.
    for (int k = 0; k < 3; ++k) key = key << 20 | static_cast<std::uint64_t>(place[k] / side);
    return key;
}

int main_direction(const Vec3f& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return 2 * axis + (normal[axis] < 0);
}

// Numbers boxes with a piece in the order in which they come: open addressing.
class BoxNumbers {
  public:
    explicit BoxNumbers(std::size_t most) : table_(std::bit_ceil(2 * most + 1), {0, -1, 0}) {}
    /// A number that as many had before is new.
    std::size_t number_of(std::uint64_t box, std::int32_t piece) {
        Slot& slot = slot_of(box, piece);
        if (slot.piece < 0) slot = {box, piece, count_++};
        return slot.number;
    }

  private:
    struct Slot {
        std::uint64_t box;
        std::int32_t piece;  // -1: empty
        std::uint32_t number;
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

// Samples of a piece in a box of a spacing that have one normal.
struct Face {
    Vec3f normal;               // of the first
    std::uint32_t best;         // of the samples: which pushes
    float square;               // cells^2, how far that is from where it should be
    std::uint32_t next = none;  // of the same box and main direction

    static constexpr std::uint32_t none = ~0U;
};

float distance_from_ideal(const Vec3i& place, int side, int direction) {
    const float share = direction % 2 == 0 ? place_along : place_against;
    float square = 0;
    for (int k = 0; k < 3; ++k) {
        const float off = static_cast<float>(place[k] % side) - share * static_cast<float>(side - 1);
        square += off * off;
    }
    return square;
}

}  // namespace

// One vertex inside a surface cell for every fan, of those that fall into a box of half a phyxel
// spacing the first of each piece and main direction of its normal.
void Body::list_skin_points(const Parallel& parallel) {
    constexpr std::size_t chunk = 4096;
    const double cell = grid_.rest().cell_size;
    const int side = std::max(1, static_cast<int>(std::floor(0.5 * spacing_ / cell)));
    const std::vector<splitting::SurfaceVertex>& vertices = surface_->vertices();
    std::vector<std::vector<SkinCandidate>> found((vertices.size() + chunk - 1) / chunk);
    const auto look_at = [&](std::size_t v) {
        const splitting::SurfaceVertex& vertex = vertices[v];
        if (!vertex.alive() || vertex.kind != splitting::VertexKind::centre) return;
        if (!(vertex.normal.cwiseAbs().maxCoeff() > 0)) return;
        found[v / chunk].push_back(
            {key_of(vertex.place, side, main_direction(vertex.normal)),
             {static_cast<std::uint32_t>(v), pieces_->piece_of(grid_, surface_->carrier(vertex)),
              static_cast<std::uint32_t>(v)}});
    };
    parallel.for_each(vertices.size(), chunk, look_at);
    std::size_t most = 0;
    for (const std::vector<SkinCandidate>& candidates : found) most += candidates.size();
    BoxNumbers seen(most);
    skin_points_.clear();
    for (const std::vector<SkinCandidate>& candidates : found)
        for (const SkinCandidate& candidate : candidates)
            if (seen.number_of(candidate.box, candidate.point.piece) == skin_points_.size())
                skin_points_.push_back(candidate.point);
    choose_pushing_points();
    skin_revision_ = surface_->revision();
}

// Of a flat face one sample a spacing pushes: its phyxels have no finer motion that more of them would hold.
// Where normals turn within a spacing, one for each of them.
void Body::choose_pushing_points() {
    const int side =
        std::max(1, static_cast<int>(std::floor(widest_box * spacing_ / grid_.rest().cell_size)));
    const std::vector<splitting::SurfaceVertex>& vertices = surface_->vertices();
    BoxNumbers numbers(skin_points_.size());
    std::vector<Face> faces;
    std::vector<std::uint32_t> face_of(skin_points_.size());
    std::vector<std::uint32_t> first;  // face of each box
    for (std::uint32_t k = 0; k < skin_points_.size(); ++k) {
        const splitting::SurfaceVertex& vertex = vertices[skin_points_[k].vertex];
        const int direction = main_direction(vertex.normal);
        const std::size_t box =
            numbers.number_of(key_of(vertex.place, side, direction), skin_points_[k].piece);
        if (box == first.size()) first.push_back(Face::none);
        const Vec3f normal = vertex.normal.normalized();
        const float square = distance_from_ideal(vertex.place, side, direction);
        std::uint32_t* at = &first[box];
        while (*at != Face::none && !(faces[*at].normal.dot(normal) > flat_face)) at = &faces[*at].next;
        const bool is_new = *at == Face::none;
        const std::uint32_t number = is_new ? static_cast<std::uint32_t>(faces.size()) : *at;
        *at = number;
        face_of[k] = number;
        // Done with `at`, which may point into what grows now.
        if (is_new) {
            faces.push_back({normal, k, square});
        } else if (square < faces[number].square) {
            faces[number].best = k;
            faces[number].square = square;
        }
    }
    for (std::uint32_t k = 0; k < skin_points_.size(); ++k)
        skin_points_[k].by = skin_points_[faces[face_of[k]].best].vertex;
}

}  // namespace splitcubes::body
