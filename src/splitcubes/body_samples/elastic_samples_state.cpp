// Saves elastic samples to a checkpoint and restores them. Every stored number is checked when it is read.
#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/math/state_numbers.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {

namespace {

// Least stored bytes of a phyxel: bounds the count that is read.
constexpr std::size_t bytes_of_phyxel = 339;

}  // namespace

void ElasticSamples::save(const splitting::NodeGrid& grid, const meshless::Material& material,
                          StateWriter& writer) const {
    save_phyxels(grid, material, writer);
    save_lumping(writer);
    save_rigid(writer);
    save_pairs(writer);
}

void ElasticSamples::load(const SampleContext& context, StateReader& reader) {
    load_phyxels(context, reader);
    load_lumping(context, reader);
    load_rigid(context, reader);
    load_pairs(reader);
}

void ElasticSamples::save_phyxels(const splitting::NodeGrid& grid, const meshless::Material& material,
                                  StateWriter& writer) const {
    writer.add(std::uint64_t{phyxels.size()});
    for (std::size_t i = initial_count; i < phyxels.size(); ++i) {
        const Vec3i node = grid.rest().to_grid(phyxels.rest_position[i]).array().round().matrix().cast<int>();
        writer.add(splitting::edge_id({node, 0}));
    }
    writer.add(std::span(phyxels.support_radius).subspan(initial_count));
    for (const auto* ignored : {&phyxels.ignored_holds, &phyxels.ignored_handles})
        writer.add(std::span(*ignored).subspan(initial_count));
    for (const Vec3i& node : owner) writer.add(splitting::edge_id({node, 0}));
    for (const auto* vectors :
         {&phyxels.position, &phyxels.velocity, &phyxels.previous_position, &phyxels.previous_velocity})
        writer.add(numbers_of(*vectors));
    for (const auto* matrices : {&phyxels.deformation, &phyxels.rotation, &previous_deformation})
        writer.add(numbers_of(*matrices));
    if (material.plasticity) writer.add(numbers_of(phyxels.plastic_strain));
    for (const auto* flags : {&phyxels.restart_history, &phyxels.touching, &phyxels.held})
        writer.add(std::span<const std::uint8_t>(*flags));
    for (const auto* energies : {&phyxels.elastic_energy, &phyxels.reserve})
        writer.add(std::span<const double>(*energies));
    writer.add(phyxels.history_step);
    writer.add(std::int32_t{phyxels.substeps});
    writer.add(std::int32_t{phyxels.slow_steps});
}

// Loads the phyxels that were added by resampling. Each lies at a node, no two at the same.
void ElasticSamples::load_new_phyxels(const SampleContext& context, StateReader& reader, std::size_t count) {
    const std::size_t added = count - initial_count;
    const std::vector<std::uint64_t> ids = reader.numbers<std::uint64_t>(added);
    std::vector<std::uint64_t> sorted = ids;
    std::sort(sorted.begin(), sorted.end());
    require_state(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
                  "two phyxels at the same position");
    const std::vector<double> supports =
        reader.numbers<double>(added, 0, largest_state_number, "a phyxel with an invalid support radius");
    const std::vector<std::uint32_t> ignored_holds = reader.numbers<std::uint32_t>(added);
    const std::vector<std::uint32_t> ignored_handles = reader.numbers<std::uint32_t>(added);
    for (std::size_t k = 0; k < added; ++k) {
        const auto [node, axis] = splitting::edge_from_id(ids[k]);
        require_state(axis == 0 && context.grid.rest().contains(node) && context.grid.inside(node),
                      "a phyxel outside the body");
        meshless::PhyxelStart start;
        start.rest_position = context.grid.rest().node_position(node);
        start.contact_radius = 0.5 * context.grid.rest().cell_size;
        start.support_radius = supports[k];
        const std::size_t known = initial_count + k;
        if (known >= phyxels.size())
            phyxels.append(start);
        else
            require_state(phyxels.rest_position[known] == start.rest_position &&
                              phyxels.support_radius[known] == start.support_radius,
                          "initial phyxels that differ from the scene's");
        phyxels.ignored_holds[known] = ignored_holds[k];
        phyxels.ignored_handles[known] = ignored_handles[k];
    }
}

// Checks the support radii of added phyxels. A radius is a multiple of the mean distance to the nearest
// phyxels at the time when the phyxel was added: at least that multiple of the distance to the nearest phyxel
// now, at most that of the mean distance to the nearest of the initial phyxels. Without the bounds, damaged
// data could make all phyxels neighbours of each other.
void ElasticSamples::check_supports(const SampleContext& context) const {
    constexpr double rounding = 1e-9;
    const meshless::SupportOptions options;
    const auto nearest_count = static_cast<std::size_t>(options.nearest_count);
    const std::span<const Vec3> rest = phyxels.rest_position;
    const std::size_t before = std::min(std::max(initial_count, nearest_count + 1), rest.size());
    if (rest.size() == initial_count) return;
    const meshless::PhyxelLocator all(rest, 1.6 * spacing), first(rest.first(before), 1.6 * spacing);
    const double cell = context.grid.rest().cell_size,
                 widest = cell * context.grid.rest().node_count.cast<double>().norm();
    std::vector<std::uint32_t> nearest;
    const auto mean_distance = [&](std::size_t i) {
        double sum = 0;
        for (const std::uint32_t j : nearest) sum += (rest[j] - rest[i]).norm();
        return sum / static_cast<double>(nearest.size());
    };
    for (std::size_t i = initial_count; i < rest.size(); ++i) {
        const double support = phyxels.support_radius[i];
        all.nearest(rest[i], 2, nearest);
        std::erase(nearest, static_cast<std::uint32_t>(i));
        const double min_support =
            nearest.empty() ? 0 : (1 - rounding) * options.factor * (rest[nearest[0]] - rest[i]).norm();
        require_state(support >= std::max(min_support, 1e-3 * cell),
                      "a phyxel whose support does not reach its neighbours");
        first.nearest(rest[i], nearest_count, nearest);
        const double max_distance = i < before ? widest : std::min(widest, mean_distance(i));
        require_state(support <= (1 + rounding) * options.factor * max_distance,
                      "a phyxel whose support reaches too far");
    }
}

void ElasticSamples::load_phyxels(const SampleContext& context, StateReader& reader) {
    const std::size_t count = reader.count(bytes_of_phyxel);
    require_state(count >= phyxels.size(), "too few phyxels");
    load_new_phyxels(context, reader, count);
    check_supports(context);
    const std::vector<std::uint64_t> owners = reader.numbers<std::uint64_t>(count);
    owner.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto [node, axis] = splitting::edge_from_id(owners[i]);
        require_state(axis == 0 && context.grid.rest().contains(node) && context.grid.inside(node),
                      "a phyxel outside the body");
        owner[i] = node;
        phyxels.piece[i] = context.pieces.piece_of(context.grid, node);
    }
    for (auto* vectors :
         {&phyxels.position, &phyxels.velocity, &phyxels.previous_position, &phyxels.previous_velocity})
        read_numbers(reader, count, *vectors, "a phyxel with an invalid position or velocity");
    for (auto* matrices : {&phyxels.deformation, &phyxels.rotation, &previous_deformation})
        read_numbers(reader, count, *matrices, "a phyxel with an invalid deformation");
    for (const Mat3& rotation : phyxels.rotation)
        require_state(is_rotation(rotation, tuning::set_up::rotation_tolerance),
                      "a phyxel with an invalid rotation");
    if (context.material.plasticity)
        read_numbers(reader, count, phyxels.plastic_strain, "a phyxel with an invalid plastic strain");
    for (auto* flags : {&phyxels.restart_history, &phyxels.touching, &phyxels.held})
        *flags = reader.numbers<std::uint8_t>(count, 0, 1, "a phyxel with an invalid flag");
    for (auto* energies : {&phyxels.elastic_energy, &phyxels.reserve})
        read_numbers(reader, count, *energies, "a phyxel with an invalid energy");
    phyxels.history_step = reader.number<double>(0, largest_state_number, "an invalid step length");
    phyxels.substeps = reader.number<std::int32_t>(0, std::numeric_limits<std::int32_t>::max(),
                                                   "a negative number of substeps");
    phyxels.slow_steps = reader.number<std::int32_t>(0, std::numeric_limits<std::int32_t>::max(),
                                                     "a negative number of slow steps");
    std::vector<std::uint8_t> has_phyxel(context.pieces.count(), 0);
    for (const std::int32_t piece : phyxels.piece) has_phyxel[static_cast<std::size_t>(piece)] = 1;
    require_state(std::find(has_phyxel.begin(), has_phyxel.end(), 0) == has_phyxel.end(),
                  "a piece without phyxels");
}

void ElasticSamples::save_lumping(StateWriter& writer) const {
    const std::size_t nodes = lumping.node_count();
    for (const meshless::MassLumping::Row& row : lumping.rows) writer.add(row.count);
    for (std::size_t n = 0; n < nodes; ++n) writer.add(lumping.phyxels_of(n));
    for (std::size_t n = 0; n < nodes; ++n) writer.add(lumping.shares_of(n));
}

// Each node's mass is lumped to phyxels of its own piece, in ascending order, with shares that sum to one.
void ElasticSamples::load_lumping(const SampleContext& context, StateReader& reader) {
    const std::size_t nodes = context.nodes.size();
    meshless::MassLumping loaded;
    const std::vector<std::uint32_t> counts = reader.numbers<std::uint32_t>(
        nodes, 0, static_cast<std::uint32_t>(phyxels.size()), "mass lumped to more phyxels than there are");
    std::uint64_t entries = 0;
    for (const std::uint32_t count : counts) {
        loaded.rows.push_back({static_cast<std::uint32_t>(entries), count, count});
        entries += count;
        require_state(entries <= std::numeric_limits<std::uint32_t>::max(), "too much mass lumping");
    }
    loaded.phyxel = reader.numbers<std::uint32_t>(entries, 0, static_cast<std::uint32_t>(phyxels.size() - 1),
                                                  "mass lumped to an unknown phyxel");
    read_numbers(reader, entries, loaded.share, "mass lumping with an invalid share");
    for (std::size_t n = 0; n < nodes; ++n) {
        const std::span<const std::uint32_t> row = loaded.phyxels_of(n);
        double sum = 0, absolute = 0;
        for (std::size_t k = 0; k < row.size(); ++k) {
            require_state(k == 0 || row[k - 1] < row[k], "mass lumping entries out of order");
            require_state(phyxels.piece[row[k]] == context.nodes.piece[n],
                          "mass lumped to a phyxel of another piece");
            sum += loaded.shares_of(n)[k];
            absolute += std::abs(loaded.shares_of(n)[k]);
        }
        require_state(absolute <= tuning::set_up::max_absolute_shares, "mass lumping with an invalid share");
        require_state(row.empty() || std::abs(sum - 1) <= 1e-6, "mass lumping whose shares do not sum to 1");
    }
    lumping = std::move(loaded);
    rebuild_locator();
    meshless::sum_volumes(context.nodes.for_lumping(), phyxels, locator, lumping, context.parallel);
    meshless::apply(lumping, context.nodes.for_lumping(), context.material.density, phyxels);
    for (const double volume : phyxels.volume) require_state(volume >= 0, "a phyxel with a negative volume");
}

void ElasticSamples::save_rigid(StateWriter& writer) const {
    const meshless::RigidPieces& rigid = phyxels.rigid;
    writer.add(std::uint64_t{rigid.bodies.size()});
    for (const meshless::RigidPiece& body : rigid.bodies) {
        writer.add(body.piece);
        for (const Mat3* matrix : {&body.shape, &body.rotation}) write_numbers(writer, *matrix);
        for (const Vec3* vector : {&body.centre, &body.momentum, &body.angular_momentum})
            write_numbers(writer, *vector);
        writer.add(body.touching);
        writer.add(body.point_count);
        for (const Vec3& point : rigid.points_of(body)) write_numbers(writer, point);
    }
}

// Mass and inertia are recomputed from the piece's nodes.
void ElasticSamples::load_rigid(const SampleContext& context, StateReader& reader) {
    constexpr std::uint32_t max_points = 4096;
    phyxels.rigid = {};
    const std::size_t count = reader.count(4 + 27 * sizeof(double));
    std::vector<std::vector<std::uint32_t>> nodes(count == 0 ? 0 : context.pieces.count());
    if (count > 0)
        for (std::uint32_t n = 0; n < context.nodes.size(); ++n)
            nodes[static_cast<std::size_t>(context.nodes.piece[n])].push_back(n);
    const double length =
        context.grid.rest().cell_size * context.grid.rest().node_count.cast<double>().norm();
    for (std::size_t k = 0; k < count; ++k) {
        meshless::RigidPiece body;
        body.piece = reader.number<std::int32_t>(0, static_cast<std::int32_t>(context.pieces.count()) - 1,
                                                 "an unknown rigid piece");
        require_state(phyxels.rigid.index(body.piece) < 0, "a rigid piece listed twice");
        read_numbers(reader, body.shape, "a rigid piece with an invalid shape");
        read_numbers(reader, body.rotation, "a rigid piece with an invalid rotation");
        for (Vec3* vector : {&body.centre, &body.momentum, &body.angular_momentum})
            read_numbers(reader, *vector, "a rigid piece with an invalid position or velocity");
        body.touching = reader.number<std::uint8_t>(0, 1, "a rigid piece with an invalid flag");
        const Vec3 stretch = eigen_symmetric(body.shape).values;  // descending
        require_state((body.shape - body.shape.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * stretch[0] &&
                          stretch[2] > 1e-3 && stretch[0] < 1e3,
                      "a rigid piece with an invalid shape");
        require_state(is_rotation(body.rotation, 1e-6), "a rigid piece with an invalid rotation");
        context.nodes.weigh(nodes[static_cast<std::size_t>(body.piece)], context.material.density, body);
        std::vector<Vec3> points;
        read_numbers(reader,
                     reader.number<std::uint32_t>(0, max_points, "a rigid piece with too many points"),
                     points, "a rigid piece with an invalid point");
        for (const Vec3& point : points)
            require_state(point.norm() <= 2 * length * stretch[0], "a point far from its rigid piece");
        phyxels.rigid.put(body, points);
    }
}

void ElasticSamples::save_pairs(StateWriter& writer) const {
    writer.add(std::uint64_t{pairs.size()});
    for (const auto* ends : {&pairs.a, &pairs.b}) writer.add(std::span<const std::uint32_t>(*ends));
    writer.add(std::span<const float>(pairs.visibility));
}

void ElasticSamples::load_pairs(StateReader& reader) {
    const std::size_t count = reader.count(2 * sizeof(std::uint32_t) + sizeof(float));
    const auto last = static_cast<std::uint32_t>(phyxels.size() - 1);
    meshless::Pairs loaded;
    for (auto* ends : {&loaded.a, &loaded.b})
        *ends = reader.numbers<std::uint32_t>(count, 0, last, "a pair with an unknown phyxel");
    loaded.visibility = reader.numbers<float>(count, 0, 1, "a pair with a visibility outside 0 to 1");
    // Per phyxel, its last partner with a lower and with a higher index.
    std::vector<std::int64_t> last_lower(phyxels.size(), -1), last_higher(phyxels.size(), -1);
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t a = loaded.a[k], b = loaded.b[k];
        require_state(a < b && last_lower[b] < std::int64_t{a} && last_higher[a] < std::int64_t{b},
                      "pairs out of order");
        last_lower[b] = a;
        last_higher[a] = b;
        const double reach = std::max(phyxels.support_radius[a], phyxels.support_radius[b]);
        const double distance_squared = (phyxels.rest_position[b] - phyxels.rest_position[a]).squaredNorm();
        require_state(distance_squared > 0 && distance_squared < reach * reach,
                      "a pair of phyxels out of each other's reach");
        require_state(!(loaded.visibility[k] > 0) ||
                          (phyxels.piece[a] == phyxels.piece[b] && phyxels.rigid.index(phyxels.piece[a]) < 0),
                      "a pair that is visible through a cut");
    }
    pairs = std::move(loaded);
}

}  // namespace splitcubes::body
