// Solid of a mesh that is not closed or not consistently oriented: inside is where the generalised winding
// number exceeds one half.
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/winding_number.h>
#include <splitcubes/splitting/boundary_crossings.h>
#include <splitcubes/splitting/soup_edges.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace splitcubes::splitting {

using geometry::EdgeCrossing;
using geometry::GridCrossings;
using geometry::TriangleMesh;

namespace {

// Bound on the gradient of the winding number away from the triangles. There the number is the solid angle of
// the mesh's boundary (its unbalanced edges) over 4 pi, and its gradient the Biot-Savart integral over that
// curve: at most the integral of 1 / (4 pi d^2) over its length. Stored per brick of nodes; boundary length
// is summed per brick.
class GradientBound {
  public:
    GradientBound(const TriangleMesh& mesh, const RestGrid& rest, const Parallel& parallel)
        : layout_(rest.node_count), bound_(layout_.total(), 0) {
        for (const geometry::UnbalancedEdge& edge : geometry::unbalanced_edges(mesh))
            mark(rest.to_grid(mesh.positions[edge.low]), rest.to_grid(mesh.positions[edge.high]),
                 edge.balance);
        std::vector<Mark> marks;
        for (std::size_t brick = 0; brick < length_.size(); ++brick)
            if (length_[brick] > 0) marks.push_back({layout_.base(brick) / brick_side, length_[brick]});
        const bool boundary_everywhere =
            endless_ || static_cast<double>(marks.size()) * static_cast<double>(layout_.total()) >
                            tuning::solidify::max_gradient_work;
        if (marks.empty() && !endless_) return;
        parallel.for_each(layout_.total(), 64, [&](std::size_t brick) {
            bound_[brick] = boundary_everywhere ? std::numeric_limits<double>::infinity()
                                                : sum_at(layout_.base(brick) / brick_side, marks);
        });
    }

    /// Returns the bound per cell of distance, anywhere in the node's brick or within a cell of it.
    double at(const Vec3i& node) const { return bound_[layout_.brick_of(node)]; }

  private:
    struct Mark {
        Vec3i brick;
        double length;  // cells, times the imbalance of the edge
    };

    static double sum_at(const Vec3i& brick, const std::vector<Mark>& marks) {
        double sum = 0;
        for (const Mark& mark : marks) {
            // One brick for the positions of node and edge within theirs, half for the marks' spacing, a
            // quarter for the surrounding cell.
            const Vec3 apart = (brick - mark.brick).cwiseAbs().cast<double>();
            const Vec3 gap = brick_side * (apart - Vec3::Constant(1.75)).cwiseMax(0);
            sum += mark.length / gap.squaredNorm();  // infinite where they may touch
        }
        return sum / (4 * std::numbers::pi);
    }

    // Adds an edge's length to the bricks along it, in steps of half a brick.
    void mark(const Vec3& a, const Vec3& b, std::uint32_t balance) {
        if (length_.empty()) length_.assign(layout_.total(), 0);
        const Vec3 top = (brick_side * layout_.brick_count - Vec3i::Ones()).cast<double>();
        const double steps = std::max(1.0, std::ceil((b - a).norm() / (0.5 * brick_side)));
        endless_ = endless_ || !(steps < 10000);
        if (endless_) return;
        for (double k = 0; k <= steps; ++k) {
            // Clamping to the grid only reduces distances, which keeps the bound valid.
            const Vec3 at = (a + k / steps * (b - a)).cwiseMax(0).cwiseMin(top);
            length_[layout_.brick_of(at.cast<int>())] += balance * (b - a).norm() / steps;
        }
    }

    BrickLayout layout_;
    std::vector<double> length_;  // per brick, cells
    std::vector<double> bound_;   // per brick
    bool endless_ = false;        // an edge is too long to follow
};

class WindingSolid {
  public:
    WindingSolid(const TriangleMesh& mesh, const RestGrid& rest, const Parallel& parallel)
        : mesh_(mesh),
          parallel_(parallel),
          winding_(mesh),
          sweep_(geometry::sweep_grid(rest, mesh, parallel)),
          grid_(rest) {
        if (SoupEdges::pays(winding_, mesh, rest))
            soup_.emplace(mesh, grid_.rest(), sweep_, winding_, parallel);
    }

    NodeGrid solidify(SolidifyReport& report) {
        set_inside();
        BoundaryPart boundary = for_each_edge(
            sweep_, parallel_, [&](BoundaryPart& part, std::span<const EdgeCrossing> crossings, int&) {
                process(part, crossings);
            });
        cut_boundary_edges(grid_, boundary.cuts);
        if (soup_) cut_boundary_edges(grid_, soup_->holes());
        const BoundaryPart holes = close_holes();
        cut_boundary_edges(grid_, holes.cuts);
        report.gap_edges = boundary.gap_edges;
        report.bisected_edges = holes.cuts.size() + (soup_ ? soup_->holes().size() : 0);
        report_thin(mesh_, grid_.rest(), boundary.lost, report);
        return std::move(grid_);
    }

  private:
    Vec3 point(const GridEdge& edge, double parameter) const {
        return grid_.rest().node_position(edge.node) +
               parameter * grid_.rest().cell_size * Vec3::Unit(edge.axis);
    }
    bool inside_at(const GridEdge& edge, double parameter) const {
        return soup_ ? soup_->inside_at(edge, parameter) : winding_.exceeds(point(edge, parameter), 0.5);
    }

    void set_inside() {
        if (soup_) return set_rows(soup_->inside());
        const Vec3i n = grid_.rest().node_count;
        const GradientBound bound(mesh_, grid_.rest(), parallel_);
        const auto row_count = static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
        // Index of the first crossing of each row along x.
        std::vector<std::uint32_t> first(row_count + 1, 0);
        for (std::size_t i = 0; i < sweep_.axis_begin[1]; ++i) {
            const Vec3i& node = sweep_.crossings[i].node;
            ++first[static_cast<std::size_t>(node[2] * n[1] + node[1]) + 1];
        }
        for (std::size_t row = 0; row < row_count; ++row) first[row + 1] += first[row];
        const auto length = static_cast<std::size_t>(n[0]);
        std::vector<std::uint8_t> inside(row_count * length, 0);
        parallel_.for_each(row_count, 4, [&](std::size_t row) {
            const Vec3i start(0, static_cast<int>(row) % n[1], static_cast<int>(row) / n[1]);
            if (start[1] == 0 || start[2] == 0 || start[1] == n[1] - 1 || start[2] == n[2] - 1) return;
            follow_row(start, {sweep_.crossings.data() + first[row], first[row + 1] - first[row]}, bound,
                       inside.data() + row * length);
        });
        set_rows(inside);
    }

    // inside: by node, x fastest, then y.
    void set_rows(const std::vector<std::uint8_t>& inside) {
        const Vec3i n = grid_.rest().node_count;
        const auto length = static_cast<std::size_t>(n[0]);
        for (std::size_t row = 0; row < inside.size() / length; ++row)
            for (int x = 0; x < n[0]; ++x) {
                int end = x;
                while (end < n[0] && inside[row * length + static_cast<std::size_t>(end)]) ++end;
                grid_.set_inside_row(static_cast<int>(row) % n[1], static_cast<int>(row) / n[1], x, end);
                x = end;
            }
    }

    // Sets a row of nodes. The winding number jumps by one at every triangle and changes slowly elsewhere: it
    // is evaluated again only if the bound on the change could matter.
    void follow_row(const Vec3i& start, std::span<const EdgeCrossing> crossings, const GradientBound& bound,
                    std::uint8_t* inside) const {
        double winding = 0, error = std::numeric_limits<double>::infinity();
        std::size_t next = 0;
        const int count = grid_.rest().node_count[0];
        for (int x = 1; x + 1 < count; ++x) {
            const Vec3i node(x, start[1], start[2]);
            for (; next < crossings.size() && crossings[next].node[0] < x; ++next)
                winding -= crossings[next].direction;
            error += bound.at(node);
            if (!(std::abs(std::abs(winding) - 0.5) > error)) {
                const Vec3 at = grid_.rest().node_position(node);
                const geometry::WindingNumber::Estimate quick = winding_.quick_at(at);
                const bool is_clear = std::abs(std::abs(quick.value) - 0.5) > quick.tolerance;
                winding = is_clear ? quick.value : winding_.at(at);
                error = tuning::solidify::evaluation_error;
            }
            inside[x] = std::abs(winding) > 0.5;
        }
    }

    void cut_at(BoundaryPart& part, const EdgeCrossing& c, double parameter) const {
        part.cuts.push_back({{c.node, c.axis}, parameter, geometry::triangle_normal(mesh_, c.triangle)});
    }

    // Processes an edge that triangles cross.
    void process(BoundaryPart& part, std::span<const EdgeCrossing> crossings) const {
        const GridEdge edge{crossings[0].node, crossings[0].axis};
        const bool lower = grid_.inside(edge.node), upper = grid_.inside(edge.upper());
        if (lower != upper && crossings.size() == 1)
            return cut_at(part, crossings[0], crossings[0].parameter);
        if (lower == upper && crossings.size() == 1) return;
        Stretches inside(*this, edge, crossings, lower, upper);
        if (!lower || !upper) note_detached(part, crossings, inside);
        if (lower != upper) {
            // The first change of state as seen from the inside node.
            std::size_t k = lower ? 0 : crossings.size() - 1;
            while (inside.at(k) == inside.at(k + 1)) lower ? ++k : --k;
            return cut_at(part, crossings[k], crossings[k].parameter);
        }
        for (std::size_t k = 1; lower && k < crossings.size(); ++k) {
            if (inside.at(k)) continue;
            ++part.gap_edges;
            return cut_at(part, crossings[k - 1],
                          0.5 * (crossings[k - 1].parameter + crossings[k].parameter));
        }
    }

    // Inside state of the stretches of an edge between its crossings, evaluated lazily.
    class Stretches {
      public:
        Stretches(const WindingSolid& solid, const GridEdge& edge, std::span<const EdgeCrossing> crossings,
                  bool lower, bool upper)
            : solid_(solid), edge_(edge), crossings_(crossings), state_(crossings.size() + 1, unknown) {
            if (solid.soup_) {
                const auto first = crossings.data() - solid.sweep_.crossings.data();
                std::copy_n(solid.soup_->after().begin() + first, crossings.size(), state_.begin() + 1);
            }
            state_.front() = lower;
            state_.back() = upper;
        }
        bool at(std::size_t k) {
            if (state_[k] == unknown)
                state_[k] =
                    solid_.inside_at(edge_, 0.5 * (crossings_[k - 1].parameter + crossings_[k].parameter));
            return state_[k] != 0;
        }

      private:
        static constexpr std::uint8_t unknown = SoupEdges::unknown;
        const WindingSolid& solid_;
        const GridEdge& edge_;
        std::span<const EdgeCrossing> crossings_;
        std::vector<std::uint8_t> state_;
    };

    // Counts material that starts and ends on the edge and so reaches neither node.
    void note_detached(BoundaryPart& part, std::span<const EdgeCrossing> crossings, Stretches& inside) const {
        for (std::size_t k = 1; k < crossings.size(); ++k)
            if (inside.at(k) && !inside.at(k - 1) && !inside.at(k + 1))
                return note_thin(grid_, mesh_, crossings[k - 1], crossings[k], part);
    }

    // Cuts edges between inside and outside that no triangle crosses: the level set of the winding number
    // passes through a hole of the mesh.
    BoundaryPart close_holes() const {
        const Vec3i n = grid_.rest().node_count;
        const auto row_count = static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
        constexpr std::size_t grain = 64;
        std::vector<BoundaryPart> parts((row_count + grain - 1) / grain);
        parallel_.for_each(row_count, grain, [&](std::size_t row) {
            for (int x = 0; x < n[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, static_cast<int>(row) % n[1], static_cast<int>(row) / n[1]},
                                        axis};
                    if (!grid_.has_edge(edge) || grid_.is_cut(edge)) continue;
                    if (grid_.inside(edge.node) != grid_.inside(edge.upper()))
                        bisect(edge, parts[row / grain]);
                }
        });
        BoundaryPart whole;
        for (BoundaryPart& part : parts) whole.append(std::move(part));
        return whole;
    }

    void bisect(const GridEdge& edge, BoundaryPart& part) const {
        const bool lower = grid_.inside(edge.node);
        double a = 0, b = 1;
        for (int k = 0; k < 20; ++k) {
            const double middle = 0.5 * (a + b);
            (inside_at(edge, middle) == lower ? a : b) = middle;
        }
        const double parameter = 0.5 * (a + b);
        const Vec3 at = point(edge, parameter);
        const double step = 0.05 * grid_.rest().cell_size;
        Vec3 gradient;
        for (int axis = 0; axis < 3; ++axis)
            gradient[axis] = std::abs(value_at(at + step * Vec3::Unit(axis))) -
                             std::abs(value_at(at - step * Vec3::Unit(axis)));
        part.cuts.push_back({edge, parameter, -gradient});
    }

    // Exact for meshes with holes; for a soup the last digits are not worth the time.
    double value_at(const Vec3& at) const {
        const geometry::WindingNumber::Estimate quick = winding_.quick_at(at);
        return quick.near_count > tuning::solidify::max_near_triangles ? quick.value : winding_.at(at);
    }

    const TriangleMesh& mesh_;
    const Parallel& parallel_;
    const geometry::WindingNumber winding_;
    const GridCrossings sweep_;
    NodeGrid grid_;
    std::optional<SoupEdges> soup_;
};

}  // namespace

NodeGrid solidify_by_winding(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                             const Parallel& parallel) {
    return WindingSolid(mesh, rest, parallel).solidify(report);
}

}  // namespace splitcubes::splitting
