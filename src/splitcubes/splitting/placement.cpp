#include <splitcubes/splitting/placement.h>
#include <splitcubes/splitting/table.h>
#include <splitcubes/splitting/tuning.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::splitting {

namespace {

// Returns the least-squares intersection of the lines or planes n_k . (x - p_k) = 0, moved from `start` only
// along directions that they determine.
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
        if (!(value > tuning::placement::eigenvalue_cutoff * largest)) continue;
        step += eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(right) / value);
        ++rank;
    }
    return start + step;
}

// Moves `start`, which lies on the sheet of planes (or lines) with the normals `fixed`, along that sheet to
// the best intersection with the other planes. rank: of both together.
template <int Dim>
Eigen::Matrix<double, Dim, 1> slide(const Eigen::Matrix<double, Dim, 1>& start,
                                    std::span<const Eigen::Matrix<double, Dim, 1>> fixed,
                                    std::span<const Eigen::Matrix<double, Dim, 1>> points,
                                    std::span<const Eigen::Matrix<double, Dim, 1>> normals, int& rank) {
    using Vec = Eigen::Matrix<double, Dim, 1>;
    using Mat = Eigen::Matrix<double, Dim, Dim>;
    Mat matrix = Mat::Zero();
    for (const Vec& normal : fixed) matrix += normal * normal.transpose();
    const Eigen::SelfAdjointEigenSolver<Mat> eigen(matrix);
    const double largest = eigen.eigenvalues()[Dim - 1];
    Mat free = Mat::Zero();
    int fixed_rank = 0;
    for (int k = 0; k < Dim; ++k) {
        if (eigen.eigenvalues()[k] > tuning::placement::eigenvalue_cutoff * largest)
            ++fixed_rank;
        else
            free += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose();
    }
    rank = fixed_rank;
    std::array<Vec, 12> along, at;
    std::size_t count = 0;
    for (std::size_t k = 0; k < normals.size(); ++k) {
        const Vec projected = free * normals[k];
        // Nearly parallel sheets have no nearby intersection.
        if (projected.squaredNorm() < tuning::placement::eigenvalue_cutoff * normals[k].squaredNorm())
            continue;
        along[count] = projected;
        at[count++] = start + projected * (normals[k].dot(points[k] - start) / projected.squaredNorm());
    }
    if (count == 0) return start;
    int free_rank = 0;
    const Vec best = least_squares_point<Dim>({at.data(), count}, {along.data(), count}, start, free_rank);
    rank += free_rank;
    return best;
}

// Moves `point` along the ray to `inner` until it is in [-margin, 1+margin].
template <int Dim>
Eigen::Matrix<double, Dim, 1> clamp_towards(const Eigen::Matrix<double, Dim, 1>& point,
                                            const Eigen::Matrix<double, Dim, 1>& inner, double margin) {
    double scale = 1;
    for (int k = 0; k < Dim; ++k) {
        const double bound = point[k] > 1 + margin ? 1 + margin : point[k] < -margin ? -margin : point[k];
        if (bound != point[k]) scale = std::min(scale, (bound - inner[k]) / (point[k] - inner[k]));
    }
    return inner + std::clamp(scale, 0.0, 1.0) * (point - inner);
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

bool is_smooth_pair(int edge0, const FaceCrossing& a, int side0, int edge1, const FaceCrossing& b,
                    int side1) {
    const double na = a.normal.dot(along(edge0)), nb = b.normal.dot(along(edge1));
    const double cosine = a.normal.dot(b.normal);
    if (std::abs(na) < tuning::placement::grazing_cosine || std::abs(nb) < tuning::placement::grazing_cosine)
        return std::abs(cosine) >= tuning::placement::sharp_cosine;
    // Both normals oriented to the same side of the sheet.
    const double oriented_cosine = (na * side0 > 0 ? 1 : -1) * (nb * side1 > 0 ? 1 : -1) * cosine;
    return oriented_cosine >= tuning::placement::sharp_cosine;
}

// Returns the middle of the cubic Hermite arc that leaves both crossings along their tangents.
Vec2 place_smooth_pair(const FaceCrossing& a, const FaceCrossing& b) {
    const Vec2 chord = b.point - a.point;
    Vec2 t0 = tangent_of(a.normal), t1 = tangent_of(b.normal);
    if (t0.dot(chord) < 0) t0 = -t0;
    if (t1.dot(chord) < 0) t1 = -t1;
    const Vec2 middle = 0.5 * (a.point + b.point) + chord.norm() / 8 * (t0 - t1);
    return middle.cwiseMax(0).cwiseMin(1);
}

// Moves `base` along the mean normal onto the sheet. Over a point, a quadratic sheet lies half way between
// the mean height of its samples and the mean height of their tangent planes, so this is exact to second
// order; the mean of the face vertices alone stays inside every curve by half a sagitta.
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

FrontRay front_ray(int ring_edge, const FaceCrossing& crossing) {
    Vec2 direction = tangent_of(crossing.normal);
    if (direction.dot(inward(ring_edge)) < 0) direction = -direction;
    double exit_distance = 2;
    for (int k = 0; k < 2; ++k) {
        if (direction[k] > 0) exit_distance = std::min(exit_distance, (1 - crossing.point[k]) / direction[k]);
        if (direction[k] < 0) exit_distance = std::min(exit_distance, crossing.point[k] / -direction[k]);
    }
    return {crossing.point, std::max(exit_distance, 0.0) * direction};
}

namespace {

// Returns the crossings of the first sheet: the boundary, then by cut index.
unsigned oldest_sheet(unsigned ring_mask, const std::array<FaceCrossing, 4>& crossings) {
    unsigned out = 0;
    std::int32_t lowest = 0;
    for (unsigned k = 0; k < 4; ++k) {
        if (!(ring_mask >> k & 1U)) continue;
        const std::int32_t cut = crossings[k].cut;
        if (out != 0 && cut > lowest) continue;
        out = out != 0 && cut == lowest ? out | 1U << k : 1U << k;
        lowest = cut;
    }
    return out;
}

}  // namespace

FacePlacement place_face_vertex(unsigned ring_mask, const std::array<FaceCrossing, 4>& crossings) {
    const FaceConfiguration& face = Table::get().face(ring_mask);
    std::array<int, 4> cut{};
    int count = 0;
    for (int k = 0; k < 4; ++k)
        if (ring_mask >> k & 1U) cut[static_cast<std::size_t>(count++)] = k;
    const auto at = [&](int i) -> const FaceCrossing& {
        return crossings[static_cast<std::size_t>(cut[static_cast<std::size_t>(i)])];
    };
    if (count == 0) return {};
    if (count == 1) {
        const FrontRay ray = front_ray(cut[0], at(0));
        return {(ray.start + at(0).front * ray.way).cwiseMax(0).cwiseMin(1)};
    }
    const unsigned first = oldest_sheet(ring_mask, crossings);
    const bool is_boundary_and_cut =
        first != ring_mask && crossings[static_cast<std::size_t>(std::countr_zero(first))].cut < 0;
    if (count == 2 && !is_boundary_and_cut) {
        const auto side = [&](int i) {
            return face.side[static_cast<std::size_t>(cut[static_cast<std::size_t>(i)])];
        };
        if (is_smooth_pair(cut[0], at(0), side(0), cut[1], at(1), side(1)))
            return {place_smooth_pair(at(0), at(1))};
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
    if (first == ring_mask) {
        const Vec2 best = least_squares_point<2>({points.data(), n}, {normals.data(), n}, mean, rank);
        return {clamp_towards<2>(best, mean, tuning::placement::face_widening), false};
    }
    const auto middle = static_cast<std::size_t>(
        std::stable_partition(cut.begin(), cut.begin() + count, [&](int k) { return first >> k & 1; }) -
        cut.begin());
    for (std::size_t i = 0; i < n; ++i) {
        points[i] = at(static_cast<int>(i)).point;
        normals[i] = at(static_cast<int>(i)).normal;
    }
    const Vec2 alone = place_face_vertex(first, crossings).point;
    const Vec2 best = slide<2>(alone, {normals.data(), middle}, {points.data() + middle, n - middle},
                               {normals.data() + middle, n - middle}, rank);
    return {clamp_towards<2>(best, alone, tuning::placement::meeting_widening), false};
}

Vec3 place_between_centres(int face_axis, double face_level, const Vec3& low, const Vec3& high) {
    const double below = face_level - low[face_axis], above = high[face_axis] - face_level;
    // A centre may lie in the face, to rounding.
    const double rounding = 1e-9 * (std::abs(below) + std::abs(above));
    const double share = below > -rounding && above > -rounding && below + above > 0
                             ? std::clamp(below / (below + above), 0.25, 0.75)
                             : 0.5;
    return low + share * (high - low);
}

namespace {

// Planes of crossings of one sheet, or of sheets that are placed as equals.
struct Planes {
    std::array<Vec3, 12> points, normals;
    std::size_t count = 0;
};

// Returns one plane per smooth sheet. The normals of a curved boundary differ slightly; taken one by one they
// would define a false corner far along the crease. Crossings that agree pairwise, directly or through
// others, form one sheet, so the order of the edges does not matter.
Planes planes_of(std::span<const CellCrossing> crossings) {
    std::array<std::size_t, 12> sheet;
    for (std::size_t i = 0; i < crossings.size(); ++i) {
        sheet[i] = i;
        for (std::size_t j = 0; j < i; ++j) {
            if (std::abs(crossings[i].normal.dot(crossings[j].normal)) < tuning::placement::sharp_cosine)
                continue;
            const std::size_t into = std::min(sheet[i], sheet[j]), from = std::max(sheet[i], sheet[j]);
            std::replace(sheet.begin(), sheet.begin() + static_cast<std::ptrdiff_t>(i) + 1, from, into);
        }
    }
    Planes out;
    for (std::size_t first = 0; first < crossings.size(); ++first) {
        if (sheet[first] != first) continue;
        Vec3 point = Vec3::Zero();
        Mat3 matrix = Mat3::Zero();
        double weight = 0;
        for (std::size_t i = first; i < crossings.size(); ++i) {
            if (sheet[i] != first) continue;
            point += crossings[i].point;
            matrix += crossings[i].normal * crossings[i].normal.transpose();
            ++weight;
        }
        // The mean direction, independent of the normals' signs.
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(matrix);
        out.points[out.count] = point / weight;
        // The plane has the weight of all its crossings.
        out.normals[out.count++] =
            weight == 1 ? crossings[first].normal : Vec3(std::sqrt(weight) * eigen.eigenvectors().col(2));
    }
    return out;
}

bool is_smooth(std::span<const CellCrossing> crossings) {
    for (std::size_t i = 0; i < crossings.size(); ++i)
        for (std::size_t j = i + 1; j < crossings.size(); ++j) {
            double cosine = crossings[i].normal.dot(crossings[j].normal);
            if (crossings[i].grazing || crossings[j].grazing) cosine = std::abs(cosine);
            if (cosine < tuning::placement::sharp_cosine) return false;
        }
    return true;
}

double widening(int rank) {
    return rank == 3 ? tuning::placement::corner_widening : tuning::placement::crease_widening;
}

Vec3 place_equals(std::span<const CellCrossing> crossings, bool oriented, const Vec3& mean) {
    if (oriented && is_smooth(crossings)) return onto_smooth_sheet(crossings, mean).cwiseMax(0).cwiseMin(1);
    const Planes planes = planes_of(crossings);
    int rank = 0;
    const Vec3 best = least_squares_point<3>({planes.points.data(), planes.count},
                                             {planes.normals.data(), planes.count}, mean, rank);
    return clamp_towards<3>(best, mean, widening(rank));
}

}  // namespace

Vec3 place_centre(std::span<const CellCrossing> crossings, bool oriented, const Vec3& mean) {
    std::int32_t lowest = crossings[0].cut;
    for (const CellCrossing& c : crossings) lowest = std::min(lowest, c.cut);
    std::array<CellCrossing, 12> first, rest;
    std::size_t first_count = 0, rest_count = 0;
    for (const CellCrossing& c : crossings) (c.cut == lowest ? first[first_count++] : rest[rest_count++]) = c;
    if (rest_count == 0 || (lowest >= 0 && oriented && is_smooth(crossings)))
        return place_equals(crossings, oriented, mean);
    // Signs can be inconsistent over the whole group where sheets meet.
    for (CellCrossing& c : first) c.grazing = true;
    const Vec3 alone = place_equals({first.data(), first_count}, true, mean);
    const Planes fixed = planes_of({first.data(), first_count});
    const Planes wanted = planes_of({rest.data(), rest_count});
    int rank = 0;
    const Vec3 best =
        slide<3>(alone, {fixed.normals.data(), fixed.count}, {wanted.points.data(), wanted.count},
                 {wanted.normals.data(), wanted.count}, rank);
    return clamp_towards<3>(best, alone, tuning::placement::corner_widening);
}

}  // namespace splitcubes::splitting
