#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/scene/implicit_model.h>
#include <splitcubes/scene/tuning.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/node_grid.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::scene {

namespace {

using splitting::GridEdge;

// Returns the signed distance to the part, m, negative inside; approximate away from the surface.
double value_of(const ImplicitPart& part, const Vec3& p) {
    if (const auto* ball = std::get_if<BallPart>(&part.form)) {
        const Vec3 scaled = (p - ball->center).cwiseQuotient(ball->radii);
        const double level = scaled.norm(), slope = scaled.cwiseQuotient(ball->radii).norm();
        return slope > 0 ? level * (level - 1) / slope : -ball->radii.minCoeff();
    }
    const auto& cone = std::get<ConePart>(part.form);
    const Vec3 axis = cone.to - cone.from;
    const double along = std::clamp((p - cone.from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    return (p - cone.from - along * axis).norm() -
           (cone.from_radius + along * (cone.to_radius - cone.from_radius));
}

// Polynomial smooth minimum: blends values that differ by less than `smoothness`.
double smooth_minimum(double a, double b, double smoothness) {
    if (!(smoothness > 0)) return std::min(a, b);
    const double overlap = std::max(smoothness - std::abs(a - b), 0.0) / smoothness;
    return std::min(a, b) - 0.25 * overlap * overlap * smoothness;
}

class Field {
  public:
    explicit Field(const ImplicitShape& shape) : shape_(shape) {}
    double value(const Vec3& p) const {
        double out = value_of(shape_.parts[0], p);
        for (std::size_t k = 1; k < shape_.parts.size(); ++k)
            out = smooth_minimum(out, value_of(shape_.parts[k], p), shape_.smoothness);
        return out;
    }
    Vec3 gradient(const Vec3& p, double step) const {
        Vec3 out;
        for (int k = 0; k < 3; ++k) {
            const Vec3 d = step * Vec3::Unit(k);
            out[k] = value(p + d) - value(p - d);
        }
        return out;
    }
    // Returns the colour of the deepest part; the last of equal ones, so that later parts paint over earlier
    // ones.
    const Vec3& colour(const Vec3& p) const {
        const ImplicitPart* best = &shape_.parts[0];
        double deepest = value_of(*best, p);
        for (const ImplicitPart& part : shape_.parts) {
            const double value = value_of(part, p);
            if (value <= deepest) {
                best = &part;
                deepest = value;
            }
        }
        return best->colour;
    }

  private:
    const ImplicitShape& shape_;
};

geometry::Box bounds_of_shape(const ImplicitShape& shape) {
    geometry::Box box;
    for (const ImplicitPart& part : shape.parts) {
        if (const auto* ball = std::get_if<BallPart>(&part.form)) {
            box.add(geometry::Box{ball->center - ball->radii, ball->center + ball->radii});
            continue;
        }
        const auto& cone = std::get<ConePart>(part.form);
        box.add(geometry::Box{cone.from, cone.from}.grown(cone.from_radius));
        box.add(geometry::Box{cone.to, cone.to}.grown(cone.to_radius));
    }
    return box.grown(0.25 * shape.smoothness);
}

struct SkinCut {
    GridEdge edge;
    double parameter;
    Vec3 normal;
};

SkinCut boundary_cut(const splitting::NodeGrid& grid, const Field& field, const GridEdge& edge) {
    const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
    double low = 0, high = 1;
    const bool inside = grid.inside(edge.node);
    for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        ((field.value(a + middle * (b - a)) < 0) == inside ? low : high) = middle;
    }
    return {edge, low, field.gradient(a + low * (b - a), 1e-3 * grid.rest().cell_size)};
}

void set_inside(splitting::NodeGrid& grid, const Field& field, const Parallel& parallel) {
    const Vec3i count = grid.rest().node_count;
    const auto row_length = static_cast<std::size_t>(count[0]);
    const auto rows = static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(count[2]);
    std::vector<std::uint8_t> inside(rows * row_length, 0);
    parallel.for_each(rows, 4, [&](std::size_t row) {
        const int y = static_cast<int>(row) % count[1], z = static_cast<int>(row) / count[1];
        if (y == 0 || z == 0 || y + 1 == count[1] || z + 1 == count[2]) return;
        for (int x = 1; x + 1 < count[0]; ++x)
            inside[row * row_length + static_cast<std::size_t>(x)] =
                field.value(grid.rest().node_position({x, y, z})) < 0;
    });
    for (std::size_t row = 0; row < rows; ++row)
        for (int x = 1; x + 1 < count[0]; ++x)
            if (inside[row * row_length + static_cast<std::size_t>(x)] != 0)
                grid.set_inside_row(static_cast<int>(row) % count[1], static_cast<int>(row) / count[1], x,
                                    x + 1);
}

splitting::NodeGrid grid_of(const ImplicitShape& shape, const Field& field, const Parallel& parallel) {
    const geometry::Box box = bounds_of_shape(shape);
    const geometry::RestGrid rest = geometry::grid_around(box, geometry::cell_size_for(box, shape.cells));
    const Vec3 n = rest.node_count.cast<double>();
    // Bytes, measured on solids; assumes that the surface is as large as that of the bounding box.
    constexpr double per_node = tuning::build::implicit_bytes_per_node,
                     per_face = tuning::build::implicit_bytes_per_face;
    require_memory("implicit shape",
                   per_node * n.prod() + per_face * 2 * (n[0] * n[1] + n[1] * n[2] + n[2] * n[0]),
                   "give it fewer cells");
    splitting::NodeGrid grid(rest);
    const Vec3i count = grid.rest().node_count;
    set_inside(grid, field, parallel);
    std::vector<GridEdge> edges;
    for (int z = 0; z < count[2]; ++z)
        for (int y = 0; y < count[1]; ++y)
            for (int x = 0; x < count[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (grid.has_edge(edge) && grid.inside(edge.node) != grid.inside(edge.upper()))
                        edges.push_back(edge);
                }
    std::vector<SkinCut> cuts(edges.size());
    parallel.for_each(edges.size(), 16,
                      [&](std::size_t k) { cuts[k] = boundary_cut(grid, field, edges[k]); });
    for (const SkinCut& cut : cuts)
        grid.cut(cut.edge, cut.parameter, cut.normal, splitting::Origin::boundary, -1);
    return grid;
}

}  // namespace

io::Model implicit_model(const ImplicitShape& shape, const std::string& body, const Parallel& parallel) {
    const Field field(shape);
    const splitting::NodeGrid grid = grid_of(shape, field, parallel);
    if (grid.inside_count() == 0)
        throw InputError("body '" + body + "'", "its implicit shape is thinner than its grid",
                         "give it more cells");
    const splitting::Surface surface(grid, parallel);
    io::Model model;
    model.mesh = splitting::extract(grid, surface, splitting::Pieces(grid), {}, {}, parallel).mesh;
    model.attributes.corner_colour.resize(model.mesh.triangles.size());
    parallel.for_each(model.mesh.triangles.size(), 64, [&](std::size_t t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f colour = field.colour(model.mesh.positions[model.mesh.triangles[t][k]]).cast<float>();
            model.attributes.corner_colour[t][k] = {colour[0], colour[1], colour[2], 1.0F};
        }
    });
    return model;
}

}  // namespace splitcubes::scene
