#include <splitcubes/body/body.h>
#include <splitcubes/body/thin_parts.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/scene/advice.h>
#include <splitcubes/scene/tuning.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>

namespace splitcubes::scene {

namespace {

std::string rounded(double value, int digits = 2) {
    return plain_number(value, digits);
}

std::string percent(double share) {
    return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}

// Describes the error in bending stiffness with so many phyxels across (docs/validation.md).
const char* softness(int across) {
    return across <= 2 ? "at least twice as soft as it should be" : "some 80 % too soft";
}

bool is_elastic(const body::Body& body) {
    return !body.is_lattice_driven();
}

// Returns the side lengths, m, longest first, of the box that has the same second moments as the phyxels,
// along their principal axes.
Vec3 principal_extents(const body::Body& body) {
    const auto& rest = body.phyxels().rest_position;
    Vec3 centre = Vec3::Zero();
    for (const Vec3& p : rest) centre += p;
    centre /= static_cast<double>(rest.size());
    Mat3 moments = Mat3::Zero();
    for (const Vec3& p : rest) moments += (p - centre) * (p - centre).transpose();
    moments /= static_cast<double>(rest.size());
    const double spacing = body.phyxel_spacing();
    const Vec3 values = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvalues();
    // Adds the extent of the cube that each phyxel represents.
    return (12 * values.array().max(0) + spacing * spacing).sqrt().matrix().reverse();
}

// Returns the distance, m, from the region held at time 0 to the phyxel farthest from it. No value: nothing
// is held. 0: everything is.
std::optional<double> free_length(const body::Body& body) {
    const auto& rest = body.phyxels().rest_position;
    std::vector<std::uint8_t> is_held(rest.size(), 0);
    for (const body::HoldConstraint& constraint : body.constraints()) {
        if (constraint.from > 0) continue;
        for (std::size_t i = 0; i < rest.size(); ++i)
            if (constraint.region(body.pose() * rest[i])) is_held[i] = 1;
    }
    std::vector<Vec3> held_positions;
    for (std::size_t i = 0; i < rest.size(); ++i)
        if (is_held[i]) held_positions.push_back(rest[i]);
    if (held_positions.empty()) return std::nullopt;
    // About a hundred held phyxels suffice for the distance.
    const std::size_t every = 1 + held_positions.size() / 100;
    double farthest = 0;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        if (is_held[i]) continue;
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < held_positions.size(); k += every)
            nearest = std::min(nearest, (held_positions[k] - rest[i]).squaredNorm());
        farthest = std::max(farthest, nearest);
    }
    return std::sqrt(farthest);
}

// Estimates the lowest natural frequency, Hz, as that of a beam with the body's extents in bending or
// stretching. 0: there is none.
double slowest_frequency(const body::Body& body) {
    const meshless::Material& material = body.settings().material;
    const double speed = std::sqrt(material.youngs_modulus / material.density);
    const Vec3 extents = principal_extents(body);
    const std::optional<double> length = free_length(body);
    if (length) {
        if (*length <= 0) return 0;
        // First roots of a clamped-free beam: 1.875 (bending), pi / 2 (stretching).
        return std::min(0.1615 * extents[2] * speed / (*length * *length), speed / (4 * *length));
    }
    const double whole = extents[0];
    return std::min(1.028 * extents[2] * speed / (whole * whole), speed / (2 * whole));
}

// Returns the largest time step that keeps at least `share` of the amplitude per period.
double keeping_step(double angular_frequency, meshless::TimeScheme scheme, double share) {
    double low = 0, high = 10 / angular_frequency;
    for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (kept_per_period(angular_frequency, middle, scheme) >= share ? low : high) = middle;
    }
    return low;
}

geometry::Box bounds_of_body(const body::Body& body) {
    geometry::Box out;
    for (const Vec3& p : body.vertex_positions()) out.add(p);
    return out;
}

// Bounds the nodes of one body's grid that lie inside the other's solid at time 0; m, world.
geometry::Box common_nodes(const body::Body& of, const body::Body& with, const geometry::Box& where) {
    constexpr double max_nodes = tuning::advice::max_overlap_nodes;
    const splitting::NodeGrid &a = of.grid(), &b = with.grid();
    const geometry::RestGrid& rest = a.rest();
    const Isometry own = of.pose().inverse(), other_own = with.pose().inverse();
    geometry::Box near;
    for (int k = 0; k < 8; ++k)
        near.add(own * Vec3((k & 1) != 0 ? where.max.x() : where.min.x(),
                            (k & 2) != 0 ? where.max.y() : where.min.y(),
                            (k & 4) != 0 ? where.max.z() : where.min.z()));
    const Vec3i low = rest.to_grid(near.min).array().floor().cast<int>().max(0);
    const Vec3i high = rest.to_grid(near.max).array().ceil().cast<int>().min(rest.node_count.array() - 1);
    const int stride = std::max(1, static_cast<int>(std::ceil(std::cbrt(
                                       (high - low + Vec3i::Ones()).cast<double>().prod() / max_nodes))));
    geometry::Box out;
    for (int z = low[2]; z <= high[2]; z += stride)
        for (int y = low[1]; y <= high[1]; y += stride)
            for (int x = low[0]; x <= high[0]; x += stride) {
                if (!a.inside({x, y, z})) continue;
                const Vec3 position = of.pose() * rest.node_position({x, y, z});
                const Vec3i other = b.rest().to_grid(other_own * position).array().round().cast<int>();
                if (b.rest().contains(other) && b.inside(other)) out.add(position);
            }
    return out;
}

// Describes what contact does with an overlap: the initial penetration becomes the springs' rest gap, and an
// overlap deeper than a phyxel spacing is not detected (docs/contact.md).
std::string fate_of_overlap(const body::Body& a, const body::Body& b, double depth) {
    const double detected_depth = std::max(a.phyxel_spacing(), b.phyxel_spacing());
    const std::string stays = "contact keeps the overlap and removes little of it";
    if (depth < detected_depth) return stays;
    return "where the overlap is deeper than a phyxel spacing (" + rounded(detected_depth) +
           " m) contact does not detect it, and the bodies pass through each other";
}

void note_body_overlaps(const body::World& world, Notes& notes) {
    const auto& bodies = world.bodies();
    std::vector<geometry::Box> bounds;
    for (const auto& body : bodies) bounds.push_back(bounds_of_body(*body));
    std::size_t found = 0;
    for (std::size_t a = 0; a < bodies.size(); ++a)
        for (std::size_t b = a + 1; b < bodies.size(); ++b) {
            if (bodies[a]->is_lattice_driven() || bodies[b]->is_lattice_driven() ||
                !bounds[a].meets(bounds[b]))
                continue;
            const geometry::Box both{bounds[a].min.cwiseMax(bounds[b].min),
                                     bounds[a].max.cwiseMin(bounds[b].max)};
            const double cell =
                std::max(bodies[a]->grid().rest().cell_size, bodies[b]->grid().rest().cell_size);
            if (both.size().minCoeff() < cell) continue;
            const geometry::Box common = common_nodes(*bodies[a], *bodies[b], both);
            // Overlaps thinner than a cell may be discretisation error.
            if (common.empty() || common.size().minCoeff() < cell) continue;
            if (++found > tuning::advice::max_overlap_notes) continue;
            const Vec3 size = common.size();
            notes.push_back({bodies[a]->name(),
                             "overlaps '" + bodies[b]->name() + "' at the start, over " + rounded(size[0]) +
                                 " x " + rounded(size[1]) + " x " + rounded(size[2]) +
                                 " m: " + fate_of_overlap(*bodies[a], *bodies[b], size.minCoeff() + cell) +
                                 "; move them apart"});
        }
    if (found > tuning::advice::max_overlap_notes)
        notes.push_back({"scene", std::to_string(found - tuning::advice::max_overlap_notes) +
                                      " more pairs of bodies overlap"});
}

// Mass-spring nodes are projected onto the ground in the first step; contact resolves the penetration of
// phyxels gradually.
std::string fate_in_collider(const body::Body& body) {
    if (body.is_lattice_driven()) return "which pushes it out at once";
    return "which pushes it out slowly, and only while something presses on it";
}

void note_collider_overlaps(const body::World& world, std::span<const std::uint8_t> prescribed,
                            Notes& notes) {
    std::size_t found = 0;
    const auto& colliders = world.colliders();
    for (std::size_t b = 0; b < world.bodies().size(); ++b)
        for (std::size_t c = 0; c < colliders.size(); ++c) {
            const auto& body = world.bodies()[b];
            const bool is_ground = c == 0 && world.settings().ground.has_value();
            // Mass-spring bodies collide with the ground only.
            if (prescribed[b] != 0 || (body->is_lattice_driven() && !is_ground)) continue;
            const Isometry own = colliders[c].at(0).inverse();
            double deepest = 0;
            for (const Vec3& p : body->vertex_positions())
                deepest = std::max(deepest, -colliders[c].solid->at(own * p).distance);
            if (deepest < body->grid().rest().cell_size || ++found > tuning::advice::max_overlap_notes)
                continue;
            notes.push_back({body->name(), "begins " + rounded(deepest) + " m inside '" + colliders[c].name +
                                               "', " + fate_in_collider(*body) + "; place it outside"});
        }
    if (found > tuning::advice::max_overlap_notes)
        notes.push_back({"scene", std::to_string(found - tuning::advice::max_overlap_notes) +
                                      " more bodies begin inside a collider"});
}

// Returns the amplification of one step for y' = z y / step.
std::complex<double> amplification(const std::complex<double>& z, meshless::TimeScheme scheme) {
    if (scheme == meshless::TimeScheme::backward_euler) return 1.0 / (1.0 - z);
    if (scheme == meshless::TimeScheme::bdf2) return (2.0 + std::sqrt(1.0 + 2.0 * z)) / (3.0 - 2.0 * z);
    const double gamma = 2 - std::sqrt(2.0), rest = 1 - gamma;
    const std::complex<double> middle = (1.0 + 0.5 * gamma * z) / (1.0 - 0.5 * gamma * z);
    return (middle - rest * rest) / (gamma * (2 - gamma) - gamma * rest * z);
}

}  // namespace

double kept_per_period(double angular_frequency, double time_step, meshless::TimeScheme scheme) {
    const std::complex<double> factor =
        amplification(std::complex<double>(0, angular_frequency * time_step), scheme);
    const double angle = std::arg(factor);
    if (!(angle > 0)) return angular_frequency * time_step > 0 ? 0 : 1;
    return std::pow(std::abs(factor), 2 * std::numbers::pi / angle);
}

void note_few_phyxels(const body::World& world, Notes& notes) {
    constexpr double min_share = tuning::advice::min_thin_share;
    constexpr int min_across = tuning::advice::min_phyxels_across;
    for (const auto& body : world.bodies()) {
        if (!is_elastic(*body)) continue;
        const double spacing = body->phyxel_spacing();
        const body::ThinParts thin = body::thin_parts(body->grid(), (min_across - 0.5) * spacing);
        if (thin.share < min_share) continue;
        const int across = std::max(1, static_cast<int>(std::lround(thin.thickness / spacing)));
        const double wanted = thin.thickness / 6;
        const double count = static_cast<double>(body->phyxels().size()) * std::pow(spacing / wanted, 3);
        notes.push_back(
            {body->name(), (thin.share > 0.95 ? std::string("it") : percent(thin.share) + " of its volume") +
                               " is about " + rounded(thin.thickness) + " m thick and has " +
                               std::to_string(across) + (across == 1 ? " phyxel" : " phyxels") +
                               " across: bending is " + softness(across) + "; phyxel_spacing " +
                               rounded(wanted) + " puts six across (about " +
                               std::to_string(std::lround(count)) + " phyxels, " +
                               std::to_string(body->phyxels().size()) + " now)"});
    }
}

void note_damping_step(const body::World& world, Notes& notes) {
    constexpr double seen_below = tuning::advice::max_visible_frequency;
    constexpr double max_loss = tuning::advice::max_amplitude_loss;
    constexpr double wanted = tuning::advice::suggested_amplitude;
    const body::WorldSettings& settings = world.settings();
    if (settings.solver.kind == meshless::SolverKind::explicit_steps) return;
    for (const auto& body : world.bodies()) {
        if (!is_elastic(*body)) continue;
        const double frequency = slowest_frequency(*body), w = 2 * std::numbers::pi * frequency;
        if (!(frequency > 0) || frequency > seen_below) continue;
        const meshless::Material& material = body->settings().material;
        const double own =
            std::exp(-std::numbers::pi * (material.mass_damping / w + material.stiffness_damping * w));
        const double kept = kept_per_period(w, settings.time_step, settings.solver.scheme);
        if (kept > 1 - max_loss || own < 1 - max_loss) continue;
        notes.push_back(
            {body->name(),
             "its slowest vibration, at about " + rounded(frequency) + " Hz, loses " + percent(1 - kept) +
                 " of its amplitude in each period because of the time step of " +
                 rounded(settings.time_step) + " s alone; time_step " +
                 rounded(keeping_step(w, settings.solver.scheme, wanted)) +
                 (settings.solver.scheme == meshless::TimeScheme::tr_bdf2
                      ? ""
                      : ", or solver.integrator tr_bdf2 and " +
                            rounded(keeping_step(w, meshless::TimeScheme::tr_bdf2, wanted)) + ",") +
                 " keeps " + percent(wanted)});
    }
}

void note_overlaps(const body::World& world, std::span<const std::uint8_t> prescribed, Notes& notes) {
    if (world.settings().contact.pieces) note_body_overlaps(world, notes);
    note_collider_overlaps(world, prescribed, notes);
}

}  // namespace splitcubes::scene
