// State of the hits: checkpoints, and indices that follow when something is removed.
#include <splitcubes/contact/detection/restitution.h>
#include <splitcubes/core/state_hash.h>
#include <splitcubes/core/state_stream.h>
#include <splitcubes/math/state_numbers.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

namespace {

constexpr std::size_t vectors = 8, scalars = 12;

std::array<std::uint32_t, 6> integers_of(const Hit& hit) {
    return {hit.pair.body,  hit.pair.piece, hit.pair.other_body,
            hit.pair.other, hit.stalled,    static_cast<std::uint32_t>(hit.phase)};
}

// Passes the vectors and then the scalars of a hit to act, in a fixed order.
template <class AnyHit, class Act>
void visit(AnyHit& hit, const Act& act) {
    for (auto& twist : hit.approach) {
        act(twist.velocity);
        act(twist.spin);
    }
    for (auto* vector : {&hit.normal, &hit.arm[0], &hit.arm[1], &hit.surface}) act(*vector);
    for (auto* scalar : {&hit.mass[0], &hit.mass[1], &hit.fall, &hit.friction, &hit.impulse, &hit.blur,
                         &hit.strain, &hit.depth, &hit.spring, &hit.last_speed, &hit.held, &hit.given})
        act(*scalar);
}

std::array<double, 3 * vectors + scalars> numbers_in(const Hit& hit) {
    std::array<double, 3 * vectors + scalars> out{};
    std::size_t at = 0;
    const auto add = [&]<class T>(const T& value) {
        if constexpr (std::is_same_v<T, double>)
            out[at++] = value;
        else
            for (int axis = 0; axis < 3; ++axis) out[at++] = value[axis];
    };
    visit(hit, add);
    return out;
}

}  // namespace

void Restitution::remove_body(std::size_t index) {
    std::erase_if(hits_, [&](const Hit& hit) {
        return hit.pair.body == index || (!hit.pair.has_collider() && hit.pair.other_body == index);
    });
    for (Hit& hit : hits_) {
        if (hit.pair.body > index) --hit.pair.body;
        if (!hit.pair.has_collider() && hit.pair.other_body > index) --hit.pair.other_body;
    }
}

void Restitution::remove_collider(std::size_t index) {
    std::erase_if(hits_, [&](const Hit& hit) { return hit.pair.has_collider() && hit.pair.other == index; });
    for (Hit& hit : hits_)
        if (hit.pair.has_collider() && hit.pair.other > index) --hit.pair.other;
}

void Restitution::save(StateWriter& writer) const {
    writer.add(std::uint64_t{hits_.size()});
    for (const Hit& hit : hits_) {
        for (const std::uint32_t value : integers_of(hit)) writer.add(value);
        writer.add(std::span<const double>(numbers_in(hit)));
    }
}

void Restitution::load(StateReader& reader) {
    hits_.assign(reader.count(sizeof(Hit)), {});
    for (Hit& hit : hits_) {
        for (std::uint32_t* value :
             {&hit.pair.body, &hit.pair.piece, &hit.pair.other_body, &hit.pair.other, &hit.stalled})
            *value = reader.number<std::uint32_t>();
        hit.phase = static_cast<HitPhase>(reader.number<std::uint32_t>(
            0, static_cast<std::uint32_t>(HitPhase::opening), "a hit in an unknown phase"));
        const auto read = [&]<class T>(T& value) {
            if constexpr (std::is_same_v<T, double>)
                value = reader.number<double>(-largest_state_number, largest_state_number, "an invalid hit");
            else
                read_numbers(reader, value, "an invalid hit");
        };
        visit(hit, read);
        require_state(hit.impulse > 0 && hit.mass[0] > 0 && hit.normal.norm() > 0, "an invalid hit");
    }
    const auto by_pair = [](const Hit& a, const Hit& b) { return !(a.pair < b.pair); };
    require_state(std::adjacent_find(hits_.begin(), hits_.end(), by_pair) == hits_.end(),
                  "hits out of order");
}

void Restitution::add_to_hash(StateHash& hash) const {
    for (const Hit& hit : hits_) {
        for (const std::uint32_t value : integers_of(hit)) hash.add(value);
        hash.add(std::span<const double>(numbers_in(hit)));
    }
}

}  // namespace splitcubes::body
