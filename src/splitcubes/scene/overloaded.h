// One visitor out of several lambdas, for std::visit. Internal to scene.
#pragma once

namespace splitcubes::scene {

template <class... Cases>
struct Overloaded : Cases... {
    using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

}  // namespace splitcubes::scene
