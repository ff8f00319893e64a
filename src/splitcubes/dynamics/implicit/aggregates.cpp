#include <splitcubes/dynamics/implicit/aggregates.h>
#include <splitcubes/dynamics/tuning.h>
#include <splitcubes/samples/loops.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>

namespace splitcubes::meshless {

namespace {

/// Calls body(c) for each aggregate, in parallel.
template <class Body>
void for_aggregates(const Parallel& parallel, std::size_t count, const Body& body) {
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) body(c);
    };
    parallel.for_chunks(count, tuning::grains::aggregates, std::cref(chunk));
}

}  // namespace

// Sorts the phyxels of a set by recursive bisection. A set that fits the limit of a level is a box of that
// level.
void Aggregates::bisect(std::span<const Vec3> rest, std::size_t begin, std::size_t end) {
    struct Set {
        std::size_t begin, end, level;  // level: of the smallest box so far that contains the set
    };
    std::vector<std::size_t> limits(levels_.size(), max_box_size);
    for (std::size_t l = 1; l < limits.size(); ++l)
        limits[l] = tuning::preconditioner::level_growth * limits[l - 1];
    limits.back() = end - begin;
    std::vector<Set> sets = {{begin, end, levels_.size()}};
    std::vector<std::uint32_t> opened(levels_.size(), 0);
    for (std::size_t l = 0; l < levels_.size(); ++l)
        opened[l] = levels_[l].box.empty() ? none : levels_[l].box.back();
    while (!sets.empty()) {
        Set set = sets.back();
        sets.pop_back();
        for (; set.level > 0 && set.end - set.begin <= limits[set.level - 1]; --set.level)
            ++opened[set.level - 1];
        if (set.level == 0) {
            boxes_.first_member.push_back(static_cast<std::uint32_t>(set.end));
            for (std::size_t l = 0; l < levels_.size(); ++l) levels_[l].box.push_back(opened[l]);
            continue;
        }
        Vec3 low = rest[boxes_.member[set.begin]], high = low;
        for (std::size_t k = set.begin; k < set.end; ++k) {
            low = low.cwiseMin(rest[boxes_.member[k]]);
            high = high.cwiseMax(rest[boxes_.member[k]]);
        }
        int axis = 0;
        (high - low).maxCoeff(&axis);
        // Keeps a lattice plane at the exact middle on one side.
        const double middle = 0.5 * (low[axis] + high[axis]) + 1e-6 * (high[axis] - low[axis]);
        scratch_.other.clear();
        std::size_t split = set.begin;
        for (std::size_t k = set.begin; k < set.end; ++k) {
            if (rest[boxes_.member[k]][axis] < middle)
                boxes_.member[split++] = boxes_.member[k];
            else
                scratch_.other.push_back(boxes_.member[k]);
        }
        std::copy(scratch_.other.begin(), scratch_.other.end(),
                  boxes_.member.begin() + static_cast<std::ptrdiff_t>(split));
        if (split == set.begin || split == set.end) split = (set.begin + set.end) / 2;
        sets.push_back({split, set.end, set.level});
        sets.push_back({set.begin, split, set.level});
    }
}

void Aggregates::bisect_pieces(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods) {
    const std::size_t n = phyxels.size();
    boxes_.member.clear();
    for (std::uint32_t i = 0; i < n; ++i)
        if (source_.held[i] == 0) boxes_.member.push_back(i);
    std::stable_sort(boxes_.member.begin(), boxes_.member.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return source_.piece[a] < source_.piece[b]; });
    std::vector<std::size_t> ends;
    for (std::size_t k = 1; k <= boxes_.member.size(); ++k)
        if (k == boxes_.member.size() ||
            source_.piece[boxes_.member[k]] != source_.piece[boxes_.member[k - 1]])
            ends.push_back(k);
    std::size_t largest = 0, begin = 0;
    for (const std::size_t end : ends) {
        largest = std::max(largest, end - begin);
        begin = end;
    }
    std::size_t count = 1;
    for (std::size_t size = max_box_size; size < largest; size *= tuning::preconditioner::level_growth)
        ++count;
    levels_.resize(count);
    for (Level& level : levels_) level.box.clear();
    boxes_.first_member.assign(1, 0);
    begin = 0;
    for (const std::size_t end : ends) {
        bisect(phyxels.rest_position, begin, end);
        begin = end;
    }
    const std::size_t boxes = boxes_.first_member.size() - 1;
    location_.box.assign(n, none);
    location_.component.assign(n, 0);
    location_.index_in_box.assign(n, 0);
    for (std::uint32_t box = 0; box < boxes; ++box)
        for (std::uint32_t k = boxes_.first_member[box]; k < boxes_.first_member[box + 1]; ++k)
            location_.box[boxes_.member[k]] = box;
    boxes_.component_count.assign(boxes, 0);
    boxes_.couplings.resize(boxes);
    boxes_.dirty.assign(boxes, 1);
    boxes_.relink.assign(boxes, 1);
    scratch_.boxes.reserve(boxes);
    stride_ = neighbourhoods.slices().stride();
    source_.row_revision.assign(neighbourhoods.row_revision().begin(), neighbourhoods.row_revision().end());
}

// Marks the boxes whose links changed.
void Aggregates::find_dirty(const Neighbourhoods& neighbourhoods) {
    const std::span<const std::uint64_t> now = neighbourhoods.row_revision();
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (now[i] == source_.row_revision[i]) continue;
        source_.row_revision[i] = now[i];
        if (location_.box[i] != none) boxes_.dirty[location_.box[i]] = 1;
        for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
            const std::uint32_t box = location_.box[neighbourhoods.neighbour()[l]];
            if (box != none) boxes_.dirty[box] = 1;
        }
    }
}

// Finds the connected components within a box. Returns whether they changed.
bool Aggregates::update_components(const Neighbourhoods& neighbourhoods, std::uint32_t box) {
    const std::uint32_t begin = boxes_.first_member[box], size = boxes_.first_member[box + 1] - begin;
    const std::span<std::uint32_t> members(boxes_.member.data() + begin, size);
    std::sort(members.begin(), members.end());
    std::array<std::uint32_t, max_box_size> root{};
    const auto find = [&](std::uint32_t k) {
        while (root[k] != k) k = root[k];
        return k;
    };
    for (std::uint32_t k = 0; k < size; ++k) {
        const std::uint32_t i = members[k];
        location_.index_in_box[i] = root[k] = k;
        for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            if (j >= i) break;
            if (location_.box[j] != box || !(neighbourhoods.link_coupling(l, i) > 0)) continue;
            const std::uint32_t a = find(k), b = find(location_.index_in_box[j]);
            root[std::max(a, b)] = std::min(a, b);
        }
    }
    std::array<std::uint32_t, max_box_size> component{};
    std::uint32_t count = 0;
    bool changed = false;
    for (std::uint32_t k = 0; k < size; ++k) {
        component[k] = root[k] == k ? count++ : component[find(k)];
        changed = changed || location_.component[members[k]] != component[k];
        location_.component[members[k]] = component[k];
    }
    changed = changed || boxes_.component_count[box] != count;
    boxes_.component_count[box] = count;
    if (count > 1)
        std::sort(members.begin(), members.end(), [&](std::uint32_t a, std::uint32_t b) {
            return location_.component[a] != location_.component[b]
                       ? location_.component[a] < location_.component[b]
                       : a < b;
        });
    return changed;
}

// Sums the couplings of the components of a box.
void Aggregates::update_couplings(const Neighbourhoods& neighbourhoods, std::uint32_t box) {
    std::vector<Coupling>& couplings = boxes_.couplings[box];
    couplings.clear();
    std::size_t begin = 0, slot = 0;  // index of the component's first coupling, and of the last one used
    for (std::uint32_t k = boxes_.first_member[box]; k < boxes_.first_member[box + 1]; ++k) {
        const std::uint32_t i = boxes_.member[k];
        if (k == boxes_.first_member[box] ||
            location_.component[i] != location_.component[boxes_.member[k - 1]])
            begin = slot = couplings.size();
        for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            const double stiffness = neighbourhoods.link_coupling(l, i);
            if (!(stiffness > 0) ||
                (location_.box[j] == box && location_.component[j] == location_.component[i]))
                continue;
            const std::uint32_t to = location_.box[j] == none ? 0 : location_.component[j];
            const auto matches = [&](const Coupling& c) {
                return c.to_box == location_.box[j] && c.to == to;
            };
            // Consecutive neighbours often belong to the same component.
            if (slot >= couplings.size() || !matches(couplings[slot])) {
                slot = begin;
                while (slot < couplings.size() && !matches(couplings[slot])) ++slot;
                if (slot == couplings.size())
                    couplings.push_back({location_.component[i], location_.box[j], to, 0});
            }
            couplings[slot].stiffness += stiffness;
        }
    }
}

// Calls act(from, to, stiffness) for each coupling, with component indices; `to` may be none.
template <class Do>
void Aggregates::each_coupling(const Do& act) const {
    for (std::size_t box = 0; box < boxes_.couplings.size(); ++box)
        for (const Coupling& c : boxes_.couplings[box])
            act(boxes_.first_component[box] + c.from,
                c.to_box == none ? none : boxes_.first_component[c.to_box] + c.to, c.stiffness);
}

void Aggregates::number_components() {
    boxes_.first_component.assign(1, 0);
    for (const std::uint32_t count : boxes_.component_count)
        boxes_.first_component.push_back(boxes_.first_component.back() + count);
    const std::size_t components = boxes_.first_component.back();
    components_.first.assign(components + 1, static_cast<std::uint32_t>(boxes_.member.size()));
    for (std::size_t k = boxes_.member.size(); k-- > 0;)
        components_.first[boxes_.first_component[location_.box[boxes_.member[k]]] +
                          location_.component[boxes_.member[k]]] = static_cast<std::uint32_t>(k);
    components_.box.resize(components);
    for (std::uint32_t box = 0; box < boxes_.component_count.size(); ++box)
        for (std::uint32_t p = boxes_.first_component[box]; p < boxes_.first_component[box + 1]; ++p)
            components_.box[p] = box;
    for (auto* array : {&components_.inertia, &components_.added, &components_.finest})
        array->resize(components);
    components_.sum.resize(components);
}

// Builds the aggregates of level 0: components, with splinters joined to a neighbour.
void Aggregates::join_splinters() {
    const std::size_t components = components_.sum.size();
    const auto is_splinter = [&](std::uint32_t p) {
        return 3 * (components_.first[p + 1] - components_.first[p]) < max_box_size;
    };
    scratch_.root.resize(components);
    std::iota(scratch_.root.begin(), scratch_.root.end(), 0U);
    scratch_.strongest.assign(components, 0);
    each_coupling([&](std::uint32_t from, std::uint32_t to, double stiffness) {
        if (to == none || !(stiffness > scratch_.strongest[from]) || !is_splinter(from) || is_splinter(to))
            return;
        scratch_.strongest[from] = stiffness;
        scratch_.root[from] = to;
    });
    std::vector<std::uint32_t>& aggregate_of = levels_[0].aggregate_of;
    aggregate_of.resize(components);
    std::uint32_t count = 0;
    for (std::uint32_t p = 0; p < components; ++p)
        if (scratch_.root[p] == p) aggregate_of[p] = count++;
    for (std::uint32_t p = 0; p < components; ++p) {
        aggregate_of[p] = aggregate_of[scratch_.root[p]];
        components_.box[p] = components_.box[scratch_.root[p]];
    }
    levels_[0].stiffness.assign(count, 0);
    index_.assign(stride_, static_cast<std::int32_t>(count));
    for (std::uint32_t p = 0; p < components; ++p)
        for (std::uint32_t k = components_.first[p]; k < components_.first[p + 1]; ++k)
            index_[boxes_.member[k]] = static_cast<std::int32_t>(aggregate_of[p]);
    correction_.assign(3 * (std::size_t{count} + 1), 0);
}

// Builds the aggregates of a level from those of the level below: connected components within each box.
void Aggregates::build_level(std::size_t level) {
    Level& current = levels_[level];
    std::size_t size = current.size();
    if (level > 0) {
        Level& below = levels_[level - 1];
        const std::size_t children = below.size();
        scratch_.root.resize(children);
        std::iota(scratch_.root.begin(), scratch_.root.end(), 0U);
        const auto find = [&](std::uint32_t k) {
            while (scratch_.root[k] != k) k = scratch_.root[k] = scratch_.root[scratch_.root[k]];
            return k;
        };
        each_coupling([&](std::uint32_t from, std::uint32_t to, double) {
            if (to == none || current.box[components_.box[from]] != current.box[components_.box[to]]) return;
            const std::uint32_t a = find(below.aggregate_of[from]), b = find(below.aggregate_of[to]);
            scratch_.root[std::max(a, b)] = std::min(a, b);
        });
        below.parent.resize(children);
        size = 0;
        for (std::uint32_t k = 0; k < children; ++k)
            below.parent[k] =
                scratch_.root[k] == k ? static_cast<std::uint32_t>(size++) : below.parent[find(k)];
        current.aggregate_of.resize(below.aggregate_of.size());
        for (std::size_t p = 0; p < current.aggregate_of.size(); ++p)
            current.aggregate_of[p] = below.parent[below.aggregate_of[p]];
    }
    for (auto* array : {&current.stiffness, &current.inertia, &current.diagonal, &current.finer,
                        &current.remaining, &current.inverse})
        array->assign(size, 0);
    current.sum.resize(size);
    sum_link_stiffness(current);
}

// Sums the stiffness of the links that leave each aggregate.
void Aggregates::sum_link_stiffness(Level& level) const {
    each_coupling([&](std::uint32_t from, std::uint32_t to, double stiffness) {
        if (to == none || level.aggregate_of[from] != level.aggregate_of[to])
            level.stiffness[level.aggregate_of[from]] += stiffness;
    });
}

void Aggregates::update(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                        std::span<const std::uint8_t> held, const Parallel& parallel) {
    assert(held.size() == phyxels.size());
    if (source_.structure != neighbourhoods.structure() || source_.piece != phyxels.piece ||
        !std::equal(held.begin(), held.end(), source_.held.begin(), source_.held.end())) {
        source_.structure = neighbourhoods.structure();
        source_.piece = phyxels.piece;
        source_.held.assign(held.begin(), held.end());
        bisect_pieces(phyxels, neighbourhoods);
        source_.revision = 0;
    }
    if (source_.revision == neighbourhoods.revision()) return;
    source_.revision = neighbourhoods.revision();
    find_dirty(neighbourhoods);
    const auto list = [&](std::vector<std::uint8_t>& marks) {
        scratch_.boxes.clear();
        for (std::uint32_t box = 0; box < marks.size(); ++box)
            if (marks[box] != 0) scratch_.boxes.push_back(box);
    };
    list(boxes_.dirty);
    for_aggregates(parallel, scratch_.boxes.size(), [&](std::size_t k) {
        // 2: components changed, so the neighbouring boxes must update their couplings.
        boxes_.dirty[scratch_.boxes[k]] = update_components(neighbourhoods, scratch_.boxes[k]) ? 2 : 1;
    });
    for (const std::uint32_t box : scratch_.boxes) {
        boxes_.relink[box] = 1;
        if (boxes_.dirty[box] == 2)
            for (const Coupling& c : boxes_.couplings[box])
                if (c.to_box != none) boxes_.relink[c.to_box] = 1;
        boxes_.dirty[box] = 0;
    }
    list(boxes_.relink);
    for_aggregates(parallel, scratch_.boxes.size(),
                   [&](std::size_t k) { update_couplings(neighbourhoods, scratch_.boxes[k]); });
    std::fill(boxes_.relink.begin(), boxes_.relink.end(), std::uint8_t{0});
    number_components();
    join_splinters();
    for (std::size_t l = 0; l < levels_.size(); ++l) build_level(l);
}

void Aggregates::compute_weights(const Neighbourhoods& neighbourhoods, double factor,
                                 std::span<const double> inertia, std::span<const double> added,
                                 const Parallel& parallel) {
    for_aggregates(parallel, components_.sum.size(), [&](std::size_t p) {
        double inertia_sum = 0, contacts = 0, links = 0;
        for (std::uint32_t k = components_.first[p]; k < components_.first[p + 1]; ++k) {
            const std::uint32_t i = boxes_.member[k];
            inertia_sum += inertia[i];
            links += neighbourhoods.stiffness_diagonal()[i];
            if (!added.empty()) contacts += added[i];
        }
        components_.inertia[p] = inertia_sum;
        components_.added[p] = contacts;
        components_.finest[p] = inertia_sum + contacts + factor * links;
    });
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        Level& level = levels_[l];
        std::fill(level.inertia.begin(), level.inertia.end(), 0.0);
        for (std::size_t c = 0; c < level.size(); ++c) level.diagonal[c] = factor * level.stiffness[c];
        for (std::size_t p = 0; p < components_.sum.size(); ++p) {
            level.inertia[level.aggregate_of[p]] += components_.inertia[p];
            level.diagonal[level.aggregate_of[p]] += components_.inertia[p] + components_.added[p];
        }
        invert_diagonal(l);
    }
}

// Computes w_c and w_c / d_c from the diagonals and what the level below leaves.
void Aggregates::invert_diagonal(std::size_t level) {
    Level& current = levels_[level];
    for (auto* array : {&current.finer, &current.remaining}) std::fill(array->begin(), array->end(), 0.0);
    if (level == 0) {
        for (std::size_t p = 0; p < components_.finest.size(); ++p)
            current.finer[current.aggregate_of[p]] += components_.finest[p];
        std::fill(current.remaining.begin(), current.remaining.end(), 1.0);
    } else {
        const Level& below = levels_[level - 1];
        // Mean of what the level below leaves, weighted by its diagonals.
        for (std::size_t c = 0; c < below.size(); ++c) {
            current.finer[below.parent[c]] += below.diagonal[c];
            current.remaining[below.parent[c]] += below.diagonal[c] * below.remaining[c];
        }
        for (std::size_t c = 0; c < current.size(); ++c)
            current.remaining[c] = current.finer[c] > 0 ? current.remaining[c] / current.finer[c] : 0;
    }
    for (std::size_t c = 0; c < current.size(); ++c) {
        current.remaining[c] *=
            current.finer[c] > 0 ? std::max(0.0, 1 - current.inertia[c] / current.finer[c]) : 0;
        current.inverse[c] = current.diagonal[c] > 0 ? tuning::preconditioner::relaxation *
                                                           current.remaining[c] / current.diagonal[c]
                                                     : 0;
    }
}

double Aggregates::correct(const float* r, const Parallel& parallel) {
    if (count() == 0) return 0;
    for_aggregates(parallel, components_.sum.size(), [&](std::size_t p) {
        Vec3 sum = Vec3::Zero();
        for (std::uint32_t k = components_.first[p]; k < components_.first[p + 1]; ++k) {
            const float* const slot = r + boxes_.member[k];
            sum += Vec3(static_cast<double>(slot[0]), static_cast<double>(slot[stride_]),
                        static_cast<double>(slot[2 * stride_]));
        }
        components_.sum[p] = sum;
    });
    double product = 0;
    for (Level& level : levels_) std::fill(level.sum.begin(), level.sum.end(), Vec3::Zero());
    for (std::size_t p = 0; p < components_.sum.size(); ++p)
        levels_[0].sum[levels_[0].aggregate_of[p]] += components_.sum[p];
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        for (std::size_t c = 0; c < levels_[l - 1].size(); ++c)
            levels_[l].sum[levels_[l - 1].parent[c]] += levels_[l - 1].sum[c];
    }
    for (std::size_t l = levels_.size(); l-- > 0;) {
        Level& level = levels_[l];
        for (std::size_t c = 0; c < level.size(); ++c) {
            product += level.inverse[c] * level.sum[c].squaredNorm();
            level.sum[c] *= level.inverse[c];
            if (l + 1 < levels_.size()) level.sum[c] += levels_[l + 1].sum[level.parent[c]];
        }
    }
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < count(); ++c)
            correction_[k * (count() + 1) + c] = static_cast<float>(levels_[0].sum[c][static_cast<int>(k)]);
    return product;
}

}  // namespace splitcubes::meshless
