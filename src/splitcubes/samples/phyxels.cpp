#include <splitcubes/math/decompose.h>
#include <splitcubes/samples/phyxels.h>

#include <algorithm>
#include <functional>

namespace splitcubes::meshless {

namespace {

// Momenta are summed in two passes, the second relative to the centre of mass and its velocity, so that a
// fast body or one far from the origin loses no digits of its angular momentum.
void add_linear(const Phyxels& phyxels, std::size_t i, Momenta& sum) {
    sum.mass += phyxels.mass[i];
    sum.centre += phyxels.mass[i] * phyxels.position[i];  // kg m until divided by mass
    sum.linear += phyxels.mass[i] * phyxels.velocity[i];
}

void add_angular(const Phyxels& phyxels, std::size_t i, Momenta& sum) {
    if (!(sum.mass > 0)) return;
    const double m = phyxels.mass[i];
    const Vec3 arm = phyxels.position[i] - sum.centre;
    const Vec3 relative = phyxels.velocity[i] - sum.linear / sum.mass;
    sum.angular_momentum += m * arm.cross(relative);
    sum.inertia += m * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
}

}  // namespace

void Phyxels::append(const PhyxelStart& start) {
    rest_position.push_back(start.rest_position);
    position.push_back(start.position);
    velocity.push_back(start.velocity);
    previous_position.push_back(start.position);
    previous_velocity.push_back(start.velocity);
    mass.push_back(0);
    volume.push_back(0);
    support_radius.push_back(start.support_radius);
    contact_radius.push_back(start.contact_radius);
    deformation.push_back(start.deformation);
    rotation.push_back(rotation_of(start.deformation));
    plastic_strain.push_back(start.plastic_strain);
    piece.push_back(start.piece);
    restart_history.push_back(1);
    touching.push_back(0);
    held.push_back(0);
    elastic_energy.push_back(0);
    reserve.push_back(0);
    ignored_holds.push_back(start.ignored_holds);
    ignored_handles.push_back(start.ignored_handles);
}

void Phyxels::append(const Vec3& rest, double contact_radius_metres, std::int32_t piece_number) {
    PhyxelStart start;
    start.rest_position = start.position = rest;
    start.contact_radius = contact_radius_metres;
    start.piece = piece_number;
    append(start);
}

void momenta_of_pieces(const Phyxels& phyxels, int piece_count, std::vector<Momenta>& out) {
    out.assign(static_cast<std::size_t>(piece_count), Momenta{});
    const auto each = [&](const auto& add) {
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const std::int32_t piece = phyxels.piece[i];
            if (piece < 0 || piece >= piece_count || phyxels.rigid.index(piece) >= 0) continue;
            add(phyxels, i, out[static_cast<std::size_t>(piece)]);
        }
    };
    each(add_linear);
    for (Momenta& sum : out)
        if (sum.mass > 0) sum.centre /= sum.mass;
    each(add_angular);
    for (const RigidPiece& body : phyxels.rigid.bodies)
        if (body.piece < piece_count) out[static_cast<std::size_t>(body.piece)] = momenta_of(body);
}

Momenta together(std::span<const Momenta> parts) {
    Momenta sum;
    for (const Momenta& part : parts) {
        sum.mass += part.mass;
        sum.centre += part.mass * part.centre;
        sum.linear += part.linear;
    }
    if (!(sum.mass > 0)) return sum;
    sum.centre /= sum.mass;
    for (const Momenta& part : parts) {
        const Vec3 arm = part.centre - sum.centre;
        sum.angular_momentum +=
            part.angular_momentum + arm.cross(part.linear - part.mass / sum.mass * sum.linear);
        sum.inertia +=
            part.inertia + part.mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    return sum;
}

void momenta_of_pieces(const Phyxels& phyxels, int piece_count, std::vector<Momenta>& out,
                       std::vector<Momenta>& partial, const Parallel& parallel) {
    constexpr std::size_t grain = 1024;
    const auto pieces = static_cast<std::size_t>(piece_count);
    const std::size_t chunks = (phyxels.size() + grain - 1) / grain;
    // With many pieces the partial sums would cost more than the threads save.
    if (chunks < 2 || pieces > 64 || !phyxels.rigid.empty())
        return momenta_of_pieces(phyxels, piece_count, out);
    partial.resize(chunks * pieces);
    const auto each = [&](const auto& add) {
        const auto chunk = [&](std::size_t begin, std::size_t end) {
            Momenta* const sums = partial.data() + begin / grain * pieces;
            for (std::size_t i = begin; i < end; ++i) {
                const std::int32_t piece = phyxels.piece[i];
                if (piece >= 0 && piece < piece_count) add(phyxels, i, sums[static_cast<std::size_t>(piece)]);
            }
        };
        parallel.for_chunks(phyxels.size(), grain, std::cref(chunk));
    };
    out.assign(pieces, Momenta{});
    partial.assign(chunks * pieces, Momenta{});
    each(add_linear);
    for (std::size_t k = 0; k < partial.size(); ++k) {
        Momenta& sum = out[k % pieces];
        sum.mass += partial[k].mass;
        sum.centre += partial[k].centre;
        sum.linear += partial[k].linear;
    }
    for (Momenta& sum : out)
        if (sum.mass > 0) sum.centre /= sum.mass;
    for (std::size_t k = 0; k < partial.size(); ++k) partial[k] = out[k % pieces];
    each(add_angular);
    for (std::size_t k = 0; k < partial.size(); ++k) {
        out[k % pieces].angular_momentum += partial[k].angular_momentum;
        out[k % pieces].inertia += partial[k].inertia;
    }
}

Momenta total_momenta(const Phyxels& phyxels) {
    std::vector<Momenta> parts(1);
    Momenta& elastic = parts.front();
    const auto each = [&](const auto& add) {
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.rigid.index(phyxels.piece[i]) < 0) add(phyxels, i, elastic);
    };
    each(add_linear);
    if (elastic.mass > 0) elastic.centre /= elastic.mass;
    each(add_angular);
    if (phyxels.rigid.empty()) return elastic;
    for (const RigidPiece& body : phyxels.rigid.bodies) parts.push_back(momenta_of(body));
    return together(parts);
}

Vec3 angular_velocity(const Mat3& inertia, const Vec3& angular_momentum, double min_inertia) {
    const SymmetricEigen eigen = eigen_symmetric(inertia);
    Vec3 omega = Vec3::Zero();
    for (int k = 0; k < 3; ++k)
        if (eigen.values[k] > std::max(1e-9 * eigen.values[0], min_inertia))
            omega += eigen.vectors.col(k) * (eigen.vectors.col(k).dot(angular_momentum) / eigen.values[k]);
    return omega;
}

}  // namespace splitcubes::meshless
