#include <splitcubes/meshless/aggregates.h>
#include <splitcubes/meshless/loops.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>

namespace splitcubes::meshless {

namespace {

// Ratio of the maximum box sizes of consecutive levels.
constexpr std::size_t growth = 8;
// Factor on the corrections of all levels. Levels overlap, so under-relaxation needs fewer iterations;
// between 0.5 and 1 the value matters little.
constexpr double relaxation = 0.7;
// Aggregates per chunk of a parallel loop.
constexpr std::size_t aggregate_grain = 8;

/// Calls body(c) for each aggregate, in parallel.
template <class Body>
void for_aggregates(const Parallel& parallel, std::size_t count, const Body& body) {
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) body(c);
    };
    parallel.for_chunks(count, aggregate_grain, std::cref(chunk));
}

}  // namespace

// Sorts the phyxels of a set by recursive bisection. A set that fits the limit of a level is a box of that
// level.
void Aggregates::bisect(std::span<const Vec3> rest, std::size_t begin, std::size_t end) {
    struct Set {
        std::size_t begin, end, level;  // level: of the smallest box so far that contains the set
    };
    std::vector<std::size_t> limits(levels_.size(), max_box_size);
    for (std::size_t l = 1; l < limits.size(); ++l) limits[l] = growth * limits[l - 1];
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
            first_member_.push_back(static_cast<std::uint32_t>(set.end));
            for (std::size_t l = 0; l < levels_.size(); ++l) levels_[l].box.push_back(opened[l]);
            continue;
        }
        Vec3 low = rest[member_[set.begin]], high = low;
        for (std::size_t k = set.begin; k < set.end; ++k) {
            low = low.cwiseMin(rest[member_[k]]);
            high = high.cwiseMax(rest[member_[k]]);
        }
        int axis = 0;
        (high - low).maxCoeff(&axis);
        // Keeps a lattice plane at the exact middle on one side.
        const double middle = 0.5 * (low[axis] + high[axis]) + 1e-6 * (high[axis] - low[axis]);
        other_.clear();
        std::size_t split = set.begin;
        for (std::size_t k = set.begin; k < set.end; ++k) {
            if (rest[member_[k]][axis] < middle)
                member_[split++] = member_[k];
            else
                other_.push_back(member_[k]);
        }
        std::copy(other_.begin(), other_.end(), member_.begin() + static_cast<std::ptrdiff_t>(split));
        if (split == set.begin || split == set.end) split = (set.begin + set.end) / 2;
        sets.push_back({split, set.end, set.level});
        sets.push_back({set.begin, split, set.level});
    }
}

void Aggregates::bisect_pieces(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods) {
    const std::size_t n = phyxels.size();
    member_.clear();
    for (std::uint32_t i = 0; i < n; ++i)
        if (held_[i] == 0) member_.push_back(i);
    std::stable_sort(member_.begin(), member_.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return piece_[a] < piece_[b]; });
    std::vector<std::size_t> ends;
    for (std::size_t k = 1; k <= member_.size(); ++k)
        if (k == member_.size() || piece_[member_[k]] != piece_[member_[k - 1]]) ends.push_back(k);
    std::size_t largest = 0, begin = 0;
    for (const std::size_t end : ends) {
        largest = std::max(largest, end - begin);
        begin = end;
    }
    std::size_t count = 1;
    for (std::size_t size = max_box_size; size < largest; size *= growth) ++count;
    levels_.resize(count);
    for (Level& level : levels_) level.box.clear();
    first_member_.assign(1, 0);
    begin = 0;
    for (const std::size_t end : ends) {
        bisect(phyxels.rest_position, begin, end);
        begin = end;
    }
    const std::size_t boxes = first_member_.size() - 1;
    box_.assign(n, none);
    component_.assign(n, 0);
    index_in_box_.assign(n, 0);
    for (std::uint32_t box = 0; box < boxes; ++box)
        for (std::uint32_t k = first_member_[box]; k < first_member_[box + 1]; ++k) box_[member_[k]] = box;
    component_count_.assign(boxes, 0);
    couplings_.resize(boxes);
    dirty_.assign(boxes, 1);
    relink_.assign(boxes, 1);
    list_.reserve(boxes);
    stride_ = neighbourhoods.slices().stride();
    row_revision_.assign(neighbourhoods.row_revision().begin(), neighbourhoods.row_revision().end());
}

// Marks the boxes whose links changed.
void Aggregates::find_dirty(const Neighbourhoods& neighbourhoods) {
    const std::span<const std::uint64_t> now = neighbourhoods.row_revision();
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (now[i] == row_revision_[i]) continue;
        row_revision_[i] = now[i];
        if (box_[i] != none) dirty_[box_[i]] = 1;
        for (std::uint32_t l = neighbourhoods.offsets()[i]; l < neighbourhoods.offsets()[i + 1]; ++l) {
            const std::uint32_t box = box_[neighbourhoods.neighbour()[l]];
            if (box != none) dirty_[box] = 1;
        }
    }
}

// Finds the connected components within a box. Returns whether they changed.
bool Aggregates::update_components(const Neighbourhoods& neighbourhoods, std::uint32_t box) {
    const std::uint32_t begin = first_member_[box], size = first_member_[box + 1] - begin;
    const std::span<std::uint32_t> members(member_.data() + begin, size);
    std::sort(members.begin(), members.end());
    std::array<std::uint32_t, max_box_size> root{};
    const auto find = [&](std::uint32_t k) {
        while (root[k] != k) k = root[k];
        return k;
    };
    for (std::uint32_t k = 0; k < size; ++k) {
        const std::uint32_t i = members[k];
        index_in_box_[i] = root[k] = k;
        for (std::uint32_t l = neighbourhoods.offsets()[i]; l < neighbourhoods.offsets()[i + 1]; ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            if (j >= i) break;
            if (box_[j] != box || !(neighbourhoods.link_coupling(l, i) > 0)) continue;
            const std::uint32_t a = find(k), b = find(index_in_box_[j]);
            root[std::max(a, b)] = std::min(a, b);
        }
    }
    std::array<std::uint32_t, max_box_size> component{};
    std::uint32_t count = 0;
    bool changed = false;
    for (std::uint32_t k = 0; k < size; ++k) {
        component[k] = root[k] == k ? count++ : component[find(k)];
        changed = changed || component_[members[k]] != component[k];
        component_[members[k]] = component[k];
    }
    changed = changed || component_count_[box] != count;
    component_count_[box] = count;
    if (count > 1)
        std::sort(members.begin(), members.end(), [&](std::uint32_t a, std::uint32_t b) {
            return component_[a] != component_[b] ? component_[a] < component_[b] : a < b;
        });
    return changed;
}

// Sums the couplings of the components of a box.
void Aggregates::update_couplings(const Neighbourhoods& neighbourhoods, std::uint32_t box) {
    std::vector<Coupling>& couplings = couplings_[box];
    couplings.clear();
    std::size_t begin = 0, slot = 0;  // index of the component's first coupling, and of the last one used
    for (std::uint32_t k = first_member_[box]; k < first_member_[box + 1]; ++k) {
        const std::uint32_t i = member_[k];
        if (k == first_member_[box] || component_[i] != component_[member_[k - 1]])
            begin = slot = couplings.size();
        for (std::uint32_t l = neighbourhoods.offsets()[i]; l < neighbourhoods.offsets()[i + 1]; ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            const double stiffness = neighbourhoods.link_coupling(l, i);
            if (!(stiffness > 0) || (box_[j] == box && component_[j] == component_[i])) continue;
            const std::uint32_t to = box_[j] == none ? 0 : component_[j];
            const auto matches = [&](const Coupling& c) { return c.to_box == box_[j] && c.to == to; };
            // Consecutive neighbours often belong to the same component.
            if (slot >= couplings.size() || !matches(couplings[slot])) {
                slot = begin;
                while (slot < couplings.size() && !matches(couplings[slot])) ++slot;
                if (slot == couplings.size()) couplings.push_back({component_[i], box_[j], to, 0});
            }
            couplings[slot].stiffness += stiffness;
        }
    }
}

// Calls act(from, to, stiffness) for each coupling, with component indices; `to` may be none.
template <class Do>
void Aggregates::each_coupling(const Do& act) const {
    for (std::size_t box = 0; box < couplings_.size(); ++box)
        for (const Coupling& c : couplings_[box])
            act(first_component_[box] + c.from, c.to_box == none ? none : first_component_[c.to_box] + c.to,
                c.stiffness);
}

void Aggregates::number_components() {
    first_component_.assign(1, 0);
    for (const std::uint32_t count : component_count_)
        first_component_.push_back(first_component_.back() + count);
    const std::size_t components = first_component_.back();
    first_.assign(components + 1, static_cast<std::uint32_t>(member_.size()));
    for (std::size_t k = member_.size(); k-- > 0;)
        first_[first_component_[box_[member_[k]]] + component_[member_[k]]] = static_cast<std::uint32_t>(k);
    box_of_component_.resize(components);
    for (std::uint32_t box = 0; box < component_count_.size(); ++box)
        for (std::uint32_t p = first_component_[box]; p < first_component_[box + 1]; ++p)
            box_of_component_[p] = box;
    for (auto* array : {&inertia_, &added_, &finest_}) array->resize(components);
    component_sum_.resize(components);
}

// Builds the aggregates of level 0: components, with splinters joined to a neighbour.
void Aggregates::join_splinters() {
    const std::size_t components = component_sum_.size();
    const auto is_splinter = [&](std::uint32_t p) { return 3 * (first_[p + 1] - first_[p]) < max_box_size; };
    root_.resize(components);
    std::iota(root_.begin(), root_.end(), 0U);
    strongest_.assign(components, 0);
    each_coupling([&](std::uint32_t from, std::uint32_t to, double stiffness) {
        if (to == none || !(stiffness > strongest_[from]) || !is_splinter(from) || is_splinter(to)) return;
        strongest_[from] = stiffness;
        root_[from] = to;
    });
    std::vector<std::uint32_t>& aggregate_of = levels_[0].aggregate_of;
    aggregate_of.resize(components);
    std::uint32_t count = 0;
    for (std::uint32_t p = 0; p < components; ++p)
        if (root_[p] == p) aggregate_of[p] = count++;
    for (std::uint32_t p = 0; p < components; ++p) {
        aggregate_of[p] = aggregate_of[root_[p]];
        box_of_component_[p] = box_of_component_[root_[p]];
    }
    levels_[0].stiffness.assign(count, 0);
    index_.assign(stride_, static_cast<std::int32_t>(count));
    for (std::uint32_t p = 0; p < components; ++p)
        for (std::uint32_t k = first_[p]; k < first_[p + 1]; ++k)
            index_[member_[k]] = static_cast<std::int32_t>(aggregate_of[p]);
    correction_.assign(3 * (std::size_t{count} + 1), 0);
}

// Builds the aggregates of a level from those of the level below: connected components within each box.
void Aggregates::build_level(std::size_t level) {
    Level& current = levels_[level];
    std::size_t size = current.size();
    if (level > 0) {
        Level& below = levels_[level - 1];
        const std::size_t children = below.size();
        root_.resize(children);
        std::iota(root_.begin(), root_.end(), 0U);
        const auto find = [&](std::uint32_t k) {
            while (root_[k] != k) k = root_[k] = root_[root_[k]];
            return k;
        };
        each_coupling([&](std::uint32_t from, std::uint32_t to, double) {
            if (to == none || current.box[box_of_component_[from]] != current.box[box_of_component_[to]])
                return;
            const std::uint32_t a = find(below.aggregate_of[from]), b = find(below.aggregate_of[to]);
            root_[std::max(a, b)] = std::min(a, b);
        });
        below.parent.resize(children);
        size = 0;
        for (std::uint32_t k = 0; k < children; ++k)
            below.parent[k] = root_[k] == k ? static_cast<std::uint32_t>(size++) : below.parent[find(k)];
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
    if (structure_ != neighbourhoods.structure() || piece_ != phyxels.piece ||
        !std::equal(held.begin(), held.end(), held_.begin(), held_.end())) {
        structure_ = neighbourhoods.structure();
        piece_ = phyxels.piece;
        held_.assign(held.begin(), held.end());
        bisect_pieces(phyxels, neighbourhoods);
        revision_ = 0;
    }
    if (revision_ == neighbourhoods.revision()) return;
    revision_ = neighbourhoods.revision();
    find_dirty(neighbourhoods);
    const auto list = [&](std::vector<std::uint8_t>& marks) {
        list_.clear();
        for (std::uint32_t box = 0; box < marks.size(); ++box)
            if (marks[box] != 0) list_.push_back(box);
    };
    list(dirty_);
    for_aggregates(parallel, list_.size(), [&](std::size_t k) {
        // 2: components changed, so the neighbouring boxes must update their couplings.
        dirty_[list_[k]] = update_components(neighbourhoods, list_[k]) ? 2 : 1;
    });
    for (const std::uint32_t box : list_) {
        relink_[box] = 1;
        if (dirty_[box] == 2)
            for (const Coupling& c : couplings_[box])
                if (c.to_box != none) relink_[c.to_box] = 1;
        dirty_[box] = 0;
    }
    list(relink_);
    for_aggregates(parallel, list_.size(),
                   [&](std::size_t k) { update_couplings(neighbourhoods, list_[k]); });
    std::fill(relink_.begin(), relink_.end(), std::uint8_t{0});
    number_components();
    join_splinters();
    for (std::size_t l = 0; l < levels_.size(); ++l) build_level(l);
}

void Aggregates::compute_weights(const Neighbourhoods& neighbourhoods, double factor,
                                 std::span<const double> inertia, std::span<const double> added,
                                 const Parallel& parallel) {
    for_aggregates(parallel, component_sum_.size(), [&](std::size_t p) {
        double inertia_sum = 0, contacts = 0, links = 0;
        for (std::uint32_t k = first_[p]; k < first_[p + 1]; ++k) {
            const std::uint32_t i = member_[k];
            inertia_sum += inertia[i];
            links += neighbourhoods.stiffness_diagonal()[i];
            if (!added.empty()) contacts += added[i];
        }
        inertia_[p] = inertia_sum;
        added_[p] = contacts;
        finest_[p] = inertia_sum + contacts + factor * links;
    });
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        Level& level = levels_[l];
        std::fill(level.inertia.begin(), level.inertia.end(), 0.0);
        for (std::size_t c = 0; c < level.size(); ++c) level.diagonal[c] = factor * level.stiffness[c];
        for (std::size_t p = 0; p < component_sum_.size(); ++p) {
            level.inertia[level.aggregate_of[p]] += inertia_[p];
            level.diagonal[level.aggregate_of[p]] += inertia_[p] + added_[p];
        }
        invert_diagonal(l);
    }
}

// Computes w_c and w_c / d_c from the diagonals and what the level below leaves.
void Aggregates::invert_diagonal(std::size_t level) {
    Level& current = levels_[level];
    for (auto* array : {&current.finer, &current.remaining}) std::fill(array->begin(), array->end(), 0.0);
    if (level == 0) {
        for (std::size_t p = 0; p < finest_.size(); ++p) current.finer[current.aggregate_of[p]] += finest_[p];
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
        current.inverse[c] =
            current.diagonal[c] > 0 ? relaxation * current.remaining[c] / current.diagonal[c] : 0;
    }
}

double Aggregates::correct(const float* r, const Parallel& parallel) {
    if (count() == 0) return 0;
    for_aggregates(parallel, component_sum_.size(), [&](std::size_t p) {
        Vec3 sum = Vec3::Zero();
        for (std::uint32_t k = first_[p]; k < first_[p + 1]; ++k) {
            const float* const slot = r + member_[k];
            sum += Vec3(static_cast<double>(slot[0]), static_cast<double>(slot[stride_]),
                        static_cast<double>(slot[2 * stride_]));
        }
        component_sum_[p] = sum;
    });
    double product = 0;
    for (Level& level : levels_) std::fill(level.sum.begin(), level.sum.end(), Vec3::Zero());
    for (std::size_t p = 0; p < component_sum_.size(); ++p)
        levels_[0].sum[levels_[0].aggregate_of[p]] += component_sum_[p];
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
