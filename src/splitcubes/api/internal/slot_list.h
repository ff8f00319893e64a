// Things in the order in which they were added, named by ids.
#pragma once

#include <splitcubes/api/error.h>
#include <splitcubes/api/types.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::api {

/// Positions (0 ..) are those of the world's lists: they move up when something before is removed. No
/// generation is given twice, also not after the list has been replaced by an earlier one (see
/// continue_after).
template <class Tag, class T>
class SlotList {
  public:
    using Name = Id<Tag>;

    /// kind: of the things, for messages: "body".
    explicit SlotList(const char* kind) : kind_(kind) {}

    Name add(T item) {
        Name id{lowest_free_index(), ++last_generation_};
        items_.push_back({id, std::move(item)});
        return id;
    }
    /// The same under a name that it had.
    void put(Name id, T item) {
        items_.push_back({id, std::move(item)});
        last_generation_ = std::max(last_generation_, id.generation);
    }
    void remove(Name id) { items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(position(id))); }
    /// Throws Error (unknown_id).
    std::size_t position(Name id) const {
        for (std::size_t k = 0; k < items_.size(); ++k)
            if (items_[k].id == id) return k;
        throw Error(ErrorKind::unknown_id,
                    std::string(kind_) + " id: names nothing" +
                        (id ? " here; its thing was removed, or is of another simulation" : "; it is zero"));
    }
    T& operator[](Name id) { return items_[position(id)].item; }
    const T& operator[](Name id) const { return items_[position(id)].item; }
    T& at(std::size_t position) { return items_[position].item; }
    const T& at(std::size_t position) const { return items_[position].item; }
    Name id_at(std::size_t position) const { return items_[position].id; }
    /// By position.
    std::vector<Name> ids() const {
        std::vector<Name> out;
        for (const Item& item : items_) out.push_back(item.id);
        return out;
    }
    std::size_t size() const { return items_.size(); }
    /// Gives no generation that the other one has given.
    void continue_after(const SlotList& other) {
        last_generation_ = std::max(last_generation_, other.last_generation_);
    }

  private:
    struct Item {
        Name id;
        T item;
    };
    std::uint32_t lowest_free_index() const {
        std::vector<std::uint8_t> used(items_.size() + 1, 0);
        for (const Item& item : items_)
            if (item.id.index < used.size()) used[item.id.index] = 1;
        return static_cast<std::uint32_t>(std::find(used.begin(), used.end(), 0) - used.begin());
    }

    const char* kind_;
    std::vector<Item> items_;
    std::uint32_t last_generation_ = 0;
};

}  // namespace splitcubes::api
