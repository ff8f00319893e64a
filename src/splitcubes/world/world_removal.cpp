// Removal of bodies, tools and colliders; the indices of the others follow.
#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/restitution.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <optional>

namespace splitcubes::body {

namespace {

template <class T>
void erase_at(std::vector<T>& list, std::size_t index) {
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(index));
}

// A contact's key: body, 16 bits; collider + 1 or 0, 16 bits; vertex.
std::uint64_t with_field(std::uint64_t key, int shift, std::uint64_t value) {
    return (key & ~(std::uint64_t{0xffff} << shift)) | value << shift;
}
std::uint64_t field(std::uint64_t key, int shift) {
    return key >> shift & 0xffff;
}

// The key after the thing of this number in a field is gone; none: the contact is gone with it.
std::optional<std::uint64_t> key_without(std::uint64_t key, int shift, std::uint64_t removed) {
    const std::uint64_t index = field(key, shift);
    if (index == removed) return std::nullopt;
    return index < removed ? key : with_field(key, shift, index - 1);
}

}  // namespace

// new_key keeps the order of keys. The data that the contact finder caches refers to the old
// indices; it finds the same contacts without.
template <class NewKey>
void World::renumber_cached_contacts(const NewKey& new_key) {
    std::vector<meshless::CachedContact> kept;
    for (meshless::CachedContact& cached : cached_contacts_)
        if (const std::optional<std::uint64_t> key = new_key(cached.key)) {
            cached.key = *key;
            kept.push_back(cached);
        }
    cached_contacts_ = std::move(kept);
    contact_finder_ = std::make_unique<ContactFinder>();
}

void World::remove_body(std::size_t index) {
    erase_at(bodies_, index);
    for (Tool& tool : tools_) {
        if (index < tool.last_normal.size()) erase_at(tool.last_normal, index);
        for (std::size_t& body : tool.bodies) {
            if (body == removed_body || body < index) continue;
            body = body == index ? removed_body : body - 1;
        }
    }
    renumber_cached_contacts([&](std::uint64_t key) { return key_without(key, 48, index); });
    restitution_->remove_body(index);
}

void World::remove_collider(std::size_t index) {
    erase_at(colliders_, index);
    renumber_cached_contacts([&](std::uint64_t key) { return key_without(key, 32, index + 1); });
    restitution_->remove_collider(index);
}

void World::remove_tool(std::size_t index) {
    erase_at(tools_, index);
}

void World::forget_tool_paths() {
    for (Tool& tool : tools_) tool.blade.forget_before(time() - settings_.time_step);
}

}  // namespace splitcubes::body
