// Saves a body to a checkpoint and restores it. State that follows from other state is not stored but
// derived, so that it cannot contradict it: grid, surface and pieces from the cuts, masses from the mass
// lumping, kernels and vertices from phyxels and nodes. Every stored number is checked when it is read.
#include <splitcubes/body/body.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/math/state_numbers.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {

namespace {

// Largest deviation of a stored rotation of a phyxel from orthogonality.
constexpr double rotation_tolerance = 1e-3;
// Stored bytes of a cut edge, and least of a phyxel: bound the counts that are read.
constexpr std::size_t bytes_of_cut = 44, bytes_of_phyxel = 338;

// Whether an edge lies within the material and is uncut.
bool can_be_cut(const splitting::NodeGrid& grid, const splitting::GridEdge& edge) {
    return edge.axis < 3 && grid.has_edge(edge) && grid.inside(edge.node) && grid.inside(edge.upper()) &&
           !grid.is_cut(edge);
}

bool is_direction_along(const Vec3& normal, int axis) {
    return std::abs(normal.norm() - 1) <= 1e-9 && normal[axis] >= 0;
}

}  // namespace

void Body::save(StateWriter& writer) const {
    save_cuts(writer);
    save_phyxels(writer);
    save_lumping(writer);
    save_rigid(writer);
    save_pairs(writer);
    tracker_.save(writer, phyxels_);
    save_motion(writer);
}

void Body::load(StateReader& reader, const Parallel& parallel) {
    try {
        load_cuts(reader);
        load_phyxels(reader);
        load_lumping(reader);
        load_rigid(reader);
        load_pairs(reader);
        tracker_.load(reader, tracker_context(parallel));
        load_motion(reader);
        rebuild_derived_state(parallel);
    } catch (const DamagedState& damaged) {
        throw DamagedState(std::string(damaged.what()) + " in body '" + settings_.name + "'");
    }
}

void Body::save_cuts(StateWriter& writer) const {
    writer.add(std::uint64_t{cut_edge_count_});
    const auto all = std::span(grid_.crossings()).subspan(solid_crossings_);
    for (const splitting::Crossing& c : all) writer.add(splitting::edge_id(c.edge));
    for (const splitting::Crossing& c : all) writer.add(c.hit);
    for (const splitting::Crossing& c : all) write_numbers(writer, c.normal);
    for (const splitting::Crossing& c : all) writer.add(c.cut);
    writer.add(std::uint64_t{cut_stage_ends_.size()});
    writer.add(std::span<const std::uint32_t>(cut_stage_ends_));
}

// Repeats the cuts stage by stage, which reproduces surface and pieces.
void Body::load_cuts(StateReader& reader) {
    const std::size_t count = reader.count(bytes_of_cut);
    const std::vector<std::uint64_t> edges = reader.numbers<std::uint64_t>(count);
    const std::vector<double> hits = reader.numbers<double>(count, 0, 1, "a cut position outside its edge");
    std::vector<Vec3> normals;
    read_numbers(reader, count, normals, "an invalid cut normal");
    const std::vector<std::int32_t> cuts =
        reader.numbers<std::int32_t>(count, 0, std::numeric_limits<std::int32_t>::max(), "an invalid cut id");
    const std::vector<std::uint32_t> stage_ends = reader.numbers<std::uint32_t>(reader.count(4));
    require_state(stage_ends.empty() ? count == 0 : stage_ends.back() == count, "cuts assigned to no step");
    require_state(stage_ends.size() >= cut_stage_ends_.size() &&
                      std::equal(cut_stage_ends_.begin(), cut_stage_ends_.end(), stage_ends.begin()),
                  "initial cuts that differ from the scene's");
    for (std::size_t k = 0; k < cut_edge_count_; ++k)
        require_state(splitting::edge_id(grid_.crossings()[solid_crossings_ + k].edge) == edges[k],
                      "initial cuts that differ from the scene's");
    for (std::size_t s = cut_stage_ends_.size(); s < stage_ends.size(); ++s) {
        require_state(stage_ends[s] > cut_edge_count_ && stage_ends[s] <= count, "cuts assigned to no step");
        std::vector<std::int32_t> slots;
        for (std::size_t k = cut_edge_count_; k < stage_ends[s]; ++k) {
            splitting::Crossing crossing;
            crossing.edge = splitting::edge_from_id(edges[k]);
            require_state(can_be_cut(grid_, crossing.edge), "a cut on an edge that cannot be cut");
            require_state(is_direction_along(normals[k], crossing.edge.axis), "an invalid cut normal");
            crossing.hit = hits[k];
            crossing.normal = normals[k];
            crossing.origin = splitting::Origin::cut;
            crossing.cut = cuts[k];
            slots.push_back(grid_.put(crossing));
        }
        surface_->retessellate(grid_, slots);
        pieces_->update(grid_, slots);
        cut_edge_count_ = stage_ends[s];
    }
    cut_stage_ends_ = stage_ends;
    inside_.label_pieces(grid_, *pieces_);
}

void Body::save_phyxels(StateWriter& writer) const {
    writer.add(std::uint64_t{phyxels_.size()});
    for (std::size_t i = solid_phyxels_; i < phyxels_.size(); ++i) {
        const Vec3i node =
            grid_.rest().to_grid(phyxels_.rest_position[i]).array().round().matrix().cast<int>();
        writer.add(splitting::edge_id({node, 0}));
    }
    writer.add(std::span(phyxels_.support_radius).subspan(solid_phyxels_));
    for (const Vec3i& node : owner_) writer.add(splitting::edge_id({node, 0}));
    for (const auto* vectors :
         {&phyxels_.position, &phyxels_.velocity, &phyxels_.previous_position, &phyxels_.previous_velocity})
        writer.add(numbers_of(*vectors));
    for (const auto* matrices : {&phyxels_.deformation, &phyxels_.rotation, &previous_deformation_})
        writer.add(numbers_of(*matrices));
    if (settings_.material.plasticity) writer.add(numbers_of(phyxels_.plastic_strain));
    for (const auto* flags : {&phyxels_.restart_history, &phyxels_.touching})
        writer.add(std::span<const std::uint8_t>(*flags));
    for (const auto* energies : {&phyxels_.elastic_energy, &phyxels_.reserve})
        writer.add(std::span<const double>(*energies));
    writer.add(phyxels_.history_step);
    writer.add(std::int32_t{phyxels_.substeps});
}

// Loads the phyxels that were added by resampling. Each lies at a node, no two at the same.
void Body::load_new_phyxels(StateReader& reader, std::size_t count) {
    const std::size_t added = count - solid_phyxels_;
    const std::vector<std::uint64_t> ids = reader.numbers<std::uint64_t>(added);
    std::vector<std::uint64_t> sorted = ids;
    std::sort(sorted.begin(), sorted.end());
    require_state(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
                  "two phyxels at the same position");
    const std::vector<double> supports =
        reader.numbers<double>(added, 0, largest_state_number, "a phyxel with an invalid support radius");
    for (std::size_t k = 0; k < added; ++k) {
        const auto [node, axis] = splitting::edge_from_id(ids[k]);
        require_state(axis == 0 && grid_.rest().contains(node) && grid_.inside(node),
                      "a phyxel outside the body");
        meshless::PhyxelStart start;
        start.rest_position = grid_.rest().node_position(node);
        start.contact_radius = 0.5 * grid_.rest().cell_size;
        start.support_radius = supports[k];
        const std::size_t known = solid_phyxels_ + k;
        if (known >= phyxels_.size())
            phyxels_.append(start);
        else
            require_state(phyxels_.rest_position[known] == start.rest_position &&
                              phyxels_.support_radius[known] == start.support_radius,
                          "initial phyxels that differ from the scene's");
    }
}

// Checks the support radii of added phyxels. A radius is a multiple of the mean distance to the nearest
// phyxels at the time when the phyxel was added: at least that multiple of the distance to the nearest phyxel
// now, at most that of the mean distance to the nearest of the initial phyxels. Without the bounds, damaged
// data could make all phyxels neighbours of each other.
void Body::check_supports() const {
    constexpr double rounding = 1e-9;
    const meshless::SupportOptions options;
    const auto nearest_count = static_cast<std::size_t>(options.nearest_count);
    const std::span<const Vec3> rest = phyxels_.rest_position;
    const std::size_t before = std::min(std::max(solid_phyxels_, nearest_count + 1), rest.size());
    if (rest.size() == solid_phyxels_) return;
    const meshless::PhyxelLocator all(rest, 1.6 * spacing_), first(rest.first(before), 1.6 * spacing_);
    const double cell = grid_.rest().cell_size, widest = cell * grid_.rest().node_count.cast<double>().norm();
    std::vector<std::uint32_t> nearest;
    const auto mean_distance = [&](std::size_t i) {
        double sum = 0;
        for (const std::uint32_t j : nearest) sum += (rest[j] - rest[i]).norm();
        return sum / static_cast<double>(nearest.size());
    };
    for (std::size_t i = solid_phyxels_; i < rest.size(); ++i) {
        const double support = phyxels_.support_radius[i];
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

void Body::load_phyxels(StateReader& reader) {
    const std::size_t count = reader.count(bytes_of_phyxel);
    require_state(count >= phyxels_.size(), "too few phyxels");
    load_new_phyxels(reader, count);
    check_supports();
    const std::vector<std::uint64_t> owners = reader.numbers<std::uint64_t>(count);
    owner_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto [node, axis] = splitting::edge_from_id(owners[i]);
        require_state(axis == 0 && grid_.rest().contains(node) && grid_.inside(node),
                      "a phyxel outside the body");
        owner_[i] = node;
        phyxels_.piece[i] = pieces_->piece_of(grid_, node);
    }
    for (auto* vectors :
         {&phyxels_.position, &phyxels_.velocity, &phyxels_.previous_position, &phyxels_.previous_velocity})
        read_numbers(reader, count, *vectors, "a phyxel with an invalid position or velocity");
    for (auto* matrices : {&phyxels_.deformation, &phyxels_.rotation, &previous_deformation_})
        read_numbers(reader, count, *matrices, "a phyxel with an invalid deformation");
    for (const Mat3& rotation : phyxels_.rotation)
        require_state(is_rotation(rotation, rotation_tolerance), "a phyxel with an invalid rotation");
    if (settings_.material.plasticity)
        read_numbers(reader, count, phyxels_.plastic_strain, "a phyxel with an invalid plastic strain");
    for (auto* flags : {&phyxels_.restart_history, &phyxels_.touching})
        *flags = reader.numbers<std::uint8_t>(count, 0, 1, "a phyxel with an invalid flag");
    for (auto* energies : {&phyxels_.elastic_energy, &phyxels_.reserve})
        read_numbers(reader, count, *energies, "a phyxel with an invalid energy");
    phyxels_.history_step = reader.number<double>(0, largest_state_number, "an invalid step length");
    phyxels_.substeps = reader.number<std::int32_t>(0, std::numeric_limits<std::int32_t>::max(),
                                                    "a negative number of substeps");
    std::vector<std::uint8_t> has_phyxel(pieces_->count(), 0);
    for (const std::int32_t piece : phyxels_.piece) has_phyxel[static_cast<std::size_t>(piece)] = 1;
    require_state(std::find(has_phyxel.begin(), has_phyxel.end(), 0) == has_phyxel.end(),
                  "a piece without phyxels");
}

void Body::save_lumping(StateWriter& writer) const {
    writer.add(std::span(lumping_.offsets).subspan(1));
    writer.add(std::span<const std::uint32_t>(lumping_.phyxel));
    writer.add(std::span<const double>(lumping_.share));
    writer.add(std::span<const std::uint8_t>(lumping_.whole));
}

// Each node's mass is lumped to phyxels of its own piece, in ascending order, with shares that sum to one.
void Body::load_lumping(StateReader& reader) {
    const std::size_t nodes = inside_.size();
    meshless::MassLumping lumping;
    lumping.offsets = {0};
    const std::vector<std::uint32_t> ends = reader.numbers<std::uint32_t>(nodes);
    lumping.offsets.insert(lumping.offsets.end(), ends.begin(), ends.end());
    require_state(std::is_sorted(lumping.offsets.begin(), lumping.offsets.end()),
                  "mass lumping entries out of order");
    const std::size_t entries = lumping.offsets.back();
    lumping.phyxel = reader.numbers<std::uint32_t>(
        entries, 0, static_cast<std::uint32_t>(phyxels_.size() - 1), "mass lumped to an unknown phyxel");
    read_numbers(reader, entries, lumping.share, "mass lumping with an invalid share");
    lumping.whole = reader.numbers<std::uint8_t>(nodes, 0, 1, "mass lumping with an invalid flag");
    lumping.piece = inside_.piece;
    for (std::size_t n = 0; n < nodes; ++n) {
        const std::uint32_t begin = lumping.offsets[n], end = lumping.offsets[n + 1];
        lumping.unlumped += begin == end;
        double sum = 0;
        for (std::uint32_t e = begin; e < end; ++e) {
            require_state(e == begin || lumping.phyxel[e - 1] < lumping.phyxel[e],
                          "mass lumping entries out of order");
            require_state(phyxels_.piece[lumping.phyxel[e]] == inside_.piece[n],
                          "mass lumped to a phyxel of another piece");
            sum += lumping.share[e];
        }
        require_state(begin == end || std::abs(sum - 1) <= 1e-6, "mass lumping whose shares do not sum to 1");
    }
    lumping_ = std::move(lumping);
    meshless::apply(lumping_, inside_.volume, settings_.material.density, phyxels_);
    for (const double volume : phyxels_.volume) require_state(volume >= 0, "a phyxel with a negative volume");
}

void Body::save_rigid(StateWriter& writer) const {
    const meshless::RigidPieces& rigid = phyxels_.rigid;
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
void Body::load_rigid(StateReader& reader) {
    constexpr std::uint32_t max_points = 26;
    phyxels_.rigid = {};
    const std::size_t count = reader.count(4 + 27 * sizeof(double));
    std::vector<std::vector<std::uint32_t>> nodes(count == 0 ? 0 : pieces_->count());
    if (count > 0)
        for (std::uint32_t n = 0; n < inside_.size(); ++n)
            nodes[static_cast<std::size_t>(inside_.piece[n])].push_back(n);
    const double length = grid_.rest().cell_size * grid_.rest().node_count.cast<double>().norm();
    for (std::size_t k = 0; k < count; ++k) {
        meshless::RigidPiece body;
        body.piece = reader.number<std::int32_t>(0, static_cast<std::int32_t>(pieces_->count()) - 1,
                                                 "an unknown rigid piece");
        require_state(phyxels_.rigid.index(body.piece) < 0, "a rigid piece listed twice");
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
        inside_.weigh(nodes[static_cast<std::size_t>(body.piece)], settings_.material.density, body);
        std::vector<Vec3> points;
        read_numbers(reader,
                     reader.number<std::uint32_t>(0, max_points, "a rigid piece with too many points"),
                     points, "a rigid piece with an invalid point");
        for (const Vec3& point : points)
            require_state(point.norm() <= 2 * length * stretch[0], "a point far from its rigid piece");
        phyxels_.rigid.put(body, points);
    }
}

void Body::save_pairs(StateWriter& writer) const {
    writer.add(std::uint64_t{pairs_.size()});
    for (const auto* ends : {&pairs_.a, &pairs_.b}) writer.add(std::span<const std::uint32_t>(*ends));
    writer.add(std::span<const float>(pairs_.visibility));
}

void Body::load_pairs(StateReader& reader) {
    const std::size_t count = reader.count(2 * sizeof(std::uint32_t) + sizeof(float));
    const auto last = static_cast<std::uint32_t>(phyxels_.size() - 1);
    meshless::Pairs pairs;
    for (auto* ends : {&pairs.a, &pairs.b})
        *ends = reader.numbers<std::uint32_t>(count, 0, last, "a pair with an unknown phyxel");
    pairs.visibility = reader.numbers<float>(count, 0, 1, "a pair with a visibility outside 0 to 1");
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t a = pairs.a[k], b = pairs.b[k];
        require_state(a < b && (k == 0 || pairs.a[k - 1] < a || (pairs.a[k - 1] == a && pairs.b[k - 1] < b)),
                      "pairs out of order");
        const double reach = std::max(phyxels_.support_radius[a], phyxels_.support_radius[b]);
        const double distance_squared = (phyxels_.rest_position[b] - phyxels_.rest_position[a]).squaredNorm();
        require_state(distance_squared > 0 && distance_squared < reach * reach,
                      "a pair of phyxels out of each other's reach");
        require_state(!(pairs.visibility[k] > 0) || (phyxels_.piece[a] == phyxels_.piece[b] &&
                                                     phyxels_.rigid.index(phyxels_.piece[a]) < 0),
                      "a pair that is visible through a cut");
    }
    pairs_ = std::move(pairs);
}

void Body::save_motion(StateWriter& writer) const {
    writer.add(numbers_of(frames_));
    writer.add(step_);
    // Only the positions of nodes that were near a blade in the last step are used again.
    std::vector<std::uint32_t> nodes;
    std::vector<Vec3> positions;
    for (std::uint32_t node = 0; node < cut_step_.size(); ++node) {
        if (cut_step_[node] != step_ - 1) continue;
        nodes.push_back(node);
        positions.push_back(cut_position_[node]);
    }
    writer.add(std::uint64_t{nodes.size()});
    writer.add(std::span<const std::uint32_t>(nodes));
    writer.add(numbers_of(positions));
    if (!deformation_) return;
    const std::vector<double> state = deformation_->state();
    writer.add(std::span<const double>(state));
    writer.add(numbers_of(node_frames_before_));
}

void Body::load_motion(StateReader& reader) {
    read_numbers(reader, tracker_.size(), frames_, "a node with an invalid frame or position");
    step_ = reader.number<std::int64_t>(0, std::numeric_limits<std::int32_t>::max(), "an invalid step count");
    const std::size_t near_blades = reader.count(sizeof(Vec3) + sizeof(std::uint32_t));
    const std::vector<std::uint32_t> nodes = reader.numbers<std::uint32_t>(near_blades);
    std::vector<Vec3> positions;
    read_numbers(reader, near_blades, positions, "a node with an invalid frame or position");
    cut_position_.assign(tracker_.size(), Vec3::Zero());
    cut_step_.assign(tracker_.size(), -2);
    for (std::size_t k = 0; k < near_blades; ++k) {
        require_state(nodes[k] < tracker_.size(), "an unknown node");
        cut_position_[nodes[k]] = positions[k];
        cut_step_[nodes[k]] = step_ - 1;
    }
    if (!deformation_) return;
    std::vector<double> state;
    read_numbers(reader, deformation_->state().size(), state, "an invalid deformation state");
    read_numbers(reader, inside_.size(), node_frames_before_, "a node with an invalid frame or position");
    restore_deformation(state);
}

// Rebuilds all state that is not stored.
void Body::rebuild_derived_state(const Parallel& parallel) {
    occluders_.rebuild(grid_, *surface_, parallel);
    locator_ = meshless::PhyxelLocator(phyxels_.rest_position, 1.6 * spacing_);
    neighbourhoods_.rebuild(phyxels_, pairs_, settings_.material, parallel);
    boundary_.forget_phyxels();
    surface_motion_.retrack_nodes(grid_, *surface_, tracker_);
    if (deformation_) deformation_->node_frames(node_frames_, parallel);
    surface_motion_.update(*surface_, grid_.rest(), tracker_, frames_, parallel);
    sampler_.rebuild(grid_, *surface_, *pieces_, spacing_, parallel);
}

}  // namespace splitcubes::body
