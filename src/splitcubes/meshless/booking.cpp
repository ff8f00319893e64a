#include <splitcubes/meshless/booking.h>
#include <splitcubes/meshless/booking_moments.h>
#include <splitcubes/meshless/kernel.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Numbers from 0 up stand for pieces; -1 for none.
std::size_t piece_limit(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
    std::int32_t highest = -1;
    for (const std::int32_t piece : a) highest = std::max(highest, piece);
    for (const std::int32_t piece : b) highest = std::max(highest, piece);
    return static_cast<std::size_t>(highest + 1);
}

// Books one node after another.
class Bookkeeper {
  public:
    Bookkeeper(const Phyxels& phyxels, const PhyxelLocator& locator) : phyxels_(phyxels), locator_(locator) {
        assert(locator.size() == phyxels.size());
        for (const double h : phyxels.support_radius) reach_ = std::max(reach_, h);
        members_.resize(piece_limit(phyxels.piece, {}));
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.piece[i] >= 0)
                members_[static_cast<std::size_t>(phyxels.piece[i])].push_back(static_cast<std::uint32_t>(i));
    }

    void add(const Vec3& node, std::int32_t piece, Booking& booking) {
        locator_.near(node, reach_, near_);
        double total = 0;
        const std::size_t begin = booking.phyxel.size();
        for (const std::uint32_t i : near_) {
            if (phyxels_.piece[i] != piece) continue;
            const double distance_squared = (phyxels_.rest_position[i] - node).squaredNorm();
            const double w = kernel(distance_squared, phyxels_.support_radius[i]);
            if (!(w > 0)) continue;
            booking.phyxel.push_back(i);
            booking.share.push_back(w);
            total += w;
        }
        for (std::size_t k = begin; k < booking.share.size(); ++k) booking.share[k] /= total;
        if (begin == booking.phyxel.size()) add_nearest(node, piece, booking);
        booking.offsets.push_back(static_cast<std::uint32_t>(booking.phyxel.size()));
    }

  private:
    void add_nearest(const Vec3& node, std::int32_t piece, Booking& booking) const {
        double least = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = 0;
        if (piece >= 0 && static_cast<std::size_t>(piece) < members_.size())
            for (const std::uint32_t i : members_[static_cast<std::size_t>(piece)]) {
                const double distance_squared = (phyxels_.rest_position[i] - node).squaredNorm();
                if (!(distance_squared < least)) continue;
                least = distance_squared;
                nearest = i;
            }
        if (least < std::numeric_limits<double>::infinity()) {
            booking.phyxel.push_back(nearest);
            booking.share.push_back(1);
        } else {
            ++booking.unbooked;
        }
    }

    const Phyxels& phyxels_;
    const PhyxelLocator& locator_;
    double reach_ = 0;                                 // m, largest support radius
    std::vector<std::vector<std::uint32_t>> members_;  // per piece, its phyxels ascending
    std::vector<std::uint32_t> near_;
};

// What the nodes of a piece carry, about a reference that moves along.
struct Carried {
    double mass = 0;              // kg
    Vec3 moment = Vec3::Zero();   // kg m, about the origin
    Vec3 linear = Vec3::Zero();   // kg m/s
    Vec3 angular = Vec3::Zero();  // kg m^2/s, about the reference
};

struct Reference {
    Vec3 centre = Vec3::Zero();    // m
    Vec3 velocity = Vec3::Zero();  // m/s
};

using Fates = std::vector<std::uint8_t>;  // per new piece, 1 = nodes or phyxels differ from the old piece

// The new pieces that are not one old piece as it was.
Fates changed_pieces(const Booking& booking, const NodeBook& nodes, const Phyxels& phyxels,
                     std::size_t piece_count, std::vector<std::int32_t>& old_piece) {
    Fates changed(piece_count, 0);
    old_piece.assign(piece_count, -1);
    const std::size_t known = booking.node_count();
    std::vector<std::size_t> new_size(piece_count, 0);
    std::vector<std::size_t> old_size(piece_limit(booking.piece, {}), 0);
    for (std::size_t b = 0; b < nodes.piece.size(); ++b) {
        const auto now = static_cast<std::size_t>(nodes.piece[b]);
        ++new_size[now];
        if (b >= known) {
            changed[now] = 1;
            continue;
        }
        ++old_size[static_cast<std::size_t>(booking.piece[b])];
        if (old_piece[now] >= 0 && old_piece[now] != booking.piece[b]) changed[now] = 1;
        old_piece[now] = booking.piece[b];
        for (std::uint32_t e = booking.offsets[b]; e < booking.offsets[b + 1]; ++e)
            if (phyxels.piece[booking.phyxel[e]] != nodes.piece[b]) changed[now] = 1;
    }
    for (std::size_t k = 0; k < piece_count; ++k)
        if (new_size[k] > 0 &&
            (old_piece[k] < 0 || new_size[k] != old_size[static_cast<std::size_t>(old_piece[k])]))
            changed[k] = 1;
    // A phyxel that no row names is new to the booking, or was without share.
    std::vector<std::uint8_t> booked(phyxels.size(), 0);
    for (const std::uint32_t i : booking.phyxel) booked[i] = 1;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (booked[i] == 0 && phyxels.piece[i] >= 0) changed[static_cast<std::size_t>(phyxels.piece[i])] = 1;
    return changed;
}

// Centre of mass and velocity of every old piece, from what its nodes carried.
std::vector<Reference> references(const Booking& booking, const NodeBook& nodes, double density,
                                  const Phyxels& phyxels) {
    std::vector<Carried> sums(piece_limit(booking.piece, {}));
    for (std::size_t b = 0; b < booking.node_count(); ++b) {
        Carried& sum = sums[static_cast<std::size_t>(booking.piece[b])];
        for (std::uint32_t e = booking.offsets[b]; e < booking.offsets[b + 1]; ++e) {
            const double m = density * nodes.volume[b] * booking.share[e];
            sum.mass += m;
            sum.moment += m * phyxels.position[booking.phyxel[e]];
            sum.linear += m * phyxels.velocity[booking.phyxel[e]];
        }
    }
    std::vector<Reference> result(sums.size());
    for (std::size_t k = 0; k < sums.size(); ++k)
        if (sums[k].mass > 0) result[k] = {sums[k].moment / sums[k].mass, sums[k].linear / sums[k].mass};
    return result;
}

}  // namespace

Booking book(const NodeBook& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
             const Parallel& parallel) {
    assert(nodes.volume.size() == nodes.rest_position.size());
    assert(nodes.piece.size() == nodes.rest_position.size());
    Booking booking;
    booking.offsets.push_back(0);
    booking.piece.assign(nodes.piece.begin(), nodes.piece.end());
    Bookkeeper keeper(phyxels, locator);
    for (std::size_t b = 0; b < nodes.rest_position.size(); ++b)
        keeper.add(nodes.rest_position[b], nodes.piece[b], booking);
    keep_moments(nodes, phyxels, std::vector<std::uint8_t>(nodes.piece.size(), 1), {}, booking, parallel);
    return booking;
}

void apply(const Booking& booking, std::span<const double> volumes, double density, Phyxels& phyxels) {
    assert(volumes.size() == booking.node_count());
    std::fill(phyxels.volume.begin(), phyxels.volume.end(), 0.0);
    for (std::size_t b = 0; b < booking.node_count(); ++b)
        for (std::uint32_t e = booking.offsets[b]; e < booking.offsets[b + 1]; ++e)
            phyxels.volume[booking.phyxel[e]] += booking.share[e] * volumes[b];
    for (std::size_t i = 0; i < phyxels.size(); ++i) phyxels.mass[i] = density * phyxels.volume[i];
}

void rebook(Booking& booking, const NodeBook& nodes, double density, const PhyxelLocator& locator,
            Phyxels& phyxels, const Parallel& parallel) {
    assert(booking.node_count() <= nodes.piece.size());
    const std::size_t piece_count = piece_limit(nodes.piece, phyxels.piece);
    std::vector<std::int32_t> old_piece;
    const Fates changed = changed_pieces(booking, nodes, phyxels, piece_count, old_piece);
    const std::vector<Reference> reference = references(booking, nodes, density, phyxels);
    const auto reference_of = [&](std::size_t piece) {
        return old_piece[piece] < 0 ? Reference{} : reference[static_cast<std::size_t>(old_piece[piece])];
    };

    std::vector<Carried> carried(piece_count);
    for (std::size_t b = 0; b < booking.node_count(); ++b) {
        const auto piece = static_cast<std::size_t>(nodes.piece[b]);
        const Reference about = reference_of(piece);
        for (std::uint32_t e = booking.offsets[b]; e < booking.offsets[b + 1]; ++e) {
            const double m = density * nodes.volume[b] * booking.share[e];
            const Vec3& x = phyxels.position[booking.phyxel[e]];
            const Vec3& v = phyxels.velocity[booking.phyxel[e]];
            carried[piece].mass += m;
            carried[piece].linear += m * v;
            carried[piece].angular += m * (x - about.centre).cross(v - about.velocity);
        }
    }

    Booking fresh;
    fresh.offsets.push_back(0);
    fresh.piece.assign(nodes.piece.begin(), nodes.piece.end());
    Bookkeeper keeper(phyxels, locator);
    std::vector<std::uint8_t> again(nodes.piece.size());
    for (std::size_t b = 0; b < nodes.piece.size(); ++b) {
        again[b] = b >= booking.node_count() || changed[static_cast<std::size_t>(nodes.piece[b])] != 0;
        if (again[b] != 0) {
            keeper.add(nodes.rest_position[b], nodes.piece[b], fresh);
            continue;
        }
        const std::uint32_t begin = booking.offsets[b], end = booking.offsets[b + 1];
        fresh.phyxel.insert(fresh.phyxel.end(), booking.phyxel.begin() + begin, booking.phyxel.begin() + end);
        fresh.share.insert(fresh.share.end(), booking.share.begin() + begin, booking.share.begin() + end);
        fresh.unbooked += begin == end;
        fresh.offsets.push_back(static_cast<std::uint32_t>(fresh.phyxel.size()));
    }
    keep_moments(nodes, phyxels, again, booking, fresh, parallel);
    std::vector<double> old_mass(piece_count, 0);  // of each piece's phyxels, as booked so far
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (phyxels.piece[i] >= 0) old_mass[static_cast<std::size_t>(phyxels.piece[i])] += phyxels.mass[i];
    booking = std::move(fresh);
    apply(booking, nodes.volume, density, phyxels);

    std::vector<Momenta> now;
    piece_momenta(phyxels, static_cast<int>(piece_count), now);
    std::vector<double> support(piece_count, 0), members(piece_count, 0);  // sum of h, number
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        support[static_cast<std::size_t>(phyxels.piece[i])] += phyxels.support_radius[i];
        members[static_cast<std::size_t>(phyxels.piece[i])] += 1;
    }
    for (std::size_t k = 0; k < piece_count; ++k) {
        if (changed[k] == 0 || !(now[k].mass > 0) || !(carried[k].mass > 0)) continue;
        const Reference about = reference_of(k);
        const Vec3 relative = carried[k].linear - carried[k].mass * about.velocity;
        const Vec3 spin = carried[k].angular - (now[k].centre - about.centre).cross(relative);
        now[k].linear = (carried[k].linear - now[k].linear) / now[k].mass;
        // A crumb whose few phyxels lie nearly in a line cannot hold the spin that its
        // nodes carried about that line: it would be flung to pieces.
        const double least_gyration = 0.15 * support[k] / std::max(members[k], 1.0);
        // And one of new phyxels alone is smaller than the old ones, far apart, that
        // held its angular momentum: taken over, it would make the crumb whirl.
        now[k].spin = old_mass[k] > 0 ? angular_velocity(now[k].inertia, spin - now[k].spin,
                                                         now[k].mass * least_gyration * least_gyration)
                                      : Vec3::Zero();
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        const auto k = static_cast<std::size_t>(phyxels.piece[i]);
        if (changed[k] == 0 || !(now[k].mass > 0) || !(carried[k].mass > 0)) continue;
        phyxels.velocity[i] += now[k].linear + now[k].spin.cross(phyxels.position[i] - now[k].centre);
        phyxels.history_broken[i] = 1;
    }
}

}  // namespace splitcubes::meshless
