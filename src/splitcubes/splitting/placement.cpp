#include <splitcubes/splitting/placement.h>
#include <splitcubes/splitting/table.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::splitting {

namespace {

// Singular values under a tenth of the largest are dropped; the normal matrix
// holds their squares.
constexpr double eigenvalue_cutoff = 0.01;
constexpr double face_widening = 0.25;
constexpr double crease_widening = 0.5;
// Three planes fix a corner, however far off; a tilted cube's corner was seen to
// lie up to 0.8 of a cell outside the nearest cell that meets all three.
constexpr double corner_widening = 1.0;
constexpr double grazing_cosine = 0.05;

// The point nearest to all lines or planes n_k . (x - p_k) = 0, started from
// `start` and moved only along directions that they determine.
template <int Dim>
Eigen::Matrix<double, Dim, 1> least_squares_point(std::span<const Eigen::Matrix<double, Dim, 1>> points,
                                                  std::span<const Eigen::Matrix<double, Dim, 1>> normals,
                                                  const Eigen::Matrix<double, Dim, 1>& start, int& rank) {
    using Vec = Eigen::Matrix<double, Dim, 1>;
    using Mat = Eigen::Matrix<double, Dim, Dim>;
    Mat matrix = Mat::Zero();
    Vec right = Vec::Zero();
    for (std::size_t k = 0; k < points.size(); ++k) {
        matrix += normals[k] * normals[k].transpose();
        right += normals[k] * normals[k].dot(points[k] - start);
    }
    const Eigen::SelfAdjointEigenSolver<Mat> eigen(matrix);
    const double largest = eigen.eigenvalues()[Dim - 1];
    Vec step = Vec::Zero();
    rank = 0;
    for (int k = 0; k < Dim; ++k) {
        const double value = eigen.eigenvalues()[k];
        if (!(value > eigenvalue_cutoff * largest)) continue;
        step += eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(right) / value);
        ++rank;
    }
    return start + step;
}

// Pulls `point` back along the ray to `inner` until it is in [-margin, 1+margin].
template <int Dim>
Eigen::Matrix<double, Dim, 1> pull_back(const Eigen::Matrix<double, Dim, 1>& point,
                                        const Eigen::Matrix<double, Dim, 1>& inner, double margin) {
    double keep = 1;
    for (int k = 0; k < Dim; ++k) {
        const double bound = point[k] > 1 + margin ? 1 + margin : point[k] < -margin ? -margin : point[k];
        if (bound != point[k]) keep = std::min(keep, (bound - inner[k]) / (point[k] - inner[k]));
    }
    return inner + std::clamp(keep, 0.0, 1.0) * (point - inner);
}

template <int Dim>
bool outside(const Eigen::Matrix<double, Dim, 1>& point, double margin) {
    return (point.array() < -margin).any() || (point.array() > 1 + margin).any();
}

Vec2 inward(int ring_edge) {
    static const Vec2 directions[4] = {{0, 1}, {-1, 0}, {0, -1}, {1, 0}};
    return directions[ring_edge];
}
Vec2 along(int ring_edge) {
    return ring_edge % 2 == 0 ? Vec2(1, 0) : Vec2(0, 1);
}

Vec2 tangent_of(const Vec2& normal) {
    return {-normal[1], normal[0]};
}

// Kind B: half way from the crossing to where its tangent leaves the face.
Vec2 place_single(int ring_edge, const FaceCrossing& crossing) {
    Vec2 direction = tangent_of(crossing.normal);
    if (direction.dot(inward(ring_edge)) < 0) direction = -direction;
    double leave = 2;
    for (int k = 0; k < 2; ++k) {
        if (direction[k] > 0) leave = std::min(leave, (1 - crossing.point[k]) / direction[k]);
        if (direction[k] < 0) leave = std::min(leave, crossing.point[k] / -direction[k]);
    }
    return (crossing.point + 0.5 * std::max(leave, 0.0) * direction).cwiseMax(0).cwiseMin(1);
}

bool is_smooth_pair(int edge0, const FaceCrossing& a, int side0, int edge1, const FaceCrossing& b,
                    int side1) {
    const double na = a.normal.dot(along(edge0)), nb = b.normal.dot(along(edge1));
    const double cosine = a.normal.dot(b.normal);
    if (std::abs(na) < grazing_cosine || std::abs(nb) < grazing_cosine)
        return std::abs(cosine) >= sharp_cosine;
    // Both turned to the same side of the sheet.
    const double turned = (na * side0 > 0 ? 1 : -1) * (nb * side1 > 0 ? 1 : -1) * cosine;
    return turned >= sharp_cosine;
}

// Middle of the cubic Hermite arc that leaves both crossings along their tangents.
Vec2 place_smooth_pair(const FaceCrossing& a, const FaceCrossing& b) {
    const Vec2 chord = b.point - a.point;
    Vec2 t0 = tangent_of(a.normal), t1 = tangent_of(b.normal);
    if (t0.dot(chord) < 0) t0 = -t0;
    if (t1.dot(chord) < 0) t1 = -t1;
    const Vec2 middle = 0.5 * (a.point + b.point) + chord.norm() / 8 * (t0 - t1);
    return middle.cwiseMax(0).cwiseMin(1);
}

// Lifts `base` along the mean normal onto the sheet. Over a point, a quadratic
// sheet lies half way between the mean height of its samples and the mean height
// of their tangent planes, so this is exact to second order; the mean of the face
// vertices alone stays inside every curve by half a sagitta.
Vec3 onto_smooth_sheet(std::span<const CellCrossing> crossings, const Vec3& base) {
    Vec3 direction = Vec3::Zero();
    for (const CellCrossing& c : crossings)
        direction += c.normal.dot(crossings[0].normal) < 0 ? Vec3(-c.normal) : c.normal;
    direction.normalize();  // no pair is sharp, so the sum is not short
    double height = 0;
    for (const CellCrossing& c : crossings) {
        const Vec3 to_sample = c.point - base;
        height += 0.5 * (to_sample.dot(direction) + to_sample.dot(c.normal) / c.normal.dot(direction));
    }
    return base + height / static_cast<double>(crossings.size()) * direction;
}

}  // namespace

FaceCrossing face_crossing(int ring_edge, double parameter, double normal_u, double normal_v,
                           std::int32_t cut) {
    static const Vec2 starts[4] = {{0, 0}, {1, 0}, {0, 1}, {0, 0}};
    FaceCrossing out;
    out.cut = cut;
    out.point = starts[ring_edge] + parameter * along(ring_edge);
    const Vec2 normal(normal_u, normal_v);
    const double length = normal.norm();
    out.normal = length > 1e-6 ? Vec2(normal / length) : along(ring_edge);
    return out;
}

Vec2 place_face_vertex(unsigned ring_mask, const std::array<FaceCrossing, 4>& crossings) {
    const FaceConfiguration& face = Table::get().face(ring_mask);
    std::array<int, 4> cut{};
    int count = 0;
    for (int k = 0; k < 4; ++k)
        if (ring_mask >> k & 1U) cut[static_cast<std::size_t>(count++)] = k;
    const auto at = [&](int i) -> const FaceCrossing& {
        return crossings[static_cast<std::size_t>(cut[static_cast<std::size_t>(i)])];
    };
    if (count == 0) return {0.5, 0.5};
    if (count == 1) return place_single(cut[0], at(0));
    if (count == 2) {
        const auto side = [&](int i) {
            return face.side[static_cast<std::size_t>(cut[static_cast<std::size_t>(i)])];
        };
        if (is_smooth_pair(cut[0], at(0), side(0), cut[1], at(1), side(1)))
            return place_smooth_pair(at(0), at(1));
    }
    std::array<Vec2, 4> points, normals;
    Vec2 mean = Vec2::Zero();
    for (int i = 0; i < count; ++i) {
        points[static_cast<std::size_t>(i)] = at(i).point;
        normals[static_cast<std::size_t>(i)] = at(i).normal;
        mean += at(i).point / count;
    }
    const auto n = static_cast<std::size_t>(count);
    int rank = 0;
    const Vec2 best = least_squares_point<2>({points.data(), n}, {normals.data(), n}, mean, rank);
    if (outside<2>(best, face_widening)) {
        unsigned first = 0;
        std::int32_t lowest = at(0).cut;
        for (int i = 0; i < count; ++i) lowest = std::min(lowest, at(i).cut);
        for (int i = 0; i < count; ++i)
            if (at(i).cut == lowest) first |= 1U << cut[static_cast<std::size_t>(i)];
        if (first != ring_mask) return place_face_vertex(first, crossings);
    }
    return pull_back<2>(best, mean, face_widening);
}

Vec3 place_centre(std::span<const CellCrossing> crossings, bool oriented, const Vec3& mean) {
    bool smooth = oriented;
    for (std::size_t i = 0; i < crossings.size() && smooth; ++i)
        for (std::size_t j = i + 1; j < crossings.size() && smooth; ++j) {
            double cosine = crossings[i].normal.dot(crossings[j].normal);
            if (crossings[i].grazing || crossings[j].grazing) cosine = std::abs(cosine);
            smooth = cosine >= sharp_cosine;
        }
    if (smooth) return onto_smooth_sheet(crossings, mean).cwiseMax(0).cwiseMin(1);
    // One plane a smooth sheet: the normals of a curved skin differ a little, and
    // taken one by one they would pretend to a corner far along the crease.
    std::array<Vec3, 12> points, normals, first_normals;
    std::array<double, 12> counts{};
    std::size_t sheets = 0;
    for (const CellCrossing& c : crossings) {
        std::size_t k = 0;
        while (k < sheets && std::abs(c.normal.dot(first_normals[k])) < sharp_cosine) ++k;
        if (k == sheets) {
            points[k] = normals[k] = Vec3::Zero();
            first_normals[k] = c.normal;
            ++sheets;
        }
        points[k] += c.point;
        normals[k] += c.normal.dot(first_normals[k]) < 0 ? Vec3(-c.normal) : c.normal;
        ++counts[k];
    }
    for (std::size_t k = 0; k < sheets; ++k) {
        points[k] /= counts[k];
        normals[k] *= std::sqrt(counts[k]) / normals[k].norm();  // weighs as its crossings did
    }
    int rank = 0;
    const Vec3 best = least_squares_point<3>({points.data(), sheets}, {normals.data(), sheets}, mean, rank);
    if (outside<3>(best, crease_widening)) {
        std::array<CellCrossing, 12> first;
        std::size_t count = 0;
        std::int32_t lowest = crossings[0].cut;
        for (const CellCrossing& c : crossings) lowest = std::min(lowest, c.cut);
        for (const CellCrossing& c : crossings) {
            if (c.cut != lowest) continue;
            first[count] = c;
            // The signs of the whole group may be at odds where sheets meet.
            first[count++].grazing = true;
        }
        if (count < crossings.size()) return place_centre({first.data(), count}, true, mean);
    }
    return pull_back<3>(best, mean, rank == 3 ? corner_widening : crease_widening);
}

}  // namespace splitcubes::splitting
