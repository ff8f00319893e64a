// Test for closed, oriented 2-manifolds, faster than geometry::check_mesh: vertices are numbers below a known
// bound, so millions of small surfaces can be tested.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::splitting::cases {

/// Each triangle (v, a, b) links a to b around v. The surface is closed, oriented and manifold exactly if the
/// links around every vertex form one cycle: then each directed edge (v, a) occurs once, and so does (a, v).
class FanCheck {
  public:
    void reset(std::size_t vertex_count) {
        counts_.assign(vertex_count, 0);
        if (links_.size() < vertex_count) links_.resize(vertex_count);
        sound_ = true;
    }
    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a == b || b == c || c == a) sound_ = false;
        add_link(a, b, c);
        add_link(b, c, a);
        add_link(c, a, b);
    }
    void add_quad(const std::array<std::uint32_t, 4>& q) {
        add_triangle(q[0], q[1], q[2]);
        add_triangle(q[0], q[2], q[3]);
    }
    bool closed_oriented_manifold() const {
        if (!sound_) return false;
        for (std::size_t v = 0; v < counts_.size(); ++v)
            if (!one_cycle(links_[v], counts_[v])) return false;
        return true;
    }

  private:
    struct Link {
        std::uint32_t from, to;
    };
    // A centre vertex can have 24 quads of two triangles.
    using Links = std::array<Link, 48>;

    void add_link(std::uint32_t vertex, std::uint32_t from, std::uint32_t to) {
        std::uint8_t& count = counts_[vertex];
        if (count == std::tuple_size_v<Links>)
            sound_ = false;
        else
            links_[vertex][count++] = {from, to};
    }
    // Takes as many steps from link to link as there are links and must return to the first one only at the
    // end; a second link from the same vertex would never be visited.
    static bool one_cycle(const Links& links, std::size_t count) {
        if (count == 0) return true;
        std::uint32_t at = links[0].from;
        for (std::size_t step = 0; step < count; ++step) {
            if (step > 0 && at == links[0].from) return false;
            const auto end = links.begin() + static_cast<long>(count);
            const auto next = std::find_if(links.begin(), end, [&](const Link& l) { return l.from == at; });
            if (next == end) return false;
            at = next->to;
        }
        return at == links[0].from;
    }

    std::vector<std::uint8_t> counts_;
    std::vector<Links> links_;
    bool sound_ = true;
};

}  // namespace splitcubes::splitting::cases
