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
// Normals' product above which two samples of lips in a box of a spacing are of one.
constexpr float one_cut_face = 0.7F;
// Where in its box the sample of a flat face that pushes lies, as shares: of faces that look along an axis,
// and against it. So those of the two lips of a cut do not lie on each other.
constexpr float place_along = 0.2F, place_against = 0.8F;

// Of a cell that hangs together, though a crack has come into it: its lips are one fan, which faces nowhere.
constexpr std::uint8_t all_corners = 0xff;

// A vertex that may stand for its box of rest space.
struct SampleCandidate {
    std::uint64_t box;  // and the main direction of its normal
    ContactSample point;
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

// Squared, in cells, from so far along each side of its box.
float share_distance(const Vec3i& place, int side, float share) {
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
void Body::list_contact_samples(const Parallel& parallel) {
    constexpr std::size_t chunk = 4096;
    const double cell = grid_.rest().cell_size;
    const int side = std::max(1, static_cast<int>(std::floor(0.5 * spacing_ / cell)));
    const std::vector<splitting::SurfaceVertex>& vertices = surface_->vertices();
    std::vector<std::vector<SampleCandidate>> found((vertices.size() + chunk - 1) / chunk);
    const auto look_at = [&](std::size_t v) {
        const splitting::SurfaceVertex& vertex = vertices[v];
        if (!vertex.alive() || vertex.kind != splitting::VertexKind::centre) return;
        if (vertex.corners == all_corners || !(vertex.normal.cwiseAbs().maxCoeff() > 0)) return;
        found[v / chunk].push_back(
            {key_of(vertex.place, side, main_direction(vertex.normal)),
             {static_cast<std::uint32_t>(v), pieces_->piece_of(grid_, surface_->influence(vertex)),
              static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v)}});
    };
    parallel.for_each(vertices.size(), chunk, look_at);
    std::size_t most = 0;
    for (const std::vector<SampleCandidate>& candidates : found) most += candidates.size();
    BoxNumbers seen(most);
    contact_samples_.clear();
    for (const std::vector<SampleCandidate>& candidates : found)
        for (const SampleCandidate& candidate : candidates)
            if (seen.number_of(candidate.box, candidate.point.piece) == contact_samples_.size())
                contact_samples_.push_back(candidate.point);
    choose_pushing_points();
    choose_among_cut_faces();
    sample_revision_ = surface_->revision();
}

int Body::spacing_in_cells() const {
    return std::max(1, static_cast<int>(std::floor(widest_box * spacing_ / grid_.rest().cell_size)));
}

// Of a flat face one sample a spacing pushes: its phyxels have no finer motion that more of them would hold.
// Where normals turn within a spacing, one for each of them.
void Body::choose_pushing_points() {
    const int side = spacing_in_cells();
    const std::vector<splitting::SurfaceVertex>& vertices = surface_->vertices();
    BoxNumbers numbers(contact_samples_.size());
    std::vector<Face> faces;
    std::vector<std::uint32_t> face_of(contact_samples_.size());
    std::vector<std::uint32_t> first;  // face of each box
    for (std::uint32_t k = 0; k < contact_samples_.size(); ++k) {
        const splitting::SurfaceVertex& vertex = vertices[contact_samples_[k].vertex];
        const int direction = main_direction(vertex.normal);
        const std::size_t box =
            numbers.number_of(key_of(vertex.place, side, direction), contact_samples_[k].piece);
        if (box == first.size()) first.push_back(Face::none);
        const Vec3f normal = vertex.normal.normalized();
        const float square =
            share_distance(vertex.place, side, direction % 2 == 0 ? place_along : place_against);
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
    for (std::uint32_t k = 0; k < contact_samples_.size(); ++k)
        contact_samples_[k].by = contact_samples_[faces[face_of[k]].best].vertex;
}

// Samples that push in one cell, and whose corners are not the same, are of the two lips of a cut. Of a rough
// lip, too, one a spacing is enough for the other lip, which fits it; and of two that lie at one place the
// first tells for both.
void Body::choose_among_cut_faces() {
    const std::vector<splitting::SurfaceVertex>& vertices = surface_->vertices();
    const auto cosine = [&](std::uint32_t a, std::uint32_t b) {
        const Vec3f &one = vertices[contact_samples_[a].vertex].normal,
                    &other = vertices[contact_samples_[b].vertex].normal;
        return one.dot(other) / (one.norm() * other.norm());
    };
    const std::vector<std::uint32_t> opposite = opposite_points();
    const int side = spacing_in_cells();
    BoxNumbers numbers(contact_samples_.size());
    std::vector<Face> lips;
    std::vector<std::uint32_t> cut_face_of(contact_samples_.size(), Face::none), first;
    for (std::uint32_t k = 0; k < contact_samples_.size(); ++k) {
        if (opposite[k] == Face::none) continue;
        const splitting::SurfaceVertex& vertex = vertices[contact_samples_[k].vertex];
        const std::size_t box = numbers.number_of(key_of(vertex.place, side, main_direction(vertex.normal)),
                                                  contact_samples_[k].piece);
        if (box == first.size()) first.push_back(Face::none);
        const float square = share_distance(vertex.place, side, 0.5F);
        std::uint32_t number = first[box];
        while (number != Face::none && !(cosine(lips[number].best, k) > one_cut_face))
            number = lips[number].next;
        if (number == Face::none) {
            number = static_cast<std::uint32_t>(lips.size());
            lips.push_back({{}, k, square, first[box]});
            first[box] = number;
        } else if (square < lips[number].square) {
            lips[number].best = k;
            lips[number].square = square;
        }
        cut_face_of[k] = number;
    }
    for (std::uint32_t k = 0; k < contact_samples_.size(); ++k) {
        if (cut_face_of[k] == Face::none) continue;
        const std::uint32_t best = lips[cut_face_of[k]].best, other = opposite[k];
        contact_samples_[k].face_delegate = contact_samples_[best].vertex;
        // Whom another one answers for answers for none.
        if (best == k && other < k && lips[cut_face_of[other]].best == other &&
            contact_samples_[other].opposite == contact_samples_[other].vertex)
            contact_samples_[k].opposite = contact_samples_[other].vertex;
    }
}

// Of each point that pushes: one in its cell that a cut has parted from it there.
std::vector<std::uint32_t> Body::opposite_points() const {
    const std::vector<splitting::SurfaceVertex>& vertices = surface_->vertices();
    BoxNumbers numbers(contact_samples_.size());
    std::vector<std::uint32_t> last;  // in each cell
    std::vector<std::uint32_t> before(contact_samples_.size(), Face::none),
        out(contact_samples_.size(), Face::none);
    for (std::uint32_t k = 0; k < contact_samples_.size(); ++k) {
        if (!contact_samples_[k].pushes()) continue;
        const splitting::SurfaceVertex& vertex = vertices[contact_samples_[k].vertex];
        const std::size_t cell = numbers.number_of(key_of(vertex.place, 1, 0), 0);
        if (cell == last.size()) last.push_back(Face::none);
        for (std::uint32_t at = last[cell]; at != Face::none; at = before[at]) {
            if ((vertices[contact_samples_[at].vertex].corners & vertex.corners) != 0) continue;
            if (out[k] == Face::none) out[k] = at;
            if (out[at] == Face::none) out[at] = k;
        }
        before[k] = last[cell];
        last[cell] = k;
    }
    return out;
}

}  // namespace splitcubes::body
