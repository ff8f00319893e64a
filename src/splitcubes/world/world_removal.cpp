// Removal of bodies, tools and colliders; the indices of the others follow.
#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <optional>

namespace splitcubes::body {

namespace {

template <class T>
void erase_at(std::vector<T>& list, std::size_t number) {
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(number));
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
    const std::uint64_t number = field(key, shift);
    if (number == removed) return std::nullopt;
    return number < removed ? key : with_field(key, shift, number - 1);
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

void World::remove_body(std::size_t number) {
    erase_at(bodies_, number);
    for (Tool& tool : tools_) {
        if (number < tool.last_normal.size()) erase_at(tool.last_normal, number);
        for (std::size_t& body : tool.bodies) {
            if (body == removed_body || body < number) continue;
            body = body == number ? removed_body : body - 1;
        }
    }
    renumber_cached_contacts([&](std::uint64_t key) { return key_without(key, 48, number); });
}

void World::remove_collider(std::size_t number) {
    erase_at(colliders_, number);
    renumber_cached_contacts([&](std::uint64_t key) { return key_without(key, 32, number + 1); });
}

void World::remove_tool(std::size_t number) {
    erase_at(tools_, number);
}

void World::forget_tool_paths() {
    for (Tool& tool : tools_) tool.blade.forget_before(time() - settings_.time_step);
}

}  // namespace splitcubes::body
