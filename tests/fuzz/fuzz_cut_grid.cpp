// Arbitrary bytes choose the inside nodes of a small grid and then its cuts, in batches; after each batch the
// surface must be closed, oriented, manifold and equal to one built from scratch.
#include <splitcubes/splitting/validate.h>

#include "../splitting/cut_case.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

using namespace splitcubes;
using namespace splitcubes::splitting;

namespace {

// Reads numbers from the front; zeros at the end of the data.
class Bytes {
  public:
    explicit Bytes(std::span<const std::uint8_t> data) : data_(data) {}
    bool empty() const { return data_.empty(); }
    std::uint8_t next() {
        if (data_.empty()) return 0;
        const std::uint8_t value = data_.front();
        data_ = data_.subspan(1);
        return value;
    }

  private:
    std::span<const std::uint8_t> data_;
};

void require_none(const std::vector<std::string>& findings) {
    if (findings.empty()) return;
    for (const std::string& finding : findings) std::fprintf(stderr, "%s\n", finding.c_str());
    std::abort();
}

cases::CutCase inside_nodes(Bytes& bytes) {
    cases::CutCase out;
    const int side = 2 + bytes.next() % 3;
    out.node_count = Vec3i::Constant(side + 2);
    std::uint8_t bits = 0;
    for (int n = 0; n < side * side * side; ++n) {
        if (n % 8 == 0) bits = bytes.next();
        if ((bits >> (n % 8) & 1U) != 0)
            out.inside.emplace_back(1 + n % side, 1 + n / side % side, 1 + n / (side * side));
    }
    return out;
}

cases::EdgeCut next_cut(Bytes& bytes, const Vec3i& node_count) {
    cases::EdgeCut out;
    for (int a = 0; a < 3; ++a) out.edge.node[a] = bytes.next() % node_count[a];
    const std::uint8_t axis_and_cut = bytes.next();
    out.edge.axis = axis_and_cut % 3;
    out.cut = axis_and_cut / 3 % 4 - 1;
    out.parameter = bytes.next() / 255.0;
    for (int a = 0; a < 3; ++a) out.normal[a] = static_cast<std::int8_t>(bytes.next()) / 127.0;
    return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(std::span(data, size));
    const cases::CutCase start = inside_nodes(bytes);
    NodeGrid grid = cases::uncut_grid(start);
    Surface surface(grid);
    Pieces pieces(grid);
    require_none(validate(grid, surface, pieces));
    while (!bytes.empty()) {
        const std::size_t batch = 1 + bytes.next() % 16;
        std::vector<std::int32_t> slots;
        for (std::size_t k = 0; k < batch && !bytes.empty(); ++k)
            if (const std::int32_t slot = cases::apply(grid, next_cut(bytes, start.node_count)); slot >= 0)
                slots.push_back(slot);
        surface.retessellate(grid, slots);
        pieces.update(grid, slots);
        require_none(validate(grid));
        require_none(validate(grid, surface, pieces));
    }
    return 0;
}
