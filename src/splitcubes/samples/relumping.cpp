// Lumps the mass of nodes again after pieces separated.
#include <splitcubes/samples/lumped_rows.h>
#include <splitcubes/samples/mass_lumping.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <cassert>

namespace splitcubes::meshless {

namespace {

// Mass and momenta of the nodes of a piece, relative to a moving reference.
struct NodeMomenta {
    double mass = 0;              // kg
    Vec3 moment = Vec3::Zero();   // kg m, about the origin
    Vec3 linear = Vec3::Zero();   // kg m/s
    Vec3 angular = Vec3::Zero();  // kg m^2/s, about the reference
};

struct Reference {
    Vec3 centre = Vec3::Zero();    // m
    Vec3 velocity = Vec3::Zero();  // m/s
};

class Relumping {
  public:
    Relumping(MassLumping& lumping, const MaterialNodes& nodes, double density, const PhyxelLocator& locator,
              Phyxels& phyxels, const Parallel& parallel)
        : lumping_(lumping),
          nodes_(nodes),
          density_(density),
          locator_(locator),
          phyxels_(phyxels),
          parallel_(parallel),
          known_(lumping.volume.size()) {}

    void run() {
        compare_pieces();
        find_rows();
        sum_node_momenta();
        sum_old_masses();
        lump_rows();
        apply(lumping_, nodes_, density_, phyxels_);
        correct_velocities();
    }

  private:
    static std::size_t at(std::int32_t piece) { return static_cast<std::size_t>(piece); }
    void compare_pieces();
    void find_rows();
    Reference reference_of(std::size_t piece) const {
        return old_piece_[piece] < 0 ? Reference{} : reference_[at(old_piece_[piece])];
    }
    void find_references();
    void add_momenta(std::uint32_t phyxel, double mass, std::size_t piece);
    void sum_node_momenta();
    void sum_old_masses();
    void lump_rows();
    void correct_velocities();

    MassLumping& lumping_;
    const MaterialNodes& nodes_;
    double density_;
    const PhyxelLocator& locator_;
    Phyxels& phyxels_;
    const Parallel& parallel_;
    std::size_t known_;  // phyxels of the old lumping

    // Per piece.
    std::vector<std::int32_t> old_piece_;        // the piece that its nodes belonged to, or -1
    std::vector<std::uint8_t> changed_, grown_;  // nodes or phyxels differ; it got phyxels
    std::vector<Reference> reference_;           // of old pieces
    std::vector<NodeMomenta> node_momenta_;
    std::vector<double> old_mass_;  // kg, of its phyxels before

    std::vector<std::uint32_t> rows_;  // nodes whose phyxels may differ, ascending
};

// Finds the pieces that differ from an old piece.
void Relumping::compare_pieces() {
    std::int32_t highest = -1;
    for (const auto* pieces : {&lumping_.piece, &lumping_.phyxel_piece, &phyxels_.piece})
        for (const std::int32_t piece : *pieces) highest = std::max(highest, piece);
    for (const std::int32_t piece : nodes_.piece) highest = std::max(highest, piece);
    const auto count = static_cast<std::size_t>(highest + 1);
    old_piece_.assign(count, -1);
    changed_.assign(count, 0);
    grown_.assign(count, 0);
    std::vector<std::uint8_t> lost(count, 0);  // per old piece, 1: some nodes or phyxels left it
    for (std::size_t b = 0; b < nodes_.piece.size(); ++b) {
        const std::int32_t now = nodes_.piece[b], before = lumping_.piece[b];
        if (now < 0) continue;
        old_piece_[at(now)] = before;
        if (now == before) continue;
        changed_[at(now)] = 1;
        if (before >= 0) lost[at(before)] = 1;
    }
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        const std::int32_t now = phyxels_.piece[i], before = i < known_ ? lumping_.phyxel_piece[i] : -1;
        if (now < 0 || now == before) continue;
        changed_[at(now)] = 1;
        if (before >= 0) lost[at(before)] = 1;
        if (i >= known_) grown_[at(now)] = 1;
    }
    for (std::size_t k = 0; k < count; ++k) changed_[k] = changed_[k] != 0 || lost[k] != 0;
}

// A row changes if its node or one of its phyxels changed piece without the other, or if the piece got
// phyxels.
void Relumping::find_rows() {
    constexpr std::size_t grain = tuning::grains::lumping;
    const std::size_t count = nodes_.piece.size();
    std::vector<std::vector<std::uint32_t>> chunks((count + grain - 1) / grain);
    parallel_.for_chunks(count, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
            const std::int32_t piece = nodes_.piece[b];
            if (piece < 0 || changed_[at(piece)] == 0) continue;
            const std::span<const std::uint32_t> row = lumping_.phyxels_of(b);
            const auto differs = [&](std::uint32_t i) { return phyxels_.piece[i] != piece; };
            if (grown_[at(piece)] != 0 || row.empty() || std::any_of(row.begin(), row.end(), differs))
                chunks[begin / grain].push_back(static_cast<std::uint32_t>(b));
        }
    });
    for (const std::vector<std::uint32_t>& chunk : chunks)
        rows_.insert(rows_.end(), chunk.begin(), chunk.end());
}

// Finds centre of mass and velocity of the old pieces.
void Relumping::find_references() {
    std::vector<NodeMomenta> sums(old_piece_.size());
    for (std::size_t i = 0; i < known_; ++i) {
        if (lumping_.phyxel_piece[i] < 0) continue;
        NodeMomenta& sum = sums[at(lumping_.phyxel_piece[i])];
        const double m = phyxels_.mass[i];
        sum.mass += m;
        sum.moment += m * phyxels_.position[i];
        sum.linear += m * phyxels_.velocity[i];
    }
    reference_.assign(sums.size(), {});
    for (std::size_t k = 0; k < sums.size(); ++k)
        if (sums[k].mass > 0) reference_[k] = {sums[k].moment / sums[k].mass, sums[k].linear / sums[k].mass};
}

void Relumping::add_momenta(std::uint32_t phyxel, double mass, std::size_t piece) {
    const Reference about = reference_of(piece);
    const Vec3& x = phyxels_.position[phyxel];
    const Vec3& v = phyxels_.velocity[phyxel];
    NodeMomenta& sum = node_momenta_[piece];
    sum.mass += mass;
    sum.linear += mass * v;
    sum.angular += mass * (x - about.centre).cross(v - about.velocity);
}

// Sums the momenta of the nodes of changed pieces. A phyxel holds the mass of nodes of its own piece, except
// in the rows of nodes from which it separated, and in transfers between phyxels that separated.
void Relumping::sum_node_momenta() {
    find_references();
    node_momenta_.assign(old_piece_.size(), {});
    for (std::uint32_t i = 0; i < known_; ++i)
        if (phyxels_.piece[i] >= 0 && changed_[at(phyxels_.piece[i])] != 0)
            add_momenta(i, phyxels_.mass[i], at(phyxels_.piece[i]));
    const auto move = [&](std::uint32_t phyxel, double mass, std::int32_t piece) {
        if (phyxels_.piece[phyxel] == piece) return;
        if (piece >= 0) add_momenta(phyxel, mass, at(piece));
        if (phyxels_.piece[phyxel] >= 0) add_momenta(phyxel, -mass, at(phyxels_.piece[phyxel]));
    };
    for (const std::uint32_t b : rows_) {
        const std::span<const std::uint32_t> row = lumping_.phyxels_of(b);
        for (std::size_t k = 0; k < row.size(); ++k)
            move(row[k], density_ * nodes_.volume[b] * lumping_.shares_of(b)[k], nodes_.piece[b]);
    }
    for (const MassLumping::Transfer& transfer : lumping_.transfers)
        move(transfer.to, density_ * lumping_.unit * static_cast<double>(transfer.volume),
             phyxels_.piece[transfer.from]);
}

void Relumping::sum_old_masses() {
    old_mass_.assign(old_piece_.size(), 0);
    for (std::size_t i = 0; i < phyxels_.size(); ++i)
        if (phyxels_.piece[i] >= 0) old_mass_[at(phyxels_.piece[i])] += phyxels_.mass[i];
}

void Relumping::lump_rows() {
    constexpr std::size_t grain = tuning::grains::lumping_moments;
    lumping_.volume.resize(phyxels_.size());
    const RowLumper lumper(nodes_, phyxels_, locator_);
    std::vector<std::vector<std::pair<std::uint32_t, LumpedRow>>> moved((rows_.size() + grain - 1) / grain);
    parallel_.for_chunks(rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
        LumpingMoments moments;
        LumpedRow row;
        std::vector<double> plain;
        VolumeSums sums(lumping_.unit, parallel_.thread_count() > 1, lumping_.volume);
        for (std::size_t k = begin; k < end; ++k) {
            const std::uint32_t b = rows_[k];
            const std::span<const std::uint32_t> old = lumping_.phyxels_of(b);
            plain_shares(nodes_.rest_position[b], phyxels_, old, plain);
            if (grown_[at(nodes_.piece[b])] != 0)
                lumper.find(b, row, moments);
            else
                lumper.filter(b, old, row, moments);
            sums.replace(nodes_.volume[b], {old, plain, lumping_.shares_of(b)},
                         {row.phyxel, row.plain, row.share});
            if (!store(row, false, b, lumping_)) moved[begin / grain].emplace_back(b, row);
        }
    });
    for (const auto& chunk : moved)
        for (const auto& [node, row] : chunk) store(row, true, node, lumping_);
    if (2 * lumping_.unused > lumping_.phyxel.size()) compact_rows(lumping_);
    std::copy(nodes_.piece.begin(), nodes_.piece.end(), lumping_.piece.begin());
    lumping_.phyxel_piece = phyxels_.piece;
    move_volumes(phyxels_, locator_, lumping_);
}

void Relumping::correct_velocities() {
    std::vector<Momenta> now;
    momenta_of_pieces(phyxels_, static_cast<int>(old_piece_.size()), now);
    std::vector<double> support(now.size(), 0), members(now.size(), 0);  // sum of h, number
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (phyxels_.piece[i] < 0) continue;
        support[at(phyxels_.piece[i])] += phyxels_.support_radius[i];
        members[at(phyxels_.piece[i])] += 1;
    }
    const auto is_corrected = [&](std::size_t k) {
        return changed_[k] != 0 && now[k].mass > 0 && node_momenta_[k].mass > 0;
    };
    for (std::size_t k = 0; k < now.size(); ++k) {
        if (!is_corrected(k)) continue;
        const Reference about = reference_of(k);
        const Vec3 relative = node_momenta_[k].linear - node_momenta_[k].mass * about.velocity;
        const Vec3 angular_momentum =
            node_momenta_[k].angular - (now[k].centre - about.centre).cross(relative);
        // The mass of the old piece may lie elsewhere than that of its nodes, so momenta are relative to it.
        now[k].linear = about.velocity + (relative - now[k].linear) / now[k].mass;
        // A fragment whose few phyxels lie nearly on a line cannot take over the angular momentum
        // of its nodes about that line: its angular velocity would be huge.
        const double min_gyration = 0.15 * support[k] / std::max(members[k], 1.0);
        // A fragment of new phyxels alone is smaller than the old phyxels' spacing, so their
        // angular momentum would make it spin too fast.
        now[k].angular_momentum =
            old_mass_[k] > 0 ? angular_velocity(now[k].inertia, angular_momentum - now[k].angular_momentum,
                                                now[k].mass * min_gyration * min_gyration)
                             : Vec3::Zero();
    }
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (phyxels_.piece[i] < 0 || !is_corrected(at(phyxels_.piece[i]))) continue;
        const Momenta& change = now[at(phyxels_.piece[i])];
        phyxels_.velocity[i] +=
            change.linear + change.angular_momentum.cross(phyxels_.position[i] - change.centre);
        phyxels_.restart_history[i] = 1;
    }
}

}  // namespace

void relump_after_split(MassLumping& lumping, const MaterialNodes& nodes, double density,
                        const PhyxelLocator& locator, Phyxels& phyxels, const Parallel& parallel) {
    assert(lumping.node_count() == nodes.piece.size());
    Relumping(lumping, nodes, density, locator, phyxels, parallel).run();
}

}  // namespace splitcubes::meshless
