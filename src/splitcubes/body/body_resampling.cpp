// What becomes of pieces that came off: phyxels enough to span space, or rigid motion.
#include <splitcubes/body/body.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/split_momentum.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

// Phyxels that a piece gets where it has the nodes for them, before ranks are looked at.
constexpr std::size_t enough_phyxels = 8;
// Rounds of further phyxels where neighbourhoods do not span space, and how many each
// such phyxel gets in one.
constexpr int rank_iterations = 3;
constexpr int phyxels_per_round = 3;
// A piece whose length is below so many phyxel spacings, about one support radius, is
// rigid: all of its phyxels would see all of it, and its deformation would not be seen.
constexpr double rigid_length = 2;
// A piece of fewer phyxels than this and less than so many spacings long is small: it is
// filled up, and starts without strain where that, or the cut, would give it some.
constexpr std::size_t few_phyxels = 64;
constexpr double small_length = 6;
// Strain that is not looked at.
constexpr double noise_strain = 1e-4;

// Per piece, the family it belongs to: what was one piece before; -1 of untouched ones.
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

}  // namespace

// The lengths of the box of even density that has the second moments of the piece's
// nodes, each of them a cube of the grid; m, descending.
Vec3 Body::extents_of(std::span<const std::uint32_t> nodes) const {
    double volume = 0;
    Vec3 centre = Vec3::Zero();
    for (const std::uint32_t n : nodes) {
        volume += inside_volume_[n];
        centre += inside_volume_[n] * inside_rest_[n];
    }
    centre /= volume;
    const double h = grid_.rest().cell_size;
    Mat3 second = h * h / 12 * Mat3::Identity();
    for (const std::uint32_t n : nodes) {
        const Vec3 arm = inside_rest_[n] - centre;
        second += inside_volume_[n] / volume * arm * arm.transpose();
    }
    return (12 * eigen_symmetric(second).values).cwiseMax(0).cwiseSqrt();
}

// Where the old phyxels carry a node. Those that now belong to `side` go before others:
// the rest has parted from it. The node's own kernel, which knows what it sees, goes
// before the phyxels that hold its volume.
Body::NodeMotion Body::motion_of(std::uint32_t node, std::int32_t side) const {
    const Vec3& rest = inside_rest_[node];
    std::span<const std::uint32_t> seen, held{lumping_.phyxel};
    std::span<const double> seen_weight, held_weight{lumping_.share};
    const std::uint32_t begin = lumping_.offsets[node], count = lumping_.offsets[node + 1] - begin;
    held = held.subspan(begin, count);
    held_weight = held_weight.subspan(begin, count);
    const std::int32_t tracked = tracker_.find(inside_nodes_[node]);
    const meshless::NodeKernels& kernels = tracker_.kernels();
    if (tracked >= 0 && static_cast<std::size_t>(tracked) < kernels.size()) {
        const meshless::NodeKernels::Row& row = kernels.rows[static_cast<std::size_t>(tracked)];
        seen = std::span{kernels.phyxel}.subspan(row.begin, row.count);
        seen_weight = std::span{kernels.weight}.subspan(row.begin, row.count);
    }
    const auto sum_over = [&](std::span<const std::uint32_t> row, std::span<const double> weights,
                              bool own_side) {
        NodeMotion sum;
        for (std::size_t k = 0; k < row.size(); ++k) {
            const std::uint32_t i = row[k];
            if (own_side && phyxels_.piece[i] != side) continue;
            const double weight = std::abs(weights[k]);
            sum.weight += weight;
            sum.position += weight * (phyxels_.position[i] +
                                      phyxels_.deformation[i] * (rest - phyxels_.rest_position[i]));
            sum.jacobian += weight * phyxels_.deformation[i];
            sum.velocity += weight * phyxels_.velocity[i];
            sum.plastic_strain += weight * phyxels_.plastic_strain[i];
        }
        return sum;
    };
    NodeMotion sum;
    for (const bool own_side : {true, false}) {
        if (!(sum.weight > 0)) sum = sum_over(seen, seen_weight, own_side);
        if (!(sum.weight > 0)) sum = sum_over(held, held_weight, own_side);
    }
    if (!(sum.weight > 0)) return NodeMotion{rest, Mat3::Identity()};
    sum.position /= sum.weight;
    sum.jacobian /= sum.weight;
    sum.velocity /= sum.weight;
    sum.plastic_strain /= sum.weight;
    return sum;
}

void Body::add_sample(std::uint32_t node, std::int32_t piece) {
    const NodeMotion motion = motion_of(node, piece);
    meshless::PhyxelStart start;
    start.rest_position = inside_rest_[node];
    start.piece = piece;
    start.contact_radius = 0.5 * grid_.rest().cell_size;
    start.position = motion.position;
    start.deformation = motion.jacobian;
    start.velocity = motion.velocity;
    start.plastic_strain = motion.plastic_strain;
    phyxels_.append(start);
    owner_.push_back(inside_nodes_[node]);
    previous_deformation_.push_back(start.deformation);
}

// New phyxels for a piece, at its own nodes, each as far as can be from those it has
// (farthest-point order), until there are as many as wanted or all nodes are within a
// distance, m, of one.
void Body::add_samples(std::int32_t piece, std::span<const std::uint32_t> nodes, std::size_t wanted,
                       double within) {
    std::vector<double> distance(nodes.size(), 1e300);
    std::size_t have = 0;
    const auto take_in = [&](const Vec3& rest) {
        ++have;
        for (std::size_t k = 0; k < nodes.size(); ++k)
            distance[k] = std::min(distance[k], (inside_rest_[nodes[k]] - rest).squaredNorm());
    };
    for (std::size_t i = 0; i < phyxels_.size(); ++i)
        if (phyxels_.piece[i] == piece) take_in(phyxels_.rest_position[i]);
    const double half_cell = 0.5 * grid_.rest().cell_size;
    const double least = std::max(within * within, half_cell * half_cell);
    while (have < wanted) {
        const auto far = std::max_element(distance.begin(), distance.end());
        if (far == distance.end() || *far < least) return;
        const std::uint32_t n = nodes[static_cast<std::size_t>(far - distance.begin())];
        add_sample(n, piece);
        take_in(inside_rest_[n]);
    }
}

// Further phyxels around one whose neighbours do not span space: at nodes of its piece
// within its reach that it sees, the farthest from all phyxels around first. Returns
// how many.
std::size_t Body::widen(std::uint32_t phyxel, std::span<const std::uint32_t> nodes) {
    const Vec3 rest = phyxels_.rest_position[phyxel];
    const double reach = 0.9 * phyxels_.support_radius[phyxel];
    const double least = 0.25 * grid_.rest().cell_size * grid_.rest().cell_size;
    std::vector<std::uint32_t> near;
    for (const std::uint32_t n : nodes)
        if ((inside_rest_[n] - rest).squaredNorm() < reach * reach &&
            !occluders_.segment_blocked(rest, inside_rest_[n]))
            near.push_back(n);
    std::vector<double> distance(near.size(), 1e300);
    const auto take_in = [&](const Vec3& at) {
        for (std::size_t k = 0; k < near.size(); ++k)
            distance[k] = std::min(distance[k], (inside_rest_[near[k]] - at).squaredNorm());
    };
    const std::int32_t piece = phyxels_.piece[phyxel];
    for (std::size_t i = 0; i < phyxels_.size(); ++i)
        if (phyxels_.piece[i] == piece &&
            (phyxels_.rest_position[i] - rest).squaredNorm() < 4 * reach * reach)
            take_in(phyxels_.rest_position[i]);
    std::size_t added = 0;
    for (int k = 0; k < phyxels_per_round; ++k) {
        const auto far = std::max_element(distance.begin(), distance.end());
        if (far == distance.end() || *far < least) break;
        const std::uint32_t n = near[static_cast<std::size_t>(far - distance.begin())];
        add_sample(n, piece);
        take_in(inside_rest_[n]);
        ++added;
    }
    return added;
}

// Mass, centre and inertia of a rigid body of these nodes, by its shape.
void Body::weigh_nodes(std::span<const std::uint32_t> nodes, meshless::RigidPiece& body) const {
    std::vector<Vec3> rest;
    std::vector<double> mass;
    for (const std::uint32_t n : nodes) {
        rest.push_back(inside_rest_[n]);
        mass.push_back(settings_.material.density * inside_volume_[n]);
    }
    meshless::weigh({rest, mass, grid_.rest().cell_size}, body);
}

// The rigid body that a piece becomes. Of a rigid one it is a part, and moves as that
// did. Else it is put as its nodes lie on average, without strain (they were carried by
// phyxels on both sides of what was cut, so their places may be far apart), and makes
// the rigid motion that fits the phyxels best that held its mass: its nodes span less
// than those, so their angular momentum would make it whirl.
meshless::RigidPiece Body::rigid_start(std::int32_t piece, std::span<const std::uint32_t> nodes) const {
    const double density = settings_.material.density;
    const double edge = grid_.rest().cell_size;
    meshless::RigidPiece body;
    body.piece = piece;
    const std::int32_t parent = phyxels_.rigid.index(lumping_.piece[nodes.front()]);
    if (parent >= 0) {
        const meshless::RigidPiece& whole = phyxels_.rigid.bodies[static_cast<std::size_t>(parent)];
        body.shape = whole.shape;
        body.rotation = whole.rotation;
        weigh_nodes(nodes, body);
        body.centre = whole.world_point_of_rest(body.rest_centre);
        body.momentum = body.mass * whole.velocity_at(body.centre);
        body.angular_momentum =
            body.rotation * body.inertia * body.rotation.transpose() * whole.angular_velocity();
        return body;
    }
    std::vector<NodeMotion> motions;
    std::vector<double> mass;  // kg, per node
    Mat3 plastic_strain = Mat3::Zero();
    double total = 0;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        motions.push_back(motion_of(nodes[k], piece));
        mass.push_back(density * inside_volume_[nodes[k]]);
        plastic_strain += mass[k] * motions[k].plastic_strain;
        body.centre += mass[k] * motions[k].position;
        total += mass[k];
    }
    body.centre /= total;
    body.shape = meshless::stretch_of(settings_.material, plastic_strain / total);
    weigh_nodes(nodes, body);
    Mat3 turned = Mat3::Zero(), mean = Mat3::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const Vec3 own = body.shape * (inside_rest_[nodes[k]] - body.rest_centre);
        turned += mass[k] * (motions[k].position - body.centre) * own.transpose();
        turned += mass[k] * edge * edge / 12 * motions[k].jacobian * body.shape;
        mean += mass[k] / total * motions[k].jacobian;
    }
    body.rotation = rotation_of(turned, rotation_of(mean));

    std::vector<meshless::Momenta> held;
    for (std::size_t k = 0; k < nodes.size(); ++k)
        for (std::uint32_t e = lumping_.offsets[nodes[k]]; e < lumping_.offsets[nodes[k] + 1]; ++e) {
            meshless::Momenta one;
            // Who holds more is asked more, however it adds up: shares below zero fit nothing.
            one.mass = mass[k] * std::abs(lumping_.share[e]);
            one.centre = phyxels_.position[lumping_.phyxel[e]];
            one.linear = one.mass * phyxels_.velocity[lumping_.phyxel[e]];
            held.push_back(one);
        }
    const meshless::Momenta sum = meshless::together(held);
    // About axes along which they hardly spread they tell no turning.
    const double least = 0.01 * sum.mass * edge * edge;
    const Vec3 rotation_rate = meshless::angular_velocity(sum.inertia, sum.angular_momentum, least);
    body.momentum = body.mass * (sum.linear / sum.mass + rotation_rate.cross(body.centre - sum.centre));
    body.angular_momentum = body.rotation * body.inertia * body.rotation.transpose() * rotation_rate;
    return body;
}

// Where a rigid piece touches other things: its outermost corners, seen from 26 sides;
// own frame, m.
std::vector<Vec3> Body::contact_points(const meshless::RigidPiece& body,
                                       std::span<const std::uint32_t> nodes) const {
    std::vector<Vec3> corners;
    const double h = grid_.rest().cell_size;
    for (const std::uint32_t n : nodes) {
        const auto [low, high] = node_reach(inside_nodes_[n]);
        for (int c = 0; c < 8; ++c) {
            Vec3 offset;
            for (int k = 0; k < 3; ++k) offset[k] = (c >> k & 1) != 0 ? high[k] : -low[k];
            corners.push_back(body.shape * (inside_rest_[n] + h * offset - body.rest_centre));
        }
    }
    std::vector<std::size_t> outer;
    for (int d = 0; d < 27; ++d) {
        const Vec3 direction(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
        if (direction.isZero(0)) continue;
        std::size_t best = 0;
        for (std::size_t c = 1; c < corners.size(); ++c)
            if (direction.dot(corners[c]) > direction.dot(corners[best])) best = c;
        outer.push_back(best);
    }
    std::sort(outer.begin(), outer.end());
    outer.erase(std::unique(outer.begin(), outer.end()), outer.end());
    std::vector<Vec3> points;
    for (const std::size_t c : outer) points.push_back(corners[c]);
    return points;
}

// A piece with fewer phyxels than spacings along its length: a slab, cut out between two
// layers of them, may have none.
bool Body::is_sparse(std::size_t phyxels, double length) const {
    return static_cast<double>(phyxels) * spacing_ < length;
}

void Body::refresh_links(const StepContext& context, std::size_t known) {
    if (phyxels_.size() != known) {
        rebuild_samples(context.parallel);
        neighbourhoods_.rebuild(phyxels_, pairs_, settings_.material, context.parallel);
        constrained_.clear();
        grabbed_.clear();
        tracker_.mark_all();
    } else if (!changed_pairs_.empty()) {
        neighbourhoods_.update(phyxels_, pairs_, changed_pairs_, settings_.material, context.parallel);
    }
    changed_pairs_.clear();
}

// Small elastic pieces of the families get phyxels until every neighbourhood spans space,
// or there are no more nodes to put them at. In large ones the few at thin ends that lost
// a direction go without it: what new ones would change in the strain around would be
// released as energy.
void Body::fill_pieces(const StepContext& context, std::span<const std::vector<std::uint32_t>> nodes,
                       std::span<const Kind> kinds) {
    std::size_t known = phyxels_.size();
    const std::vector<std::size_t> count = phyxel_counts();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const std::size_t wanted = kinds[k] == Kind::small   ? std::min(enough_phyxels, nodes[k].size())
                                   : kinds[k] == Kind::rigid ? 1
                                                             : 0;
        if (count[k] < wanted) add_samples(static_cast<std::int32_t>(k), nodes[k], wanted, 0);
        if (kinds[k] == Kind::small && is_sparse(count[k], extents_of(nodes[k])[0]))
            add_samples(static_cast<std::int32_t>(k), nodes[k], nodes[k].size(), spacing_);
    }
    refresh_links(context, known);
    for (int iteration = 0; iteration < rank_iterations; ++iteration) {
        known = phyxels_.size();
        for (std::uint32_t i = 0; i < known; ++i) {
            const auto piece = static_cast<std::size_t>(phyxels_.piece[i]);
            if (kinds[piece] == Kind::small && neighbourhoods_.rank()[i] < 3) widen(i, nodes[piece]);
        }
        if (phyxels_.size() == known) break;
        refresh_links(context, known);
    }
}

// Whether most of a piece does not span space and it is thin in two directions: it
// would be a string of beads.
bool Body::is_string(std::int32_t piece, std::span<const std::uint32_t> nodes) const {
    std::size_t all = 0, flat = 0;
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (phyxels_.piece[i] != piece) continue;
        ++all;
        flat += neighbourhoods_.rank()[i] < 3;
    }
    return 2 * flat >= all && extents_of(nodes)[1] < rigid_length * spacing_;
}

std::vector<std::size_t> Body::phyxel_counts() const {
    std::vector<std::size_t> count(pieces_->count(), 0);
    for (const std::int32_t piece : phyxels_.piece) ++count[static_cast<std::size_t>(piece)];
    return count;
}

// What becomes of the pieces; of those without nodes nothing.
std::vector<Body::Kind> Body::kinds_of(std::span<const std::vector<std::uint32_t>> nodes) const {
    const std::vector<std::size_t> count = phyxel_counts();
    // What is held stays where it is held: it cannot start without strain, so it is not filled up.
    std::vector<std::uint8_t> held(nodes.size(), 0);
    for (std::size_t i = 0; i < held_.size(); ++i)
        if (held_[i] != 0) held[static_cast<std::size_t>(phyxels_.piece[i])] = 1;
    std::vector<Kind> kinds(nodes.size(), Kind::untouched);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (nodes[k].empty()) continue;
        const double length = extents_of(nodes[k])[0] / spacing_;
        const bool was_rigid = phyxels_.rigid.index(lumping_.piece[nodes[k].front()]) >= 0;
        if (was_rigid || length < rigid_length)
            kinds[k] = Kind::rigid;
        else
            kinds[k] = held[k] == 0 && ((count[k] < few_phyxels && length < small_length) ||
                                        is_sparse(count[k], length * spacing_))
                           ? Kind::small
                           : Kind::large;
    }
    return kinds;
}

void Body::make_rigid(std::span<const std::vector<std::uint32_t>> nodes, std::span<const Kind> kinds) {
    meshless::RigidPieces all;
    const meshless::RigidPieces& old = phyxels_.rigid;
    for (const meshless::RigidPiece& body : old.bodies)
        if (kinds[static_cast<std::size_t>(body.piece)] == Kind::untouched)
            all.put(body, old.points_of(body));
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (kinds[k] != Kind::rigid) continue;
        const meshless::RigidPiece body = rigid_start(static_cast<std::int32_t>(k), nodes[k]);
        all.put(body, contact_points(body, nodes[k]));
    }
    phyxels_.rigid = std::move(all);
    // Nothing elastic is left within them.
    for (std::uint32_t k = 0; k < pairs_.size(); ++k) {
        if (!(pairs_.visibility[k] > 0) || phyxels_.rigid.index(phyxels_.piece[pairs_.a[k]]) < 0) continue;
        pairs_.visibility[k] = 0;
        changed_pairs_.push_back(k);
    }
}

// Small pieces that got phyxels, or whose strain has come to hold more energy by other
// neighbours: they would release it, and it is none that they had.
void Body::reset_small_strains(std::span<const Kind> kinds, std::size_t known, const Parallel& parallel) {
    std::vector<Mat3> deformation(phyxels_.size()), rotation(phyxels_.size());
    meshless::compute_deformation(neighbourhoods_, phyxels_.rest_position, phyxels_.position,
                                  phyxels_.rotation, deformation, rotation, parallel);
    std::vector<double> before(kinds.size(), 0), after(kinds.size(), 0), noise(kinds.size(), 0);  // J
    std::vector<std::vector<std::size_t>> members(kinds.size());
    std::vector<std::uint8_t> grown(kinds.size(), 0);
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        const auto piece = static_cast<std::size_t>(phyxels_.piece[i]);
        if (kinds[piece] != Kind::small) continue;
        members[piece].push_back(i);
        if (i >= known) grown[piece] = 1;
        const auto energy = [&](const Mat3& F, const Mat3& R) {
            return phyxels_.volume[i] *
                   meshless::energy_density(settings_.material, F, R, phyxels_.plastic_strain[i]);
        };
        noise[piece] += noise_strain * noise_strain * settings_.material.youngs_modulus * phyxels_.volume[i];
        before[piece] += energy(phyxels_.deformation[i], phyxels_.rotation[i]);
        after[piece] += energy(deformation[i], rotation[i]);
    }
    for (std::size_t k = 0; k < kinds.size(); ++k)
        if (grown[k] != 0 || after[k] > 1.01 * before[k] + noise[k]) reset_strain(members[k]);
}

// Puts phyxels as they would lie without strain; centre, momenta, mean rotation and mean
// plastic strain stay.
void Body::reset_strain(std::span<const std::size_t> members) {
    std::vector<meshless::Momenta> parts;
    Vec3 rest = Vec3::Zero();
    Mat3 mean = Mat3::Zero(), plastic_strain = Mat3::Zero();
    double total = 0;
    for (const std::size_t i : members) {
        meshless::Momenta one;
        one.mass = phyxels_.mass[i];
        one.centre = phyxels_.position[i];
        one.linear = one.mass * phyxels_.velocity[i];
        parts.push_back(one);
        total += one.mass;
        rest += one.mass * phyxels_.rest_position[i];
        mean += one.mass * phyxels_.deformation[i];
        plastic_strain += one.mass * phyxels_.plastic_strain[i];
    }
    if (!(total > 0)) return;
    rest /= total;
    plastic_strain /= total;
    const meshless::Momenta sum = meshless::together(parts);
    const Mat3 stretch = meshless::stretch_of(settings_.material, plastic_strain);
    Mat3 turned = 0.01 * spacing_ * spacing_ * mean * stretch;
    for (const std::size_t i : members)
        turned += phyxels_.mass[i] * (phyxels_.position[i] - sum.centre) *
                  (stretch * (phyxels_.rest_position[i] - rest)).transpose();
    const Mat3 rotation = rotation_of(turned, rotation_of(mean));
    Mat3 inertia = Mat3::Zero();
    for (const std::size_t i : members) {
        const Vec3 arm = rotation * stretch * (phyxels_.rest_position[i] - rest);
        inertia += phyxels_.mass[i] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    const Vec3 rotation_rate = meshless::angular_velocity(inertia, sum.angular_momentum);
    for (const std::size_t i : members) {
        const Vec3 arm = rotation * stretch * (phyxels_.rest_position[i] - rest);
        phyxels_.position[i] = phyxels_.previous_position[i] = sum.centre + arm;
        phyxels_.velocity[i] = phyxels_.previous_velocity[i] =
            sum.linear / sum.mass + rotation_rate.cross(arm);
        phyxels_.deformation[i] = previous_deformation_[i] = rotation * stretch;
        phyxels_.rotation[i] = rotation;
        phyxels_.plastic_strain[i] = plastic_strain;
        phyxels_.history_broken[i] = 1;
    }
}

// Pieces that came off, and what they came off from: each gets phyxels enough to span
// space, or moves as a rigid body from now on. Mass follows the nodes; momenta are kept.
void Body::resample(const StepContext& context, StepReport& report) {
    volumes_changed_ = false;
    if (splits_.empty()) return;
    const std::size_t before = phyxels_.size();
    const std::vector<std::int32_t> family = families_of(splits_, pieces_->count());
    std::vector<std::vector<std::uint32_t>> nodes(pieces_->count());  // of touched pieces
    for (std::uint32_t n = 0; n < inside_nodes_.size(); ++n) {
        const auto piece = static_cast<std::size_t>(inside_piece_[n]);
        if (family[piece] >= 0) nodes[piece].push_back(n);
    }
    std::vector<Kind> kinds = kinds_of(nodes);
    std::vector<std::int32_t> elastic_family = family;  // a rigid one's parts make it up exactly
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (!nodes[k].empty() && phyxels_.rigid.index(lumping_.piece[nodes[k].front()]) >= 0)
            elastic_family[k] = -1;
    const meshless::SplitMomentum parting(phyxels_, elastic_family, held_);
    fill_pieces(context, nodes, kinds);
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if ((kinds[k] == Kind::small || kinds[k] == Kind::large) &&
            is_string(static_cast<std::int32_t>(k), nodes[k]))
            kinds[k] = Kind::rigid;
    make_rigid(nodes, kinds);
    meshless::relump_after_split(lumping_, {inside_rest_, inside_volume_, inside_piece_},
                                 settings_.material.density, locator_, phyxels_, context.parallel);
    reset_small_strains(kinds, before, context.parallel);
    parting.settle(phyxels_);
    meshless::write_phyxels(phyxels_);
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (kinds[static_cast<std::size_t>(phyxels_.piece[i])] != Kind::rigid) continue;
        phyxels_.previous_position[i] = phyxels_.position[i];
        phyxels_.previous_velocity[i] = phyxels_.velocity[i];
        previous_deformation_[i] = phyxels_.deformation[i];
    }
    volumes_changed_ = true;
    report.new_phyxels += phyxels_.size() - before;
}

}  // namespace splitcubes::body
