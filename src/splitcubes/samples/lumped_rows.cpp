#include <splitcubes/samples/kernel.h>
#include <splitcubes/samples/lumped_rows.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

namespace {

double weight(const Vec3& node, const Phyxels& phyxels, std::uint32_t i) {
    return kernel((phyxels.rest_position[i] - node).squaredNorm(), phyxels.support_radius[i]);
}

std::int64_t rounded(double number) {
    return static_cast<std::int64_t>(number < 0 ? number - 0.5 : number + 0.5);
}

// Distributes units by shares that sum to one. The first share takes what rounding leaves.
void distribute(std::int64_t units, std::span<const double> share, std::vector<std::int64_t>& out) {
    out.resize(share.size());
    std::int64_t left = units;
    for (std::size_t k = 1; k < share.size(); ++k) {
        out[k] = rounded(static_cast<double>(units) * share[k]);
        left -= out[k];
    }
    if (!out.empty()) out[0] = left;
}

}  // namespace

RowLumper::RowLumper(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator)
    : nodes_(nodes), phyxels_(phyxels), locator_(locator) {
    assert(locator.size() == phyxels.size());
    for (const double h : phyxels.support_radius) reach_ = std::max(reach_, h);
}

void RowLumper::find(std::size_t node, LumpedRow& row, LumpingMoments& moments) const {
    const Vec3& at = nodes_.rest_position[node];
    row.phyxel.clear();
    // Few of the visited phyxels have a weight; only these are sorted.
    locator_.visit(at, reach_, [&](std::uint32_t i) {
        if (phyxels_.piece[i] == nodes_.piece[node] && weight(at, phyxels_, i) > 0) row.phyxel.push_back(i);
        return true;
    });
    std::sort(row.phyxel.begin(), row.phyxel.end());
    const std::vector<std::uint32_t> candidates = row.phyxel;
    weigh(node, candidates, row, moments);
}

void RowLumper::filter(std::size_t node, std::span<const std::uint32_t> old, LumpedRow& row,
                       LumpingMoments& moments) const {
    weigh(node, old, row, moments);
}

void RowLumper::weigh(std::size_t node, std::span<const std::uint32_t> candidates, LumpedRow& row,
                      LumpingMoments& moments) const {
    const Vec3& at = nodes_.rest_position[node];
    row.phyxel.clear();
    row.plain.clear();
    double total = 0;
    for (const std::uint32_t i : candidates) {
        if (phyxels_.piece[i] != nodes_.piece[node]) continue;
        const double w = weight(at, phyxels_, i);
        if (!(w > 0)) continue;
        row.phyxel.push_back(i);
        row.plain.push_back(w);
        total += w;
    }
    if (row.phyxel.empty()) return take_nearest(node, row);
    for (double& share : row.plain) share /= total;
    row.share = row.plain;
    moments.keep(at, phyxels_, row.phyxel, row.share);
}

// A node outside all supports goes to the nearest phyxel of its piece.
void RowLumper::take_nearest(std::size_t node, LumpedRow& row) const {
    double min_distance_squared = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < phyxels_.size(); ++i) {
        if (phyxels_.piece[i] != nodes_.piece[node]) continue;
        const double distance_squared =
            (phyxels_.rest_position[i] - nodes_.rest_position[node]).squaredNorm();
        if (!(distance_squared < min_distance_squared)) continue;
        min_distance_squared = distance_squared;
        row.phyxel.assign(1, i);
    }
    row.plain.assign(row.phyxel.size(), 1);
    row.share = row.plain;
}

void plain_shares(const Vec3& node, const Phyxels& phyxels, std::span<const std::uint32_t> phyxel,
                  std::vector<double>& out) {
    out.clear();
    double total = 0;
    for (const std::uint32_t i : phyxel) {
        out.push_back(weight(node, phyxels, i));
        total += out.back();
    }
    // A node outside all supports has one phyxel.
    for (double& share : out) share = total > 0 ? share / total : 1 / static_cast<double>(out.size());
}

void VolumeSums::add(std::int64_t amount, std::int64_t& sum) const {
    if (amount == 0) return;
    if (concurrent_)
        std::atomic_ref<std::int64_t>(sum).fetch_add(amount, std::memory_order_relaxed);
    else
        sum += amount;
}

void VolumeSums::replace(double volume, const Row& old, const Row& row) {
    const std::int64_t units = rounded(volume / unit_);
    distribute(units, old.plain, old_.plain);
    distribute(units, old.share, old_.corrected);
    distribute(units, row.plain, new_.plain);
    distribute(units, row.share, new_.corrected);
    // Both rows are ascending, and most phyxels are in both.
    for (std::size_t o = 0, n = 0; o < old.phyxel.size() || n < row.phyxel.size();) {
        const bool in_old =
            n == row.phyxel.size() || (o < old.phyxel.size() && old.phyxel[o] <= row.phyxel[n]);
        const bool in_new =
            o == old.phyxel.size() || (n < row.phyxel.size() && row.phyxel[n] <= old.phyxel[o]);
        MassLumping::Volume& sum = sums_[in_old ? old.phyxel[o] : row.phyxel[n]];
        add((in_new ? new_.plain[n] : 0) - (in_old ? old_.plain[o] : 0), sum.plain);
        add((in_new ? new_.corrected[n] : 0) - (in_old ? old_.corrected[o] : 0), sum.corrected);
        o += in_old;
        n += in_new;
    }
}

bool store(const LumpedRow& row, bool may_move, std::size_t node, MassLumping& lumping) {
    MassLumping::Row& to = lumping.rows[node];
    const auto count = static_cast<std::uint32_t>(row.phyxel.size());
    if (count > to.capacity) {
        if (!may_move) return false;
        lumping.unused += to.capacity;
        to.begin = static_cast<std::uint32_t>(lumping.phyxel.size());
        to.capacity = count;
        lumping.phyxel.resize(lumping.phyxel.size() + count);
        lumping.share.resize(lumping.share.size() + count);
    }
    to.count = count;
    std::copy(row.phyxel.begin(), row.phyxel.end(), lumping.phyxel.begin() + to.begin);
    std::copy(row.share.begin(), row.share.end(), lumping.share.begin() + to.begin);
    return true;
}

void compact_rows(MassLumping& lumping) {
    std::vector<std::uint32_t> phyxel;
    std::vector<double> share;
    for (std::size_t b = 0; b < lumping.rows.size(); ++b) {
        const auto begin = static_cast<std::uint32_t>(phyxel.size());
        const std::span<const std::uint32_t> row = lumping.phyxels_of(b);
        const std::span<const double> shares = lumping.shares_of(b);
        phyxel.insert(phyxel.end(), row.begin(), row.end());
        share.insert(share.end(), shares.begin(), shares.end());
        lumping.rows[b] = {begin, static_cast<std::uint32_t>(row.size()),
                           static_cast<std::uint32_t>(row.size())};
    }
    lumping.phyxel = std::move(phyxel);
    lumping.share = std::move(share);
    lumping.unused = 0;
}

namespace {

// Moves volume to phyxels that lack it, in rounds. All of a round take at once, so that the result does not
// depend on the order of phyxels, apart from rounding to units.
class VolumeMover {
  public:
    VolumeMover(const Phyxels& phyxels, const PhyxelLocator& locator, MassLumping& lumping)
        : phyxels_(phyxels), locator_(locator), lumping_(lumping), excess_(phyxels.size()) {}
    void run();

  private:
    struct Taker {
        std::uint32_t phyxel = 0;
        double reach = 0;  // m
    };
    struct Request {
        std::uint32_t from = 0, to = 0;
        double amount = 0;  // units
    };
    bool request(const Taker& taker);
    bool grant();

    const Phyxels& phyxels_;
    const PhyxelLocator& locator_;
    MassLumping& lumping_;
    std::vector<std::int64_t> excess_;  // per phyxel, above its lower limit; negative: what it lacks
    std::vector<Taker> takers_;
    std::vector<Request> requests_;
    std::vector<double> requested_;  // per phyxel, units
};

// Adds the requests of a phyxel to those around, nearer ones first. Returns whether farther ones are left.
bool VolumeMover::request(const Taker& taker) {
    const std::uint32_t i = taker.phyxel;
    const std::size_t first = requests_.size();
    std::size_t found = 0;
    double total = 0;
    locator_.visit(phyxels_.rest_position[i], taker.reach, [&](std::uint32_t j) {
        ++found;
        if (phyxels_.piece[j] != phyxels_.piece[i] || excess_[j] <= 0) return true;
        const double distance_squared = (phyxels_.rest_position[j] - phyxels_.rest_position[i]).squaredNorm();
        const double nearness = std::max(1 - distance_squared / (taker.reach * taker.reach), 0.0);
        const double weight = nearness * nearness * nearness * static_cast<double>(excess_[j]);
        if (weight > 0) requests_.push_back({j, i, weight});
        return true;
    });
    std::sort(requests_.begin() + static_cast<std::ptrdiff_t>(first), requests_.end(),
              [](const Request& a, const Request& b) { return a.from < b.from; });
    for (std::size_t k = first; k < requests_.size(); ++k) total += requests_[k].amount;
    for (std::size_t k = first; k < requests_.size(); ++k) {
        requests_[k].amount *= -static_cast<double>(excess_[i]) / total;
        requested_[requests_[k].from] += requests_[k].amount;
    }
    return found < phyxels_.size();
}

// Fulfils the requests as far as the donors have enough. Returns whether anything moved.
bool VolumeMover::grant() {
    bool moved = false;
    std::vector<double>& part = requested_;  // of each request that the donor can fulfil
    for (std::size_t j = 0; j < part.size(); ++j)
        part[j] = part[j] > 0 ? std::min(static_cast<double>(excess_[j]) / part[j], 1.0) : 0;
    for (const Request& request : requests_) {
        const std::int64_t given =
            std::min({-excess_[request.to], excess_[request.from],
                      static_cast<std::int64_t>(std::ceil(part[request.from] * request.amount))});
        if (given <= 0) continue;
        excess_[request.from] -= given;
        excess_[request.to] += given;
        lumping_.transfers.push_back({request.from, request.to, given});
        moved = true;
    }
    return moved;
}

void VolumeMover::run() {
    lumping_.transfers.clear();
    for (std::uint32_t i = 0; i < phyxels_.size(); ++i) {
        const double plain = static_cast<double>(lumping_.volume[i].plain);
        excess_[i] = lumping_.volume[i].corrected - std::llrint(tuning::lumping::min_volume_share * plain);
        if (excess_[i] < 0 && phyxels_.piece[i] >= 0) takers_.push_back({i, phyxels_.support_radius[i]});
    }
    // A piece has more above its limits than its phyxels lack, so that all get enough.
    while (!takers_.empty()) {
        requests_.clear();
        requested_.assign(phyxels_.size(), 0);
        bool farther = false;
        for (Taker& taker : takers_) {
            farther = request(taker) || farther;
            taker.reach *= 2;
        }
        if (!grant() && !farther) return;
        std::erase_if(takers_, [&](const Taker& taker) { return excess_[taker.phyxel] >= 0; });
    }
}

}  // namespace

void move_volumes(const Phyxels& phyxels, const PhyxelLocator& locator, MassLumping& lumping) {
    VolumeMover(phyxels, locator, lumping).run();
}

}  // namespace splitcubes::meshless
