// Which phyxels the middles of grid edges see, kept for as long as no surface changes.
#pragma once

#include <cstdint>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <vector>

namespace splitcubes::body {

/// May be asked and told from several threads at once: what is kept of an edge is the same
/// whoever found it.
class EdgeSights {
  public:
    struct Seen {
        std::uint32_t phyxel;
        double weight;  // kernel, 1/m^3
    };
    using List = std::vector<Seen>;  // ascending

    /// Forgets all where the surface, or how many phyxels there are, is not what it was.
    void begin(std::uint64_t surface_revision, std::size_t phyxels) {
        if (revision_ != surface_revision || phyxels_ != phyxels) lists_.clear();
        revision_ = surface_revision;
        phyxels_ = phyxels;
    }
    /// nullptr where the edge is not known. Stays valid until begin.
    const List* find(std::uint64_t edge) const {
        const std::shared_lock lock(mutex_);
        const auto found = lists_.find(edge);
        return found == lists_.end() ? nullptr : &found->second;
    }
    const List& keep(std::uint64_t edge, List&& list) {
        const std::unique_lock lock(mutex_);
        return lists_.try_emplace(edge, std::move(list)).first->second;
    }

  private:
    mutable std::shared_mutex mutex_;
    std::unordered_map<std::uint64_t, List> lists_;
    std::uint64_t revision_ = 0;
    std::size_t phyxels_ = 0;
};

}  // namespace splitcubes::body
