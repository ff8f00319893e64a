#include <splitcubes/geometry/distance_transform.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace splitcubes::geometry {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// The lower envelope of parabolas rooted at the points of a line.
class Line {
  public:
    explicit Line(std::size_t longest) : values_(longest), roots_(longest), starts_(longest) {}

    void transform(float* first, std::size_t stride, std::size_t count) {
        std::size_t parabolas = 0;
        for (std::size_t i = 0; i < count; ++i) {
            values_[i] = first[i * stride];
            if (values_[i] == infinity) continue;
            double from = -1;
            while (parabolas > 0) {
                from = intersection(roots_[parabolas - 1], i);
                if (from > starts_[parabolas - 1]) break;
                --parabolas;
            }
            roots_[parabolas] = i;
            starts_[parabolas] = parabolas == 0 ? -1 : from;
            ++parabolas;
        }
        if (parabolas == 0) return;
        std::size_t at = 0;
        for (std::size_t i = 0; i < count; ++i) {
            while (at + 1 < parabolas && starts_[at + 1] < static_cast<double>(i)) ++at;
            const double offset = static_cast<double>(i) - static_cast<double>(roots_[at]);
            first[i * stride] = static_cast<float>(offset * offset) + values_[roots_[at]];
        }
    }

  private:
    // Returns the coordinate at which the parabolas of two points intersect.
    double intersection(std::size_t a, std::size_t b) const {
        const auto x = static_cast<double>(a), y = static_cast<double>(b);
        return (values_[b] + y * y - values_[a] - x * x) / (2 * (y - x));
    }

    std::vector<float> values_;
    std::vector<std::size_t> roots_;  // roots of the parabolas
    std::vector<double> starts_;      // start of the interval in which each is the lowest
};

}  // namespace

std::vector<float> squared_distances(const Vec3i& count, std::span<const std::uint8_t> marked) {
    assert(static_cast<std::size_t>(count.cast<std::int64_t>().prod()) == marked.size());
    std::vector<float> out(marked.size());
    std::transform(marked.begin(), marked.end(), out.begin(),
                   [](std::uint8_t is) { return is ? 0.0F : infinity; });
    const std::size_t nx = static_cast<std::size_t>(count[0]), ny = static_cast<std::size_t>(count[1]),
                      nz = static_cast<std::size_t>(count[2]);
    Line line(std::max({nx, ny, nz}));
    for (std::size_t row = 0; row < ny * nz; ++row) line.transform(&out[row * nx], 1, nx);
    for (std::size_t z = 0; z < nz; ++z)
        for (std::size_t x = 0; x < nx; ++x) line.transform(&out[z * ny * nx + x], nx, ny);
    for (std::size_t k = 0; k < nx * ny; ++k) line.transform(&out[k], nx * ny, nz);
    return out;
}

}  // namespace splitcubes::geometry
