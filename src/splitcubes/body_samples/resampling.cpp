#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/body_samples/resampling.h>
#include <splitcubes/body_samples/rigid_outline.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/elasticity/elasticity.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/samples/split_momentum.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

// Returns per piece the family it belongs to, the pieces that were one before the split; -1: untouched.
std::vector<std::int32_t> families_of(std::span<const splitting::PieceSplit> splits, std::size_t pieces) {
    std::vector<std::int32_t> family(pieces, -1);
    std::int32_t count = 0;
    for (const splitting::PieceSplit& split : splits) {
        std::int32_t& of_parent = family[static_cast<std::size_t>(split.parent)];
        if (of_parent < 0) of_parent = count++;
        family[static_cast<std::size_t>(split.piece)] = of_parent;
    }
    return family;
}

// Resamples the pieces of one step's splits; see resample.
class Resampler {
  public:
    Resampler(const SampleContext& context, const splitting::Surface& surface, const NodeTracker& tracker,
              const Attachments& attachments, ElasticSamples& samples, TopologyChange& change)
        : context_(context),
          surface_(surface),
          tracker_(tracker),
          attachments_(attachments),
          samples_(samples),
          change_(change) {}
    void run();

  private:
    /// Treatment of a piece in a step in which pieces split (see kinds_of).
    enum class Kind : std::uint8_t { untouched, rigid, small, large };
    /// State of a node, interpolated from phyxels.
    struct NodeState {
        Vec3 position = Vec3::Zero();        // m, world
        Mat3 jacobian = Mat3::Zero();        // d world / d rest
        Vec3 velocity = Vec3::Zero();        // m/s
        Mat3 plastic_strain = Mat3::Zero();  // rest space
        double weight = 0;

        void divide() {
            position /= weight;
            jacobian /= weight;
            velocity /= weight;
            plastic_strain /= weight;
        }
    };
    void add_motion(std::uint32_t phyxel, const Vec3& rest, double weight, NodeState& sum) const;
    NodeState motion_of(std::uint32_t node, std::int32_t side) const;
    void add_sample(std::uint32_t node, std::int32_t piece);
    void add_samples(std::int32_t piece, std::span<const std::uint32_t> nodes, std::size_t wanted,
                     double within);
    bool is_sparse(std::size_t phyxels, double length) const;
    std::size_t add_samples_around(std::uint32_t phyxel, std::span<const std::uint32_t> nodes);
    void refresh_links(std::size_t old_count);
    /// Returns whether a piece is a fragment that becomes rigid because it rotates too fast.
    bool is_fast(std::int32_t piece) const {
        return std::binary_search(change_.fast_fragments.begin(), change_.fast_fragments.end(), piece);
    }
    bool has_gap(std::int32_t piece) const {
        return std::any_of(change_.gaps.begin(), change_.gaps.end(),
                           [&](const Gap& gap) { return samples_.phyxels.piece[gap.inside] == piece; });
    }
    std::vector<std::uint8_t> find_loose(std::span<const std::int32_t> family, std::size_t count,
                                         const std::function<bool(std::size_t)>& acts_on) const;
    void fill_pieces(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds);
    void move_with_links(std::size_t i);
    void fill_gaps(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds);
    std::vector<Kind> kinds_of(std::span<const std::vector<std::uint32_t>> nodes) const;
    void reset_small_strains(std::span<const Kind> kinds, std::size_t old_count);
    void reset_strain(std::span<const std::uint32_t> members);
    bool is_chain(std::size_t piece) const;
    meshless::RigidPiece initial_rigid_piece(std::int32_t piece, std::span<const std::uint32_t> nodes) const;
    std::vector<Vec3> contact_points(const meshless::RigidPiece& body,
                                     std::span<const std::uint32_t> nodes) const;
    void make_rigid(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds);

    const SampleContext& context_;
    const splitting::Surface& surface_;
    const NodeTracker& tracker_;
    const Attachments& attachments_;
    ElasticSamples& samples_;
    TopologyChange& change_;
    // Per piece that splits or came off; empty for the others.
    std::vector<std::vector<std::uint32_t>> members_;   // its phyxels, ascending
    std::vector<Vec3> extents_;                         // m, MaterialNodes::extents_of its nodes
    std::vector<std::uint8_t> is_loose_, is_unpulled_;  // 1: no hold, no handle acts on it (find_loose)
};

// Adds the state of a point (m, rest space) as one phyxel moves it.
void Resampler::add_motion(std::uint32_t phyxel, const Vec3& rest, double weight, NodeState& sum) const {
    const meshless::Phyxels& phyxels = samples_.phyxels;
    sum.weight += weight;
    sum.position += weight * (phyxels.position[phyxel] +
                              phyxels.deformation[phyxel] * (rest - phyxels.rest_position[phyxel]));
    sum.jacobian += weight * phyxels.deformation[phyxel];
    sum.velocity += weight * phyxels.velocity[phyxel];
    sum.plastic_strain += weight * phyxels.plastic_strain[phyxel];
}

// Interpolates the state of a node from the phyxels as they were before the split. Phyxels that now belong to
// piece `side` are preferred, since the others have separated from it; then the node's kernel, which respects
// visibility, is preferred to the phyxels among which its mass is lumped.
Resampler::NodeState Resampler::motion_of(std::uint32_t node, std::int32_t side) const {
    const Vec3& rest = context_.nodes.rest_position[node];
    std::span<const std::uint32_t> visible;
    std::span<const double> visible_weight;
    const std::span<const std::uint32_t> lumped = samples_.lumping.phyxels_of(node);
    const std::span<const double> lumped_weight = samples_.lumping.shares_of(node);
    const std::int32_t tracked = tracker_.find(context_.nodes.node[node]);
    const meshless::NodeKernels& kernels = tracker_.kernels();
    if (tracked >= 0 && static_cast<std::size_t>(tracked) < kernels.size()) {
        const meshless::NodeKernels::Row& row = kernels.rows[static_cast<std::size_t>(tracked)];
        visible = std::span{kernels.phyxel}.subspan(row.begin, row.count);
        visible_weight = std::span{kernels.weight}.subspan(row.begin, row.count);
    }
    const auto sum_over = [&](std::span<const std::uint32_t> row, std::span<const double> weights,
                              bool own_side) {
        NodeState sum;
        for (std::size_t k = 0; k < row.size(); ++k) {
            const std::uint32_t i = row[k];
            if (own_side && samples_.phyxels.piece[i] != side) continue;
            add_motion(i, rest, std::abs(weights[k]), sum);
        }
        return sum;
    };
    NodeState sum;
    for (const bool own_side : {true, false}) {
        if (!(sum.weight > 0)) sum = sum_over(visible, visible_weight, own_side);
        if (!(sum.weight > 0)) sum = sum_over(lumped, lumped_weight, own_side);
    }
    if (!(sum.weight > 0)) return NodeState{context_.pose * rest, context_.pose.linear()};
    sum.divide();
    return sum;
}

void Resampler::add_sample(std::uint32_t node, std::int32_t piece) {
    const NodeState motion = motion_of(node, piece);
    meshless::PhyxelStart start;
    start.rest_position = context_.nodes.rest_position[node];
    start.piece = piece;
    start.contact_radius = 0.5 * context_.grid.rest().cell_size;
    start.position = motion.position;
    start.deformation = motion.jacobian;
    start.velocity = motion.velocity;
    start.plastic_strain = motion.plastic_strain;
    const auto k = static_cast<std::size_t>(piece);
    const double max_offset = tuning::resampling::max_hold_offset * samples_.spacing;
    if (is_loose_[k] != 0 || attachments_.hold_offset(start.rest_position, start.position) > max_offset)
        start.ignored_holds = static_cast<std::uint32_t>(attachments_.holds);
    if (is_unpulled_[k] != 0) start.ignored_handles = static_cast<std::uint32_t>(attachments_.handles);
    members_[k].push_back(static_cast<std::uint32_t>(samples_.phyxels.size()));
    samples_.phyxels.append(start);
    samples_.owner.push_back(context_.nodes.node[node]);
    samples_.previous_deformation.push_back(start.deformation);
}

// Adds phyxels to a piece at its own nodes in farthest-point order, until it has as many as wanted or each
// node is closer to a phyxel than `within`, m (or half a cell, if that is more).
void Resampler::add_samples(std::int32_t piece, std::span<const std::uint32_t> nodes, std::size_t wanted,
                            double within) {
    std::vector<double> distance(nodes.size(), 1e300);  // m^2
    std::size_t have = 0;
    const auto update_distances = [&](const Vec3& rest) {
        ++have;
        for (std::size_t k = 0; k < nodes.size(); ++k)
            distance[k] =
                std::min(distance[k], (context_.nodes.rest_position[nodes[k]] - rest).squaredNorm());
    };
    // add_sample adds to the members.
    for (const std::uint32_t i : members_[static_cast<std::size_t>(piece)])
        update_distances(samples_.phyxels.rest_position[i]);
    const double half_cell = 0.5 * context_.grid.rest().cell_size;
    const double min_squared = std::max(within * within, half_cell * half_cell);
    while (have < wanted) {
        const auto far = std::max_element(distance.begin(), distance.end());
        if (far == distance.end() || *far < min_squared) return;
        const std::uint32_t n = nodes[static_cast<std::size_t>(far - distance.begin())];
        add_sample(n, piece);
        update_distances(context_.nodes.rest_position[n]);
    }
}

// Adds phyxels around one whose neighbours do not span space, at visible nodes of its piece within its
// support, those farthest from all phyxels around first. Returns the number added.
std::size_t Resampler::add_samples_around(std::uint32_t phyxel, std::span<const std::uint32_t> nodes) {
    const Vec3 rest = samples_.phyxels.rest_position[phyxel];
    const double reach = 0.9 * samples_.phyxels.support_radius[phyxel];
    const double min_squared = 0.25 * context_.grid.rest().cell_size * context_.grid.rest().cell_size;
    std::vector<std::uint32_t> near;
    for (const std::uint32_t n : nodes)
        if ((context_.nodes.rest_position[n] - rest).squaredNorm() < reach * reach &&
            !context_.occluders.segment_blocked(rest, context_.nodes.rest_position[n]))
            near.push_back(n);
    std::vector<double> distance(near.size(), 1e300);  // m^2
    const auto update_distances = [&](const Vec3& at) {
        for (std::size_t k = 0; k < near.size(); ++k)
            distance[k] = std::min(distance[k], (context_.nodes.rest_position[near[k]] - at).squaredNorm());
    };
    const std::int32_t piece = samples_.phyxels.piece[phyxel];
    for (const std::uint32_t i : members_[static_cast<std::size_t>(piece)])
        if ((samples_.phyxels.rest_position[i] - rest).squaredNorm() < 4 * reach * reach)
            update_distances(samples_.phyxels.rest_position[i]);
    std::size_t added = 0;
    for (int k = 0; k < tuning::resampling::phyxels_per_rank_iteration; ++k) {
        const auto far = std::max_element(distance.begin(), distance.end());
        if (far == distance.end() || *far < min_squared) break;
        const std::uint32_t n = near[static_cast<std::size_t>(far - distance.begin())];
        add_sample(n, piece);
        update_distances(context_.nodes.rest_position[n]);
        ++added;
    }
    return added;
}

// Returns the rigid piece that a piece becomes. A part of a rigid piece continues that piece's motion. A part
// of an elastic one is placed without strain at the best fit to its nodes (which were interpolated from
// phyxels on both sides of the cut and may be far apart). Its velocity is the rigid motion that best fits the
// phyxels that carried its mass; the nodes span less than these, so taking over the angular momentum would
// overspin it.
meshless::RigidPiece Resampler::initial_rigid_piece(std::int32_t piece,
                                                    std::span<const std::uint32_t> nodes) const {
    const double density = context_.material.density;
    const double edge = context_.grid.rest().cell_size;
    meshless::RigidPiece body;
    body.piece = piece;
    const std::int32_t parent = samples_.phyxels.rigid.index(samples_.lumping.piece[nodes.front()]);
    if (parent >= 0) {
        const meshless::RigidPiece& whole = samples_.phyxels.rigid.bodies[static_cast<std::size_t>(parent)];
        body.shape = whole.shape;
        body.rotation = whole.rotation;
        context_.nodes.weigh(nodes, density, body);
        body.centre = whole.world_point_of_rest(body.rest_centre);
        body.momentum = body.mass * whole.velocity_at(body.centre);
        body.angular_momentum = body.world_inertia() * whole.angular_velocity();
        return body;
    }
    std::vector<NodeState> motions;
    std::vector<double> mass;  // kg, per node
    Mat3 plastic_strain = Mat3::Zero();
    double total = 0;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        motions.push_back(motion_of(nodes[k], piece));
        mass.push_back(density * context_.nodes.volume[nodes[k]]);
        plastic_strain += mass[k] * motions[k].plastic_strain;
        body.centre += mass[k] * motions[k].position;
        total += mass[k];
    }
    body.centre /= total;
    body.shape = meshless::stretch_of(context_.material, plastic_strain / total);
    context_.nodes.weigh(nodes, density, body);
    Mat3 covariance = Mat3::Zero(), mean = Mat3::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const Vec3 own = body.shape * (context_.nodes.rest_position[nodes[k]] - body.rest_centre);
        covariance += mass[k] * (motions[k].position - body.centre) * own.transpose();
        covariance += mass[k] * edge * edge / 12 * motions[k].jacobian * body.shape;
        mean += mass[k] / total * motions[k].jacobian;
    }
    body.rotation = rotation_of(covariance, rotation_of(mean));

    std::vector<meshless::Momenta> held;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const std::span<const std::uint32_t> row = samples_.lumping.phyxels_of(nodes[k]);
        for (std::size_t e = 0; e < row.size(); ++e) {
            meshless::Momenta one;
            // Weighted by the absolute share: moment-corrected shares can be negative, which no fit allows.
            one.mass = mass[k] * std::abs(samples_.lumping.shares_of(nodes[k])[e]);
            one.centre = samples_.phyxels.position[row[e]];
            one.linear = one.mass * samples_.phyxels.velocity[row[e]];
            held.push_back(one);
        }
    }
    meshless::Momenta sum = meshless::together(held);
    // A part of the input may lie beyond the reach of all phyxels.
    if (!(sum.mass > 0)) sum = meshless::total_momenta(samples_.phyxels);
    // About axes around which the phyxels hardly spread, their velocities determine no rotation.
    const double min_inertia = 0.01 * sum.mass * edge * edge;
    const Vec3 rotation_rate = meshless::angular_velocity(sum.inertia, sum.angular_momentum, min_inertia);
    body.momentum = body.mass * (sum.linear / sum.mass + rotation_rate.cross(body.centre - sum.centre));
    body.angular_momentum = body.world_inertia() * rotation_rate;
    return body;
}

// Returns the contact points of a rigid piece; m, in its own frame.
std::vector<Vec3> Resampler::contact_points(const meshless::RigidPiece& body,
                                            std::span<const std::uint32_t> nodes) const {
    std::vector<Vec3i> grid_nodes;
    for (const std::uint32_t n : nodes) grid_nodes.push_back(context_.nodes.node[n]);
    return body::contact_points(context_.grid, surface_, grid_nodes, body);
}

// Whether a piece has fewer phyxels than its length, m, has spacings. A slab that is cut out between two
// layers of phyxels may have none.
bool Resampler::is_sparse(std::size_t phyxels, double length) const {
    return static_cast<double>(phyxels) * samples_.spacing < length;
}

// Links the phyxels that were added since there were old_count, and updates the changed pairs.
void Resampler::refresh_links(std::size_t old_count) {
    if (samples_.phyxels.size() != old_count)
        samples_.append_links(context_, change_);
    else if (!change_.dirty_pairs.empty())
        samples_.neighbourhoods.update(samples_.phyxels, samples_.pairs, change_.dirty_pairs,
                                       context_.material, context_.parallel);
    change_.dirty_pairs.clear();
}

// Returns 1 for each piece on which none of `count` holds or handles acts: a hold would pull new phyxels to
// where they would be without the motion of the piece. For a piece without phyxels, its family counts.
std::vector<std::uint8_t> Resampler::find_loose(std::span<const std::int32_t> family, std::size_t count,
                                                const std::function<bool(std::size_t)>& acts_on) const {
    std::vector<std::uint8_t> is_loose(family.size(), 0);
    if (count == 0) return is_loose;
    std::vector<std::uint8_t> is_attached(family.size(), 0), family_is_attached(family.size(), 0);
    for (std::size_t k = 0; k < family.size(); ++k) {
        is_attached[k] = std::any_of(members_[k].begin(), members_[k].end(), std::cref(acts_on));
        if (is_attached[k] != 0) family_is_attached[static_cast<std::size_t>(family[k])] = 1;
    }
    for (std::size_t k = 0; k < family.size(); ++k)
        if (family[k] >= 0)
            is_loose[k] = members_[k].empty() ? family_is_attached[static_cast<std::size_t>(family[k])] == 0
                                              : is_attached[k] == 0;
    return is_loose;
}

// Adds phyxels to small elastic pieces until every neighbourhood spans space or no nodes are left. Large
// pieces get none: the few phyxels at their thin ends whose rank dropped stay so, because new phyxels would
// change the strain around them and release elastic energy.
void Resampler::fill_pieces(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds) {
    std::size_t old_count = samples_.phyxels.size();
    const std::vector<std::size_t> count = samples_.count_by_piece(context_.pieces.count());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const std::size_t wanted = kinds[k] == Kind::small
                                       ? std::min(tuning::resampling::min_piece_phyxels, nodes[k].size())
                                   : kinds[k] == Kind::rigid ? 1
                                                             : 0;
        if (count[k] < wanted) add_samples(static_cast<std::int32_t>(k), nodes[k], wanted, 0);
        if (kinds[k] == Kind::small && is_sparse(count[k], extents_[k][0]))
            add_samples(static_cast<std::int32_t>(k), nodes[k], nodes[k].size(), samples_.spacing);
    }
    refresh_links(old_count);
    for (int iteration = 0; iteration < tuning::resampling::rank_iterations; ++iteration) {
        old_count = samples_.phyxels.size();
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            if (kinds[k] != Kind::small) continue;
            const std::vector<std::uint32_t> members = members_[k];
            for (const std::uint32_t i : members)
                if (samples_.neighbourhoods.rank()[i] < 3) add_samples_around(i, nodes[k]);
        }
        if (samples_.phyxels.size() == old_count) break;
        refresh_links(old_count);
    }
}

// Moves a new phyxel as its links do. The kernel of its node is that before the cut and may reach across it.
void Resampler::move_with_links(std::size_t i) {
    meshless::Phyxels& phyxels = samples_.phyxels;
    const meshless::Neighbourhoods& links = samples_.neighbourhoods;
    const auto sum_over = [&](int least_rank) {
        NodeState sum;
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            const std::uint32_t j = links.neighbour()[l];
            if (links.rank()[j] >= least_rank)
                add_motion(j, phyxels.rest_position[i], links.weight()[l], sum);
        }
        return sum;
    };
    NodeState sum = sum_over(3);
    if (!(sum.weight > 0)) sum = sum_over(0);
    if (!(sum.weight > 0)) return;
    sum.divide();
    phyxels.position[i] = phyxels.previous_position[i] = sum.position;
    phyxels.velocity[i] = phyxels.previous_velocity[i] = sum.velocity;
    phyxels.deformation[i] = samples_.previous_deformation[i] = sum.jacobian;
    phyxels.rotation[i] = rotation_of(sum.jacobian, phyxels.rotation[i]);
    phyxels.plastic_strain[i] = sum.plastic_strain;
}

// Adds phyxels where parts of a piece are connected by so little material that no pair of phyxels reaches
// across it.
void Resampler::fill_gaps(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds) {
    for (int iteration = 0; iteration < tuning::resampling::gap_iterations && !change_.gaps.empty();
         ++iteration) {
        const std::size_t old_count = samples_.phyxels.size();
        for (const Gap& gap : change_.gaps) {
            const std::int32_t piece = samples_.phyxels.piece[gap.inside];
            if (kinds[static_cast<std::size_t>(piece)] == Kind::rigid) continue;
            const std::vector<std::uint32_t>& of_piece = nodes[static_cast<std::size_t>(piece)];
            const auto found = std::find_if(of_piece.begin(), of_piece.end(), [&](std::uint32_t n) {
                return context_.nodes.node[n] == gap.node;
            });
            if (found != of_piece.end()) add_sample(*found, piece);
        }
        if (samples_.phyxels.size() == old_count) return;
        refresh_links(old_count);
        for (std::size_t i = old_count; i < samples_.phyxels.size(); ++i) move_with_links(i);
    }
}

// Whether a piece is a chain of phyxels: thin in two directions, with at least half of its neighbourhoods
// rank-deficient.
bool Resampler::is_chain(std::size_t piece) const {
    const std::vector<std::uint32_t>& members = members_[piece];
    const auto deficient =
        static_cast<std::size_t>(std::count_if(members.begin(), members.end(), [&](std::uint32_t i) {
            return samples_.neighbourhoods.rank()[i] < 3;
        }));
    return 2 * deficient >= members.size() &&
           extents_[piece][1] < tuning::resampling::rigid_length * samples_.spacing;
}

// Returns the treatment of each piece; pieces without listed nodes stay untouched.
std::vector<Resampler::Kind> Resampler::kinds_of(std::span<const std::vector<std::uint32_t>> nodes) const {
    const std::vector<std::size_t> count = samples_.count_by_piece(context_.pieces.count());
    // A piece with held phyxels cannot have its strain reset, so it gets no new phyxels.
    std::vector<std::uint8_t> held(nodes.size(), 0);
    for (std::size_t i = 0; i < attachments_.held.size(); ++i)
        if (attachments_.held[i] != 0) held[static_cast<std::size_t>(samples_.phyxels.piece[i])] = 1;
    std::vector<Kind> kinds(nodes.size(), Kind::untouched);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (nodes[k].empty()) continue;
        const double length = extents_[k][0] / samples_.spacing;
        const bool was_rigid = samples_.phyxels.rigid.index(samples_.lumping.piece[nodes[k].front()]) >= 0;
        if (was_rigid || is_fast(static_cast<std::int32_t>(k)) || length < tuning::resampling::rigid_length)
            kinds[k] = Kind::rigid;
        else
            kinds[k] = held[k] == 0 && ((count[k] < tuning::resampling::small_phyxel_count &&
                                         length < tuning::resampling::small_length) ||
                                        is_sparse(count[k], length * samples_.spacing))
                           ? Kind::small
                           : Kind::large;
    }
    return kinds;
}

void Resampler::make_rigid(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds) {
    std::vector<std::pair<meshless::RigidPiece, std::vector<Vec3>>> made;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (kinds[k] != Kind::rigid) continue;
        const meshless::RigidPiece body = initial_rigid_piece(static_cast<std::int32_t>(k), nodes[k]);
        made.emplace_back(body, contact_points(body, nodes[k]));
    }
    for (const auto& [body, points] : made) samples_.phyxels.rigid.put(body, points);
    // Rigid pieces have no elastic links.
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (kinds[k] != Kind::rigid) continue;
        for (const std::uint32_t i : members_[k])
            for (std::uint32_t l = samples_.neighbourhoods.links_begin(i);
                 l < samples_.neighbourhoods.links_end(i); ++l) {
                const std::uint32_t pair = samples_.neighbourhoods.pair()[l];
                if (!(samples_.pairs.visibility[pair] > 0)) continue;
                samples_.pairs.visibility[pair] = 0;
                change_.dirty_pairs.push_back(pair);
            }
    }
}

// Resets the strain of small pieces that got phyxels, or whose elastic energy has grown by the change of
// neighbours: releasing that energy would add it to the motion.
void Resampler::reset_small_strains(std::span<const Kind> kinds, std::size_t old_count) {
    const meshless::Phyxels& phyxels = samples_.phyxels;
    for (std::size_t k = 0; k < kinds.size(); ++k) {
        if (kinds[k] != Kind::small) continue;
        const std::vector<std::uint32_t>& members = members_[k];
        if (members.empty()) continue;
        double before = 0, after = 0, noise = 0;  // J
        for (const std::uint32_t i : members) {
            const auto energy = [&](const Mat3& F, const Mat3& R) {
                return phyxels.volume[i] *
                       meshless::energy_density(context_.material, F, R, phyxels.plastic_strain[i]);
            };
            Mat3 deformation, rotation;
            meshless::compute_deformation_of(i, samples_.neighbourhoods, phyxels.rest_position,
                                             phyxels.position, phyxels.rotation[i], deformation, rotation);
            noise += tuning::resampling::noise_strain * tuning::resampling::noise_strain *
                     context_.material.youngs_modulus * phyxels.volume[i];
            before += energy(phyxels.deformation[i], phyxels.rotation[i]);
            after += energy(deformation, rotation);
        }
        if (members.back() >= old_count || after > 1.01 * before + noise) reset_strain(members);
    }
}

// Moves phyxels to where they lie without elastic strain. Keeps centre of mass, momenta, mean rotation and
// mean plastic strain.
void Resampler::reset_strain(std::span<const std::uint32_t> members) {
    std::vector<meshless::Momenta> parts;
    Vec3 rest = Vec3::Zero();
    Mat3 mean = Mat3::Zero(), plastic_strain = Mat3::Zero();
    double total = 0;
    for (const std::uint32_t i : members) {
        meshless::Momenta one;
        one.mass = samples_.phyxels.mass[i];
        one.centre = samples_.phyxels.position[i];
        one.linear = one.mass * samples_.phyxels.velocity[i];
        parts.push_back(one);
        total += one.mass;
        rest += one.mass * samples_.phyxels.rest_position[i];
        mean += one.mass * samples_.phyxels.deformation[i];
        plastic_strain += one.mass * samples_.phyxels.plastic_strain[i];
    }
    if (!(total > 0)) return;
    rest /= total;
    plastic_strain /= total;
    const meshless::Momenta sum = meshless::together(parts);
    const Mat3 stretch = meshless::stretch_of(context_.material, plastic_strain);
    Mat3 covariance = 0.01 * samples_.spacing * samples_.spacing * mean * stretch;
    for (const std::uint32_t i : members)
        covariance += samples_.phyxels.mass[i] * (samples_.phyxels.position[i] - sum.centre) *
                      (stretch * (samples_.phyxels.rest_position[i] - rest)).transpose();
    const Mat3 rotation = rotation_of(covariance, rotation_of(mean));
    Mat3 inertia = Mat3::Zero();
    for (const std::uint32_t i : members) {
        const Vec3 arm = rotation * stretch * (samples_.phyxels.rest_position[i] - rest);
        inertia += samples_.phyxels.mass[i] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    const Vec3 rotation_rate = meshless::angular_velocity(inertia, sum.angular_momentum);
    for (const std::uint32_t i : members) {
        const Vec3 arm = rotation * stretch * (samples_.phyxels.rest_position[i] - rest);
        samples_.phyxels.position[i] = samples_.phyxels.previous_position[i] = sum.centre + arm;
        samples_.phyxels.velocity[i] = samples_.phyxels.previous_velocity[i] =
            sum.linear / sum.mass + rotation_rate.cross(arm);
        samples_.phyxels.deformation[i] = samples_.previous_deformation[i] = rotation * stretch;
        samples_.phyxels.rotation[i] = rotation;
        samples_.phyxels.plastic_strain[i] = plastic_strain;
        samples_.phyxels.restart_history[i] = 1;
    }
}

void Resampler::run() {
    const std::size_t before = samples_.phyxels.size();
    const std::vector<std::int32_t> family = families_of(change_.splits, context_.pieces.count());
    std::vector<std::vector<std::uint32_t>> nodes(context_.pieces.count());  // of touched pieces
    for (std::uint32_t n = 0; n < context_.nodes.size(); ++n) {
        const auto piece = static_cast<std::size_t>(context_.nodes.piece[n]);
        if (family[piece] >= 0) nodes[piece].push_back(n);
    }
    members_.resize(nodes.size());
    for (std::uint32_t i = 0; i < before; ++i) {
        const auto piece = static_cast<std::size_t>(samples_.phyxels.piece[i]);
        if (family[piece] >= 0) members_[piece].push_back(i);
    }
    extents_.resize(nodes.size());
    context_.parallel.for_each(nodes.size(), 16, [&](std::size_t k) {
        if (!nodes[k].empty()) extents_[k] = context_.nodes.extents_of(nodes[k]);
    });
    std::vector<Kind> kinds = kinds_of(nodes);
    std::vector<std::int32_t> elastic_family = family;  // -1 also for parts of rigid pieces: they conserve it
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (!nodes[k].empty() && samples_.phyxels.rigid.index(samples_.lumping.piece[nodes[k].front()]) >= 0)
            elastic_family[k] = -1;
    // Parts that had no phyxels have no momentum to conserve.
    for (const splitting::PieceSplit& split : change_.splits)
        if (split.parent == split.piece && !is_fast(split.piece) && !has_gap(split.piece))
            elastic_family[static_cast<std::size_t>(split.piece)] = -1;
    const meshless::SplitMomentum split_momentum(samples_.phyxels, elastic_family, attachments_.held);
    is_loose_ = find_loose(family, attachments_.holds, attachments_.hold_acts_on);
    is_unpulled_ = find_loose(family, attachments_.handles, attachments_.handle_acts_on);
    fill_pieces(nodes, kinds);
    fill_gaps(nodes, kinds);
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if ((kinds[k] == Kind::small || kinds[k] == Kind::large) && is_chain(k)) kinds[k] = Kind::rigid;
    make_rigid(nodes, kinds);
    meshless::relump_after_split(samples_.lumping, context_.nodes.for_lumping(), context_.material.density,
                                 samples_.locator, samples_.phyxels, context_.parallel);
    reset_small_strains(kinds, before);
    split_momentum.settle(samples_.phyxels);
    meshless::write_phyxels(samples_.phyxels);
    for (std::size_t i = 0; i < samples_.phyxels.size(); ++i) {
        if (kinds[static_cast<std::size_t>(samples_.phyxels.piece[i])] != Kind::rigid) continue;
        samples_.phyxels.previous_position[i] = samples_.phyxels.position[i];
        samples_.phyxels.previous_velocity[i] = samples_.phyxels.velocity[i];
        samples_.previous_deformation[i] = samples_.phyxels.deformation[i];
    }
    change_.volumes_changed = true;
    change_.new_phyxels = samples_.phyxels.size() - before;
}

}  // namespace

void resample(const SampleContext& context, const splitting::Surface& surface, const NodeTracker& tracker,
              const Attachments& attachments, ElasticSamples& samples, TopologyChange& change) {
    Resampler(context, surface, tracker, attachments, samples, change).run();
}

}  // namespace splitcubes::body
