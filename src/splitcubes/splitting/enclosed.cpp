#include <splitcubes/geometry/node_winding.h>
#include <splitcubes/splitting/enclosed.h>

namespace splitcubes::splitting {

std::vector<Enclosure> enclosure_of_pieces(const NodeGrid& grid, const Pieces& pieces,
                                           const geometry::TriangleMesh& closed) {
    std::vector<std::size_t> inside(pieces.count(), 0);
    for (const geometry::WindingRun& run : geometry::node_windings(grid.rest(), closed))
        for (int x = run.first; x < run.last; ++x) {
            const Vec3i node(x, run.y, run.z);
            if (grid.inside(node)) ++inside[static_cast<std::size_t>(pieces.piece_of(grid, node))];
        }
    std::vector<Enclosure> out(pieces.count(), Enclosure::both);
    for (std::size_t k = 0; k < out.size(); ++k) {
        if (inside[k] == 0) out[k] = Enclosure::outside;
        if (inside[k] == pieces.node_counts()[k]) out[k] = Enclosure::inside;
    }
    return out;
}

}  // namespace splitcubes::splitting
