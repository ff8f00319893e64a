#include <splitcubes/core/error.h>
#include <splitcubes/geometry/tuning.h>
#include <splitcubes/geometry/winding_number.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace splitcubes::geometry {

namespace {

// Returns the signed solid angle of a triangle seen from the origin (van Oosterom and Strackee 1983, eq. 8).
// Zero from within the triangle's plane.
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double volume = a.dot(b.cross(c));
    if (volume == 0) return 0;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    return 2 * std::atan2(volume, la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

// Homogeneous polynomials of one degree in x, y, z; sorted by falling power of x, then of y: x^2 xy xz y^2 yz
// z^2.
template <int degree>
using Form = std::array<double, (degree + 1) * (degree + 2) / 2>;

// Index of x^a y^b z^c; a does not matter.
constexpr std::size_t monomial_index(int b, int c) {
    return static_cast<std::size_t>((b + c) * (b + c + 1) / 2 + c);
}

template <int degree, class Body>
void for_each_monomial(const Body& body) {
    for (int row = 0; row <= degree; ++row)
        for (int c = 0; c <= row; ++c) body(degree - row, row - c, c);
}

// Computes out += factor * form * (v . r).
template <std::size_t size, std::size_t larger>
void add_product(const std::array<double, size>& form, const Vec3& v, double factor,
                 std::array<double, larger>& out) {
    constexpr int degree = size == 3 ? 1 : 2;
    static_assert(larger == Form<degree + 1>{}.size() && size == Form<degree>{}.size());
    for_each_monomial<degree>([&](int, int b, int c) {
        const double value = factor * form[monomial_index(b, c)];
        out[monomial_index(b, c)] += value * v[0];
        out[monomial_index(b + 1, c)] += value * v[1];
        out[monomial_index(b, c + 1)] += value * v[2];
    });
}

template <std::size_t size>
auto product(const std::array<double, size>& form, const Vec3& v) {
    std::array<double, size == 3 ? 6 : 10> out{};
    add_product(form, v, 1, out);
    return out;
}

// Computes form += factor * smaller * |r|^2.
template <int degree>
void add_times_square(const Form<degree - 2>& smaller, double factor, Form<degree>& form) {
    for_each_monomial<degree - 2>([&](int, int b, int c) {
        const double value = factor * smaller[monomial_index(b, c)];
        form[monomial_index(b, c)] += value;
        form[monomial_index(b + 2, c)] += value;
        form[monomial_index(b, c + 2)] += value;
    });
}

template <int degree>
Form<degree - 2> laplacian(const Form<degree>& form) {
    Form<degree - 2> out{};
    for_each_monomial<degree>([&](int a, int b, int c) {
        const double value = form[monomial_index(b, c)];
        if (a >= 2) out[monomial_index(b, c)] += a * (a - 1) * value;
        if (b >= 2) out[monomial_index(b - 2, c)] += b * (b - 1) * value;
        if (c >= 2) out[monomial_index(b, c - 2)] += c * (c - 1) * value;
    });
    return out;
}

// Returns the harmonic part of a form, which differs from it by multiples of |r|^2.
template <int degree>
Form<degree> harmonic(Form<degree> form) {
    add_times_square<degree>(laplacian<degree>(form), -1.0 / (2 * (2 * degree - 1)), form);
    return form;
}

// Moments of triangles about a centre as polynomials of r: the sums of the integrals of (y . r)^k (n . r)
// over the triangles, y = x - center, n the normal. The expansion of a gradient field depends on these only.
struct Moments {
    Vec3 center = Vec3::Zero();
    double area = 0;
    Form<1> zeroth{};
    Form<2> first{};
    Form<3> second{};
};

Moments triangle_moments(const std::array<Vec3, 3>& corners) {
    Moments out;
    const Vec3 area_vector = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    out.area = area_vector.norm();
    out.center = (corners[0] + corners[1] + corners[2]) / 3;
    out.zeroth = {area_vector[0], area_vector[1], area_vector[2]};
    // About the centroid the mean of (y . r)^2 is the corners' sum over 12.
    for (const Vec3& corner : corners) {
        const Vec3 y = corner - out.center;
        add_product(product(out.zeroth, y), y, 1.0 / 12, out.second);
    }
    return out;
}

// Adds the moments of `part` about the centre of `sum`: y becomes y + d.
void add_moved(const Moments& part, Moments& sum) {
    const Vec3 d = part.center - sum.center;
    const Form<2> zeroth_d = product(part.zeroth, d);
    for (std::size_t e = 0; e < 3; ++e) sum.zeroth[e] += part.zeroth[e];
    for (std::size_t e = 0; e < 6; ++e) sum.first[e] += part.first[e] + zeroth_d[e];
    for (std::size_t e = 0; e < 10; ++e) sum.second[e] += part.second[e];
    add_product(part.first, d, 2, sum.second);
    add_product(zeroth_d, d, 1, sum.second);
}

Moments joined(const Moments& a, const Moments& b) {
    Moments sum;
    sum.area = a.area + b.area;
    sum.center = (a.area * a.center + b.area * b.center) / sum.area;
    add_moved(a, sum);
    add_moved(b, sum);
    return sum;
}

}  // namespace

// Splits triangles at the median along the longest side of their centroids' bounding box, ties by index, so
// that the tree's depth depends on their count only.
struct WindingNumber::Builder {
    WindingNumber& out;
    std::vector<Corners> corners;        // by triangle
    std::vector<Vec3> centroids;         // by triangle
    std::vector<std::uint32_t> order{};  // triangles in the order of the tree

    Moments build(std::uint32_t begin, std::uint32_t end) {
        const std::size_t index = out.nodes_.size();
        out.nodes_.emplace_back();
        const bool leaf = end - begin <= tuning::winding_number::triangles_per_leaf;
        Moments moments;
        if (leaf) {
            moments = triangle_moments(corners[order[begin]]);
            for (std::uint32_t t = begin + 1; t < end; ++t)
                moments = joined(moments, triangle_moments(corners[order[t]]));
        } else {
            const std::uint32_t middle = split(begin, end);
            const Moments lower = build(begin, middle);
            moments = joined(lower, build(middle, end));
        }
        Node& node = out.nodes_[index];
        node.center = moments.center;
        // Includes the factors of the Taylor series, (-1)^k (2k + 1)!! / k!.
        const auto store = [](const auto& form, double factor, auto& out_form) {
            for (std::size_t e = 0; e < form.size(); ++e) out_form[e] = factor * form[e];
        };
        store(moments.zeroth, 1, node.zeroth);
        store(harmonic<2>(moments.first), -3, node.first);
        store(harmonic<3>(moments.second), 7.5, node.second);
        double radius2 = 0;
        for (std::uint32_t t = begin; t < end; ++t)
            for (const Vec3& corner : corners[order[t]])
                radius2 = std::max(radius2, (corner - moments.center).squaredNorm());
        node.opening_distance2 =
            tuning::winding_number::opening_ratio * tuning::winding_number::opening_ratio * radius2;
        node.whole_distance = tuning::winding_number::opening_ratio * std::sqrt(radius2);
        if (!leaf)
            for (const std::size_t child : {index + 1, std::size_t{out.nodes_[index + 1].skip}})
                node.whole_distance =
                    std::min(node.whole_distance, out.nodes_[child].whole_distance -
                                                      (out.nodes_[child].center - node.center).norm());
        node.begin = begin;
        node.end = end;
        node.leaf = leaf;
        node.skip = static_cast<std::uint32_t>(out.nodes_.size());
        return moments;
    }

    std::uint32_t split(std::uint32_t begin, std::uint32_t end) {
        Box box;
        for (std::uint32_t t = begin; t < end; ++t) box.add(centroids[order[t]]);
        int axis = 0;
        box.size().maxCoeff(&axis);
        const std::uint32_t middle = begin + (end - begin) / 2;
        std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                         [&](std::uint32_t a, std::uint32_t b) {
                             const double ca = centroids[a][axis], cb = centroids[b][axis];
                             return ca != cb ? ca < cb : a < b;
                         });
        return middle;
    }
};

WindingNumber::WindingNumber(const TriangleMesh& mesh) {
    Box box;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (v >= mesh.positions.size() || !mesh.positions[v].allFinite())
                throw InputError("winding number",
                                 "vertex " + std::to_string(v) + " of triangle " + std::to_string(t) +
                                     " is missing or not finite",
                                 "check the mesh");
            box.add(mesh.positions[v]);
        }
    if (box.empty()) return;
    center_ = box.center();
    const double size = box.size().maxCoeff();
    if (!(size > 0)) return;
    scale_ = 1 / size;

    Builder builder{*this, {}, {}};
    for (const Triangle& t : mesh.triangles) {
        Corners corners;
        for (std::size_t i = 0; i < 3; ++i) corners[i] = (mesh.positions[t[i]] - center_) * scale_;
        const Vec3 ab = corners[1] - corners[0], ac = corners[2] - corners[0];
        const double longest2 =
            std::max({ab.squaredNorm(), ac.squaredNorm(), (corners[2] - corners[1]).squaredNorm()});
        // A triangle that is flat within rounding has no sides.
        if (!(ab.cross(ac).norm() > 1e-15 * longest2)) continue;
        builder.order.push_back(static_cast<std::uint32_t>(builder.corners.size()));
        builder.corners.push_back(corners);
        builder.centroids.emplace_back((corners[0] + corners[1] + corners[2]) / 3);
    }
    if (builder.corners.empty()) return;
    nodes_.reserve(builder.corners.size());
    builder.build(0, static_cast<std::uint32_t>(builder.corners.size()));
    corners_.reserve(builder.corners.size());
    lanes_.reserve(builder.corners.size());
    for (const std::uint32_t t : builder.order) {
        corners_.push_back(builder.corners[t]);
        lanes_.add(builder.corners[t]);
    }
    lanes_.finish();
}

// Evaluates the Taylor series of r / |r|^3 about the node's centre: the traces of the moments act on the
// Laplacian of a harmonic function, so only their harmonic parts contribute and the k-th term is a form of
// degree k + 1 over |r|^(2k + 3).
double WindingNumber::expansion(const Node& node, const Vec3& r, double distance2) {
    const double x = r[0], y = r[1], z = r[2];
    const double yy = y * y, yz = y * z, zz = z * z;
    const double yyy = yy * y, yyz = yy * z, yzz = y * zz, zzz = zz * z;
    const std::array<double, 3>& n = node.zeroth;
    const std::array<double, 6>& f = node.first;
    const std::array<double, 10>& s = node.second;
    const double zeroth = n[0] * x + n[1] * y + n[2] * z;
    const double first = (f[0] * x + f[1] * y + f[2] * z) * x + (f[3] * yy + f[4] * yz + f[5] * zz);
    const double second = ((s[0] * x + s[1] * y + s[2] * z) * x + (s[3] * yy + s[4] * yz + s[5] * zz)) * x +
                          ((s[6] * yyy + s[7] * yyz) + (s[8] * yzz + s[9] * zzz));
    const double i = 1 / distance2;
    return (zeroth + i * (first + i * second)) * i * std::sqrt(i);
}

double WindingNumber::at(const Vec3& point) const {
    const Vec3 q = (point - center_) * scale_;
    double far = 0, near = 0;
    for (std::uint32_t index = 0; index < nodes_.size();) {
        const Node& node = nodes_[index];
        const Vec3 r = node.center - q;
        const double d2 = r.squaredNorm();
        if (d2 > node.opening_distance2) {
            far += expansion(node, r, d2);
            index = node.skip;
        } else if (node.leaf) {
            for (std::uint32_t t = node.begin; t < node.end; ++t)
                near += solid_angle(corners_[t][0] - q, corners_[t][1] - q, corners_[t][2] - q);
            index = node.skip;
        } else {
            ++index;
        }
    }
    return (far + near) / (4 * std::numbers::pi);
}

WindingNumber::Estimate WindingNumber::quick_at(const Vec3& point) const {
    const Vec3 q = (point - center_) * scale_;
    double far = 0, near = 0;
    std::array<WindingLanes::Run, 64> runs;
    std::size_t count = 0, summed = 0;
    bool sound = true;
    const auto sum_runs = [&] {
        double sum = 0;
        sound = lanes_.solid_angle(q, std::span(runs).first(count), sum);
        near += sum;
        count = 0;
    };
    for (std::uint32_t index = 0; index < nodes_.size() && sound;) {
        const Node& node = nodes_[index];
        const Vec3 r = node.center - q;
        const double d2 = r.squaredNorm();
        if (d2 > node.opening_distance2) {
            far += expansion(node, r, d2);
            index = node.skip;
        } else if (node.leaf || (node.whole_distance > 0 && d2 < node.whole_distance * node.whole_distance)) {
            summed += node.end - node.begin;
            const bool goes_on = count > 0 && runs[count - 1].last == node.begin;
            if (!goes_on && count == runs.size()) sum_runs();
            if (goes_on)
                runs[count - 1].last = node.end;
            else
                runs[count++] = {node.begin, node.end};
            index = node.skip;
        } else {
            ++index;
        }
    }
    if (sound && count > 0) sum_runs();
    if (!sound) return {at(point), 0, summed};
    const double error = WindingLanes::error * static_cast<double>(summed) + 1e-12;
    return {(far + near) / (4 * std::numbers::pi), error / (4 * std::numbers::pi), summed};
}

bool WindingNumber::exceeds(const Vec3& point, double limit) const {
    const Estimate quick = quick_at(point);
    const double size = std::abs(quick.value);
    if (std::abs(size - limit) > quick.tolerance) return size > limit;
    return std::abs(at(point)) > limit;
}

double WindingNumber::exact_at(const Vec3& point) const {
    const Vec3 q = (point - center_) * scale_;
    double sum = 0;
    for (const Corners& c : corners_) sum += solid_angle(c[0] - q, c[1] - q, c[2] - q);
    return sum / (4 * std::numbers::pi);
}

}  // namespace splitcubes::geometry
