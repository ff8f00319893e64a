#include <splitcubes/splitting/soup_edges.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::splitting {

using geometry::EdgeCrossing;
using geometry::WindingJet;
using geometry::WindingTriangles;

namespace {

double rounding(double error2) {
    return tuning::soup_edges::rounding_spread * std::sqrt(error2);
}

// Error of a quintic that matches values and two derivatives at both ends of a unit interval, per integral of
// r^-7 along the boundaries of its triangles: 6! / (4 pi) bounds the sixth derivative, and 6! 2^6 divides it.
constexpr double quintic_error = 1 / (4 * std::numbers::pi * 64);
// Amplification of the error of one quintic by another that interpolates its values and derivatives.
constexpr double inherited = 1.35;

// A function's value, first and second derivative along an edge.
struct Taylor {
    double value = 0, first = 0, second = 0;
};

Taylor operator+(const Taylor& a, const Taylor& b) {
    return {a.value + b.value, a.first + b.first, a.second + b.second};
}
Taylor operator-(const Taylor& a, const Taylor& b) {
    return {a.value - b.value, a.first - b.first, a.second - b.second};
}

Taylor point_along(const WindingJet& jet, int axis) {
    return {jet.value, jet.gradient[axis], jet.second[axis]};
}

class Quintic {
  public:
    Quintic(const Taylor& low, const Taylor& high, double begin, double end)
        : begin_(begin), length_(end - begin) {
        const double h = length_;
        c_[0] = low.value;
        c_[1] = h * low.first;
        c_[2] = 0.5 * h * h * low.second;
        const double r0 = high.value - c_[0] - c_[1] - c_[2];
        const double r1 = h * high.first - c_[1] - 2 * c_[2], r2 = h * h * high.second - 2 * c_[2];
        c_[3] = 10 * r0 - 4 * r1 + 0.5 * r2;
        c_[4] = -15 * r0 + 7 * r1 - r2;
        c_[5] = 6 * r0 - 3 * r1 + 0.5 * r2;
    }
    Taylor at(double t) const {
        const double u = (t - begin_) / length_;
        Taylor out;
        for (int k = 5; k >= 0; --k) {
            out.second = out.second * u + 2 * out.first;
            out.first = out.first * u + out.value;
            out.value = out.value * u + c_[k];
        }
        return {out.value, out.first / length_, out.second / (length_ * length_)};
    }

  private:
    double begin_, length_, c_[6];
};

bool has_area(const geometry::TriangleMesh& mesh, const geometry::Triangle& t) {
    const Vec3 ab = mesh.positions[t[1]] - mesh.positions[t[0]];
    const Vec3 ac = mesh.positions[t[2]] - mesh.positions[t[0]];
    const double longest2 = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    return ab.cross(ac).norm() > 1e-15 * longest2;
}

Vec3 middle_node(const RestGrid& rest) {
    return (rest.node_count / 2).cast<double>();
}

std::vector<WindingTriangles::Corners> corners_of(const geometry::TriangleMesh& mesh, const RestGrid& rest) {
    std::vector<WindingTriangles::Corners> out;
    for (const geometry::Triangle& t : mesh.triangles) {
        if (!has_area(mesh, t)) continue;
        WindingTriangles::Corners corners;
        for (std::size_t k = 0; k < 3; ++k)
            corners[k] = rest.to_grid(mesh.positions[t[k]]) - middle_node(rest);
        out.push_back(corners);
    }
    return out;
}

}  // namespace

bool SoupEdges::pays(const geometry::WindingNumber& winding, const geometry::TriangleMesh& mesh,
                     const RestGrid& rest) {
    const double nodes = rest.node_count.cast<double>().prod();
    const geometry::Box box = mesh.bounds();
    if (mesh.triangles.size() < tuning::soup_edges::min_near_triangles ||
        nodes > tuning::soup_edges::max_nodes ||
        !(std::max(rest.to_grid(box.min).cwiseAbs().maxCoeff(), rest.to_grid(box.max).cwiseAbs().maxCoeff()) <
          tuning::soup_edges::max_extent))
        return false;
    double near = 0;
    for (int k = 0; k < 64; ++k) {
        const Vec3 share(0.125 + 0.25 * (k % 4), 0.125 + 0.25 * (k / 4 % 4), 0.125 + 0.25 * (k / 16));
        near += static_cast<double>(winding.quick_at(box.min + share.cwiseProduct(box.size())).near_count);
    }
    near /= 64;
    return near > tuning::soup_edges::min_near_triangles &&
           near > tuning::soup_edges::sum_cost_ratio * static_cast<double>(mesh.triangles.size());
}

SoupEdges::SoupEdges(const geometry::TriangleMesh& mesh, const RestGrid& rest,
                     const geometry::GridCrossings& sweep, const geometry::WindingNumber& winding,
                     const Parallel& parallel)
    : rest_(rest),
      sweep_(sweep),
      winding_(winding),
      center_(middle_node(rest)),
      jets_(corners_of(mesh, rest)),
      after_(sweep.crossings.size(), unknown) {
    std::uint32_t id = 0;
    for (const geometry::Triangle& t : mesh.triangles) {
        has_area_.push_back(has_area(mesh, t));
        jet_ids_.push_back(id);
        id += has_area_.back();
    }
    const Vec3i n = rest.node_count;
    const auto lines = static_cast<std::size_t>(n[1] * n[2] + n[2] * n[0] + n[0] * n[1]);
    line_begin_.assign(lines + 1, 0);
    for (const EdgeCrossing& c : sweep.crossings) ++line_begin_[line_of(c.node, c.axis) + 1];
    for (std::size_t line = 0; line < lines; ++line) line_begin_[line + 1] += line_begin_[line];
    set_nodes(parallel);
    set_edges(parallel);
}

std::size_t SoupEdges::line_of(const Vec3i& node, int axis) const {
    const Vec3i n = rest_.node_count;
    const int before = axis == 0 ? 0 : axis == 1 ? n[1] * n[2] : n[1] * n[2] + n[2] * n[0];
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    return static_cast<std::size_t>(before + node[v] * n[u] + node[u]);
}

std::span<const EdgeCrossing> SoupEdges::crossings(const GridEdge& edge) const {
    const std::size_t line = line_of(edge.node, edge.axis);
    const auto begin = sweep_.crossings.begin() + line_begin_[line];
    const auto end = sweep_.crossings.begin() + line_begin_[line + 1];
    const int x = edge.node[edge.axis];
    const auto first =
        std::partition_point(begin, end, [&](const EdgeCrossing& c) { return c.node[edge.axis] < x; });
    const auto last =
        std::partition_point(first, end, [&](const EdgeCrossing& c) { return c.node[edge.axis] == x; });
    return {first, last};
}

bool SoupEdges::inside_at(const GridEdge& edge, double parameter) const {
    const Vec3 at = edge.node.cast<double>() + parameter * Vec3::Unit(edge.axis);
    const WindingJet jet = jets_.value(jets_.triangles(), centered(at));
    const double size = std::abs(jet.value);
    if (jet.sound && std::abs(size - 0.5) > tuning::soup_edges::tree_error + rounding(jet.error2))
        return size > 0.5;
    return winding_.exceeds(
        rest_.node_position(edge.node) + parameter * rest_.cell_size * Vec3::Unit(edge.axis), 0.5);
}

void SoupEdges::set_nodes(const Parallel& parallel) {
    const Vec3i n = rest_.node_count;
    const auto count = static_cast<std::size_t>(n.prod());
    nodes_.resize(count);
    inside_.assign(count, 0);
    parallel.for_each(count, 16, [&](std::size_t i) {
        const auto k = static_cast<int>(i);
        const Vec3i node(k % n[0], k / n[0] % n[1], k / (n[0] * n[1]));
        const WindingJet jet = jets_.jet(jets_.triangles(), centered(node.cast<double>()));
        NodeJet& out = nodes_[i];
        out = {jet.value, {}, {}, static_cast<float>(jet.error2), jet.sound};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            out.gradient[axis] = static_cast<float>(jet.gradient[static_cast<Eigen::Index>(axis)]);
            out.second[axis] = static_cast<float>(jet.second[static_cast<Eigen::Index>(axis)]);
        }
        if ((node.array() == 0).any() || (node.array() == n.array() - 1).any()) return;
        const double size = std::abs(jet.value);
        if (jet.sound && std::abs(size - 0.5) > tuning::soup_edges::tree_error + rounding(jet.error2))
            inside_[i] = size > 0.5;
        else
            inside_[i] = winding_.exceeds(rest_.node_position(node), 0.5);
    });
}

// Processes blocks of cells on one thread.
class SoupEdges::Worker {
  public:
    explicit Worker(SoupEdges& out) : out_(out), stamp_(out.jets_.triangles().size(), 0) {}

    std::vector<BoundaryCut> holes;

    // Processes the edges that start at the nodes of a cube, with lists of near triangles that shrink as it
    // is divided.
    void cube(const Vec3i& corner, int size, std::size_t level, const WindingTriangles& list, double moment) {
        if ((corner.array() >= out_.rest_.node_count.array()).any()) return;
        if (size == 1 && !has_work(corner)) return;
        const double gap = size == 1 ? 1.25 : size == 2 ? 2 : size == 4 ? 3 : 4;
        const Vec3 center = out_.centered(corner.cast<double>() + Vec3::Constant(0.5 * size));
        const double here = moment + list.near(center, std::sqrt(0.75) * size, gap, lists_[level]);
        if (size == 1) {
            cell(corner, lists_[level], here);
            return;
        }
        const int half = size / 2;
        for (int k = 0; k < 8; ++k)
            cube(corner + half * Vec3i(k & 1, k >> 1 & 1, k >> 2), half, level + 1, lists_[level], here);
    }

  private:
    bool inside(const Vec3i& node) const { return out_.inside_[out_.index(node)] != 0; }
    bool has_edge(const GridEdge& edge) const {
        return edge.node[edge.axis] + 1 < out_.rest_.node_count[edge.axis];
    }
    bool is_hole(const GridEdge& edge, std::size_t count) const {
        return count == 0 && inside(edge.node) != inside(edge.upper());
    }

    bool has_work(const Vec3i& node) const {
        for (int axis = 0; axis < 3; ++axis) {
            const GridEdge edge{node, axis};
            if (!has_edge(edge)) continue;
            const std::size_t count = out_.crossings(edge).size();
            if (count > 1 || is_hole(edge, count)) return true;
        }
        return false;
    }

    void cell(const Vec3i& node, const WindingTriangles& near, double moment) {
        mark(near);
        for (int axis = 0; axis < 3; ++axis) {
            const GridEdge edge{node, axis};
            if (!has_edge(edge)) continue;
            const std::span<const EdgeCrossing> crossings = out_.crossings(edge);
            if (crossings.size() > 1)
                divide(edge, crossings, near, moment);
            else if (is_hole(edge, crossings.size()))
                close(edge, near);
        }
    }

    void mark(const WindingTriangles& some) {
        ++serial_;
        for (std::size_t k = 0; k < some.size(); ++k) stamp_[some.id(k)] = serial_;
    }
    bool counts(const EdgeCrossing& c) const { return out_.has_area_[c.triangle] != 0; }
    bool marked(const EdgeCrossing& c, std::uint32_t serial) const {
        return counts(c) && stamp_[out_.jet_ids_[c.triangle]] >= serial;
    }

    Vec3 point(const GridEdge& edge, double t) const {
        return out_.centered(edge.node.cast<double>() + t * Vec3::Unit(edge.axis));
    }

    // Returns the sum over all triangles at a node.
    Taylor whole(const Vec3i& node, int axis) {
        const NodeJet& jet = out_.nodes_[out_.index(node)];
        sound_ = sound_ && jet.sound;
        error2_ += static_cast<double>(jet.error2);
        const auto k = static_cast<std::size_t>(axis);
        return {jet.value, static_cast<double>(jet.gradient[k]), static_cast<double>(jet.second[k])};
    }
    Taylor sum(const WindingTriangles& some, const GridEdge& edge, double t) {
        const WindingJet jet = out_.jets_.jet(some, point(edge, t));
        sound_ = sound_ && jet.sound;
        return point_along(jet, edge.axis);
    }

    // Returns the jumps of the marked triangles that the edge crosses before t; corrected by them, a
    // triangle's winding number is continuous along the edge.
    double steps(std::span<const EdgeCrossing> crossings, double t, std::uint32_t serial) const {
        double out = 0;
        for (const EdgeCrossing& c : crossings)
            if (c.parameter < t && marked(c, serial)) out += c.direction;
        return out;
    }

    static bool close_to(std::span<const EdgeCrossing> crossings, double t) {
        return std::any_of(crossings.begin(), crossings.end(), [&](const EdgeCrossing& c) {
            return std::abs(c.parameter - t) < tuning::soup_edges::crossing_resolution;
        });
    }

    // A part of an edge with the sums over all triangles, without their jumps, at both ends.
    struct Part {
        double begin, end;
        Taylor low, high;
        double error;  // of the polynomial and of the values that it interpolates
    };

    void divide(const GridEdge& edge, std::span<const EdgeCrossing> crossings, const WindingTriangles& near,
                double moment) {
        const std::uint32_t near_serial = serial_;
        sound_ = !close_to(crossings, 0) && !close_to(crossings, 1);
        error2_ = 0;
        const Taylor low = whole(edge.node, edge.axis);
        Taylor high = whole(edge.upper(), edge.axis);
        if (!sound_) return;
        for (const EdgeCrossing& c : crossings)
            if (counts(c)) high.value += c.direction;
        const std::size_t n = crossings.size();
        const int count = n <= 8 ? 1 : n <= 24 ? 2 : n <= 96 ? 4 : 8;
        const double error = quintic_error * moment;
        if (count == 1) return decide(edge, crossings, near, {0, 1, low, high, error + rounding(error2_)});
        Taylor last = sum(near, edge, 1);
        last.value += steps(crossings, 1, near_serial);
        const Quintic far(low - sum(near, edge, 0), high - last, 0, 1);
        Taylor from = low;
        bool was_sound = true;
        const double h = 1.0 / count;
        for (int k = 1; k <= count; ++k) {
            const double begin = (k - 1) * h, end = k * h;
            Taylor to = high;
            bool is_sound = true;
            if (k < count) {
                sound_ = !close_to(crossings, end);
                to = sum(near, edge, end) + far.at(end);
                to.value += steps(crossings, end, near_serial);
                is_sound = sound_;
            }
            if (was_sound && is_sound) {
                const double left_out = near.near(point(edge, begin + 0.5 * h), 0.5 * h, h, closest_);
                mark(closest_);
                const double own = quintic_error * std::pow(h, 6) * (moment + left_out);
                sound_ = true;
                decide(edge, crossings, closest_,
                       {begin, end, from, to, inherited * error + own + rounding(error2_)});
            }
            from = to;
            was_sound = is_sound;
        }
        mark(near);
    }

    // Decides the stretches whose middle lies in a part; `near` must have been marked last.
    void decide(const GridEdge& edge, std::span<const EdgeCrossing> crossings, const WindingTriangles& near,
                const Part& part) {
        Taylor low = sum(near, edge, part.begin), high = sum(near, edge, part.end);
        low.value += steps(crossings, part.begin, serial_);
        high.value += steps(crossings, part.end, serial_);
        if (!sound_) return;
        const Quintic far(part.low - low, part.high - high, part.begin, part.end);
        double behind = 0;
        const auto first = static_cast<std::size_t>(crossings.data() - out_.sweep_.crossings.data());
        for (std::size_t k = 0; k + 1 < crossings.size(); ++k) {
            if (counts(crossings[k]) && !marked(crossings[k], serial_)) behind += crossings[k].direction;
            const double a = crossings[k].parameter, b = crossings[k + 1].parameter, t = 0.5 * (a + b);
            if (b - a < 4 * tuning::soup_edges::crossing_resolution || t < part.begin || t >= part.end)
                continue;
            const WindingJet here = out_.jets_.value(near, point(edge, t));
            const double size = std::abs(far.at(t).value - behind + here.value);
            const double error = part.error + rounding(here.error2) + tuning::soup_edges::tree_error;
            if (here.sound && std::abs(size - 0.5) > error) out_.after_[first + k] = size > 0.5;
        }
    }

    // Cuts an edge that no triangle crosses: the polynomial gives the approximate position, which the sum
    // over all triangles corrects.
    void close(const GridEdge& edge, const WindingTriangles& near) {
        sound_ = true;
        const Taylor low = whole(edge.node, edge.axis) - sum(near, edge, 0);
        const Taylor high = whole(edge.upper(), edge.axis) - sum(near, edge, 1);
        if (!sound_) return;
        const Quintic far(low, high, 0, 1);
        const bool lower = inside(edge.node);
        const auto value = [&](double t) {
            return far.at(t).value + out_.jets_.value(near, point(edge, t)).value;
        };
        double correction = 0, t = 0.5;
        WindingJet jet;
        for (int round = 0; round < 2; ++round) {
            double a = 0, b = 1;
            for (int k = 0; k < 20; ++k) {
                const double middle = 0.5 * (a + b);
                ((std::abs(value(middle) + correction) > 0.5) == lower ? a : b) = middle;
            }
            t = 0.5 * (a + b);
            if (round == 1) break;
            jet = out_.jets_.jet(out_.jets_.triangles(), point(edge, t));
            correction = jet.value - value(t);
        }
        if (!jet.sound) return;
        holes.push_back({edge, t, jet.value > 0 ? Vec3(-jet.gradient) : jet.gradient});
    }

    SoupEdges& out_;
    std::vector<std::uint32_t> stamp_;  // by triangle: serial of its last mark
    std::uint32_t serial_ = 0;
    WindingTriangles lists_[4], closest_;
    bool sound_ = true;
    double error2_ = 0;
};

void SoupEdges::set_edges(const Parallel& parallel) {
    constexpr int side = tuning::soup_edges::cube_side;
    const Vec3i cubes = (rest_.node_count + Vec3i::Constant(side - 1)) / side;
    const auto count = static_cast<std::size_t>(cubes.prod());
    std::vector<std::vector<BoundaryCut>> holes(count);
    parallel.for_each(count, 1, [&](std::size_t i) {
        const auto k = static_cast<int>(i);
        Worker worker(*this);
        worker.cube(side * Vec3i(k % cubes[0], k / cubes[0] % cubes[1], k / (cubes[0] * cubes[1])), side, 0,
                    jets_.triangles(), 0);
        holes[i] = std::move(worker.holes);
    });
    for (const std::vector<BoundaryCut>& some : holes) holes_.insert(holes_.end(), some.begin(), some.end());
}

}  // namespace splitcubes::splitting
