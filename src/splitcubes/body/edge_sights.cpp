#include <splitcubes/body/edge_sights.h>
#include <splitcubes/meshless/kernel.h>

#include <algorithm>
#include <utility>

namespace splitcubes::body {

namespace {

// Edges that a step did not ask for are kept while there are at most so many of them for one that it did.
constexpr std::size_t most_unused = 3, always_kept = 4096;

// Fibonacci hashing: neighbouring edges have neighbouring numbers.
std::size_t hash_of(std::uint64_t edge) {
    const std::uint64_t mixed = edge * 0x9e3779b97f4a7c15ULL;
    return static_cast<std::size_t>(mixed ^ mixed >> 32);
}

geometry::Box box_of(const Vec3& a, const Vec3& b) {
    return {a.cwiseMin(b), a.cwiseMax(b)};
}

// Whether a phyxel of the piece was seen, or hidden, as `before` says, and may not be so any more.
bool is_to_recall(const EdgeSights::Link& link, std::uint32_t before, std::int32_t piece,
                  const SightContext& context) {
    return link.sight == EdgeSights::Link::unknown && link.before == before &&
           context.phyxels.piece[link.phyxel] == piece;
}

}  // namespace

std::size_t EdgeSights::slot_of(std::uint64_t edge) const {
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = hash_of(edge) & mask;
    while (table_[slot] != 0 && entries_[table_[slot] - 1].edge != edge) slot = (slot + 1) & mask;
    return slot;
}

void EdgeSights::rebuild_table(std::size_t slots) {
    table_.assign(slots, 0);
    for (std::size_t k = 0; k < used_; ++k)
        table_[slot_of(entries_[k].edge)] = static_cast<std::uint32_t>(k + 1);
}

void EdgeSights::forget_unused() {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < used_; ++k)
        if (entries_[k].is_wanted) std::swap(entries_[kept++], entries_[k]);
    used_ = kept;
    rebuild_table(table_.size());
}

void EdgeSights::begin(std::size_t phyxels) {
    if (phyxels < phyxels_) {
        used_ = 0;
        rebuild_table(table_.size());
    } else if (used_ > (1 + most_unused) * wanted_ + always_kept) {
        forget_unused();
    }
    phyxels_ = phyxels;
    wanted_ = 0;
    for (std::size_t k = 0; k < used_; ++k) entries_[k].is_wanted = false;
}

std::uint32_t EdgeSights::number_of(std::uint64_t edge, const Vec3& rest) {
    if (2 * (used_ + 1) > table_.size()) rebuild_table(std::max<std::size_t>(2 * table_.size(), 64));
    std::uint32_t& found = table_[slot_of(edge)];
    if (found == 0) {
        if (used_ == entries_.size()) entries_.emplace_back();
        Entry& entry = entries_[used_++];
        entry.edge = edge;
        entry.rest = rest;
        entry.is_found = entry.is_wanted = false;
        found = static_cast<std::uint32_t>(used_);
    }
    Entry& entry = entries_[found - 1];
    wanted_ += !entry.is_wanted;
    entry.is_wanted = true;
    return found - 1;
}

std::span<const EdgeSights::Link> EdgeSights::near(std::uint32_t number, const SightContext& context) {
    Entry& entry = entries_[number];
    const meshless::Phyxels& p = context.phyxels;
    const auto note = [&](std::uint32_t i) {
        const double weight =
            meshless::kernel((p.rest_position[i] - entry.rest).squaredNorm(), p.support_radius[i]);
        if (weight > 0)
            entry.links.push_back({weight, i & (most_phyxels - 1), Link::unknown, Link::unknown, 0});
        return true;
    };
    if (entry.is_found) {
        // Phyxels stay where they are at rest: only those that have been added since are new.
        const double limit = context.reach * context.reach;
        for (std::uint32_t i = entry.known_phyxels; i < p.size(); ++i)
            if ((p.rest_position[i] - entry.rest).squaredNorm() < limit) note(i);
    } else {
        entry.links.clear();
        context.locator.visit(entry.rest, context.reach, note);
        std::sort(entry.links.begin(), entry.links.end(),
                  [](const Link& a, const Link& b) { return a.phyxel < b.phyxel; });
        entry.when = context.changes.now();
        entry.is_found = true;
    }
    entry.known_phyxels = static_cast<std::uint32_t>(p.size());
    return entry.links;
}

void EdgeSights::doubt(std::uint32_t number, const SightContext& context) {
    doubt(entries_[number], context);
}

void EdgeSights::recall_hidden(std::uint32_t number, std::int32_t piece, const SightContext& context) {
    Entry& entry = entries_[number];
    for (Link& link : entry.links) {
        if (!is_to_recall(link, Link::hidden, piece, context)) continue;
        const Vec3& to = context.phyxels.rest_position[link.phyxel];
        // What does not hide it any more tells nothing.
        const bool is_hidden = context.occluders.blocks(link.witness, entry.rest, to);
        link.sight = link.before = is_hidden ? Link::hidden : Link::unknown;
    }
}

void EdgeSights::recall_seen(std::uint32_t number, std::int32_t piece, const SightContext& context) {
    Entry& entry = entries_[number];
    for (Link& link : entry.links) {
        if (!is_to_recall(link, Link::seen, piece, context)) continue;
        const Vec3& to = context.phyxels.rest_position[link.phyxel];
        const std::uint32_t by = context.occluders.blocker(entry.rest, to, link.witness);
        const bool is_hidden = by != geometry::OccluderGrid::no_triangle;
        link.sight = link.before = is_hidden ? Link::hidden : Link::seen;
        link.witness = is_hidden ? by : context.occluders.changes();
    }
}

void EdgeSights::look(std::uint32_t number, std::int32_t piece, const SightContext& context) {
    doubt(number, context);
    recall_hidden(number, piece, context);
    recall_seen(number, piece, context);
    Entry& entry = entries_[number];
    std::array<Link*, geometry::most_fan_segments> fan;
    std::size_t count = 0;
    for (Link& link : entry.links) {
        if (link.sight != Link::unknown || context.phyxels.piece[link.phyxel] != piece) continue;
        fan[count++] = &link;
        if (count == fan.size()) look_along(entry, fan, context);
        count %= fan.size();
    }
    look_along(entry, {fan.data(), count}, context);
}

// At most so many as a fan takes.
void EdgeSights::look_along(const Entry& entry, std::span<Link* const> links, const SightContext& context) {
    std::array<Vec3, geometry::most_fan_segments> to;
    for (std::size_t k = 0; k < links.size(); ++k) to[k] = context.phyxels.rest_position[links[k]->phyxel];
    std::array<std::uint32_t, geometry::most_fan_segments> by;
    const std::uint32_t blocked =
        geometry::blocked_segments(context.occluders, entry.rest, {to.data(), links.size()}, by.data());
    for (std::size_t k = 0; k < links.size(); ++k) {
        const bool is_hidden = (blocked >> k & 1) != 0;
        links[k]->sight = links[k]->before = is_hidden ? Link::hidden : Link::seen;
        links[k]->witness = is_hidden ? by[k] : context.occluders.changes();
    }
}

// What may have changed is not known any more.
void EdgeSights::doubt(Entry& entry, const SightContext& context) {
    if (entry.when == context.changes.now()) return;
    const meshless::Phyxels& p = context.phyxels;
    const geometry::Box around = geometry::Box{entry.rest, entry.rest}.grown(context.reach);
    const bool is_anew = entry.when < context.changes.all_anew();
    if (context.changes.since(around, entry.when))
        for (Link& link : entry.links) {
            // The occluders count anew, too.
            if (is_anew) link.before = Link::unknown;
            if (link.sight != Link::unknown &&
                context.changes.since(box_of(entry.rest, p.rest_position[link.phyxel]), entry.when))
                link.sight = Link::unknown;
        }
    entry.when = context.changes.now();
}

}  // namespace splitcubes::body
