#include <splitcubes/splitting/placement.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace splitcubes::splitting {

namespace {

constexpr double grazing_cosine = 0.05;
// Trilinear weights are taken a little inside the cell, so that a vertex at or
// beyond a corner still has a weight for each node it depends on.
constexpr double weight_inset = 0.01;

Vec3 face_point(int axis, double level, const Vec2& in_face) {
    Vec3 p;
    p[axis] = level;
    p[(axis + 1) % 3] = in_face[0];
    p[(axis + 2) % 3] = in_face[1];
    return p;
}

Vec3 face_rest(const RestGrid& rest, const Vec3i& place, int axis, const Vec2& in_face) {
    return rest.origin + rest.cell_size * (place.cast<double>() + face_point(axis, 0, in_face));
}

unsigned face_corners(int face, int instance, const FaceConfiguration& configuration) {
    unsigned corners = 0;
    for (int k = 0; k < 4; ++k)
        if (configuration.instance[static_cast<std::size_t>(k)] == instance)
            corners |= 1U << face_corner(face, k);
    return corners;
}

Vec3 outward_normal(const Crossing& crossing, bool from_lower) {
    return from_lower ? crossing.normal : Vec3(-crossing.normal);
}

Vec3 unit_or(const Vec3& v, const Vec3& fallback) {
    const double length = v.norm();
    return length > 1e-9 ? Vec3(v / length) : fallback;
}

}  // namespace

// Slots of the cell's cut edges; -1 where uncut.
struct Surface::Gathered {
    std::array<std::int32_t, edge_count> slot;
};

Surface::Surface(const NodeGrid& grid) : slots_(grid.bricks()) {
    std::vector<std::int32_t> all(grid.crossings().size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::int32_t>(i);
    retessellate(grid, all);
}

const std::vector<std::uint32_t>& Surface::retessellate(const NodeGrid& grid,
                                                        std::span<const std::int32_t> new_slots) {
    touched_.clear();
    if (new_slots.empty()) return touched_;
    ++revision_;
    edge_vertices_.resize(grid.crossings().size(), {-1, -1});
    for (const std::int32_t slot : new_slots) {
        const GridEdge& edge = grid.crossing(slot).edge;
        const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
        for (int k = 0; k < 4; ++k) {
            Vec3i place = edge.node;
            place[u] -= 1 - (k & 1);
            place[v] -= 1 - (k >> 1);
            if (!grid.has_cell(place)) continue;
            const std::uint32_t cell = cell_at(place);
            if (cell_stamp_[cell] == revision_) continue;
            cell_stamp_[cell] = revision_;
            touched_.push_back(cell);
        }
    }
    for (const std::uint32_t cell : touched_) update_cell(grid, cells_[cell]);
    const std::size_t updated = touched_.size();
    for (std::size_t i = 0; i < updated; ++i) settle_faces(grid, touched_[i]);
    return touched_;
}

std::uint32_t Surface::cell_at(const Vec3i& place) {
    std::int32_t slot = slots_.get(place, cell_channel);
    if (slot < 0) {
        slot = static_cast<std::int32_t>(cells_.size());
        slots_.set(place, cell_channel, slot);
        SurfaceCell& cell = cells_.emplace_back();
        cell.place = place;
        cell.centre.fill(-1);
        cell_stamp_.push_back(0);
    }
    return static_cast<std::uint32_t>(slot);
}

std::uint32_t Surface::node_slot(const Vec3i& node) {
    std::int32_t slot = slots_.get(node, node_channel);
    if (slot < 0) {
        slot = static_cast<std::int32_t>(nodes_.size());
        slots_.set(node, node_channel, slot);
        nodes_.push_back(node);
    }
    return static_cast<std::uint32_t>(slot);
}

std::uint32_t Surface::new_vertex(VertexKind kind, const Vec3i& place, int axis, int instance) {
    std::uint32_t index;
    if (!free_vertices_.empty()) {
        index = free_vertices_.back();
        free_vertices_.pop_back();
    } else {
        index = static_cast<std::uint32_t>(vertices_.size());
        vertices_.emplace_back();
    }
    SurfaceVertex& v = vertices_[index];
    v.kind = kind;
    v.place = place;
    v.axis = static_cast<std::uint8_t>(axis);
    v.instance = static_cast<std::uint8_t>(instance);
    v.alive = true;
    ++alive_count_;
    return index;
}

void Surface::bind(SurfaceVertex& vertex, const Vec3& in_cell, const Vec3i& cell, unsigned corners) {
    const Vec3 p = in_cell.cwiseMax(weight_inset).cwiseMin(1 - weight_inset);
    double total = 0;
    std::array<double, 8> weights{};
    vertex.node_count = 0;
    for (int c = 0; c < corner_count; ++c) {
        if (!(corners >> c & 1U)) continue;
        double w = 1;
        for (int axis = 0; axis < 3; ++axis) w *= corner_bit(c, axis) ? p[axis] : 1 - p[axis];
        vertex.nodes[vertex.node_count] = node_slot(corner_node(cell, c));
        weights[vertex.node_count++] = w;
        total += w;
    }
    for (std::size_t k = 0; k < vertex.node_count; ++k)
        vertex.weights[k] = static_cast<float>(weights[k] / total);
}

std::uint32_t Surface::edge_vertex(const NodeGrid& grid, std::int32_t slot, int end) {
    std::int32_t& known = edge_vertices_[static_cast<std::size_t>(slot)][static_cast<std::size_t>(end)];
    if (known >= 0) return static_cast<std::uint32_t>(known);
    const Crossing& crossing = grid.crossing(slot);
    const std::uint32_t index = new_vertex(VertexKind::edge, crossing.edge.node, crossing.edge.axis, end);
    known = static_cast<std::int32_t>(index);
    SurfaceVertex& v = vertices_[index];
    v.rest = grid.crossing_position(crossing);
    v.normal = outward_normal(crossing, end == 0);
    v.node_count = 1;
    v.nodes[0] = node_slot(end == 0 ? crossing.edge.node : crossing.edge.upper());
    v.weights[0] = 1;
    return index;
}

std::int32_t Surface::face_at(const Vec3i& place, int axis) {
    std::int32_t slot = slots_.get(place, face_x + axis);
    if (slot < 0) {
        slot = static_cast<std::int32_t>(faces_.size());
        slots_.set(place, face_x + axis, slot);
        faces_.emplace_back();
    }
    return slot;
}

namespace {
Vec3i face_place(const Vec3i& cell, int face) {
    Vec3i place = cell;
    place[face_axis(face)] += face & 1;
    return place;
}
}  // namespace

// Brings a face up to the mask it has now: its position, and the vertices that
// stand for its instances (they keep their numbers; their nodes may get fewer).
void Surface::update_face(const NodeGrid& grid, const SurfaceCell& cell, int face) {
    const unsigned mask = face_mask(cell.mask, face);
    if (mask == 0) return;
    const Vec3i place = face_place(cell.place, face);
    const int axis = face_axis(face);
    Face& record = faces_[static_cast<std::size_t>(face_at(place, axis))];
    if (record.mask == mask) return;
    record.mask = static_cast<std::uint8_t>(mask);
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<FaceCrossing, 4> crossings;
    std::array<const Crossing*, 4> raw{};
    for (int k = 0; k < 4; ++k) {
        if (!(mask >> k & 1U)) continue;
        const auto i = static_cast<std::size_t>(k);
        raw[i] =
            &grid.crossing(grid.slot(cell_edge(cell.place, face_edges[static_cast<std::size_t>(face)][i])));
        crossings[i] = face_crossing(k, raw[i]->hit, raw[i]->normal[u], raw[i]->normal[v], raw[i]->cut);
    }
    const FacePlacement placement = place_face_vertex(mask, crossings);
    record.position = placement.point;
    record.smooth = placement.smooth;

    const FaceConfiguration& configuration = Table::get().face(mask);
    for (int instance = 0; instance < 4; ++instance) {
        if (configuration.instance[static_cast<std::size_t>(instance)] != instance) continue;
        if (!(cell.inside >> face_corner(face, instance) & 1U)) continue;
        std::int32_t& vertex = record.vertex[static_cast<std::size_t>(instance)];
        if (vertex < 0)
            vertex = static_cast<std::int32_t>(new_vertex(VertexKind::face, place, axis, instance));
        SurfaceVertex& out = vertices_[static_cast<std::size_t>(vertex)];
        const Vec3 in_cell = face_point(axis, face & 1, record.position);
        out.rest = face_rest(grid.rest(), place, axis, record.position);
        bind(out, in_cell, cell.place, face_corners(face, instance, configuration));
        Vec3 normal = Vec3::Zero();
        for (int k = 0; k < 4; ++k) {
            if (!(mask >> k & 1U)) continue;
            // Ring edge k runs from ring corner k to k+1; edges 2 and 3 against their axis.
            const bool home_first = configuration.instance[static_cast<std::size_t>(k)] == instance;
            const bool home_second =
                configuration.instance[static_cast<std::size_t>((k + 1) % 4)] == instance;
            const Vec3& n = raw[static_cast<std::size_t>(k)]->normal;
            if (home_first) normal += k < 2 ? n : Vec3(-n);
            if (home_second) normal += k < 2 ? Vec3(-n) : n;
        }
        out.normal = unit_or(normal, Vec3::Unit(axis));
    }
}

// The centre vertex of the sheets that cross a face of the cell; false where they
// are of several groups, which have nothing to do with each other in this cell.
bool Surface::centre_of_face(const SurfaceCell& cell, int face, Vec3& centre) const {
    const CellConfiguration& configuration = Table::get().cell(cell.mask);
    int group = -1;
    for (const std::int8_t edge : face_edges[static_cast<std::size_t>(face)]) {
        if (!(cell.mask >> edge & 1U)) continue;
        const int own = configuration.edge_group[static_cast<std::size_t>(edge)];
        if (group >= 0 && own != group) return false;
        group = own;
    }
    for (std::size_t fan = 0; fan < cell.fan_count; ++fan)
        if (configuration.fan_group[fan] == group && cell.centre[fan] >= 0) {
            centre = vertices_[static_cast<std::size_t>(cell.centre[fan])].rest;
            return true;
        }
    return false;
}

// Second pass, when all centres are known: the faces of the cell on which sheets
// meet. A face that moves changes the cell on its other side too.
void Surface::settle_faces(const NodeGrid& grid, std::uint32_t cell) {
    for (int face = 0; face < face_count; ++face) {
        const int axis = face_axis(face);
        const Vec3i place = face_place(cells_[cell].place, face);
        const std::int32_t slot = slots_.get(place, face_x + axis);
        if (slot < 0) continue;
        Face& record = faces_[static_cast<std::size_t>(slot)];
        if (record.smooth || record.mask == 0) continue;
        Vec3i below = place;
        --below[axis];
        const std::int32_t low = slots_.get(below, cell_channel), high = slots_.get(place, cell_channel);
        if (low < 0 || high < 0) continue;
        Vec3 centre[2];
        const bool known = centre_of_face(cells_[static_cast<std::size_t>(low)], 2 * axis + 1, centre[0]) &&
                           centre_of_face(cells_[static_cast<std::size_t>(high)], 2 * axis, centre[1]);
        const Vec3 rest =
            known ? place_between_centres(axis, grid.rest().node_position(place)[axis], centre[0], centre[1])
                  : face_rest(grid.rest(), place, axis, record.position);
        bool moved = false;
        for (const std::int32_t index : record.vertex) {
            if (index < 0) continue;
            SurfaceVertex& vertex = vertices_[static_cast<std::size_t>(index)];
            moved = moved || vertex.rest != rest;
            vertex.rest = rest;
        }
        const auto other = static_cast<std::uint32_t>(face & 1 ? high : low);
        if (!moved || cell_stamp_[other] == revision_) continue;
        cell_stamp_[other] = revision_;
        touched_.push_back(other);
    }
}

void Surface::gather(const NodeGrid& grid, const SurfaceCell& cell, Gathered& out) {
    for (int e = 0; e < edge_count; ++e)
        out.slot[static_cast<std::size_t>(e)] = cell.mask >> e & 1 ? grid.slot(cell_edge(cell.place, e)) : -1;
}

void Surface::place_centres(const NodeGrid& grid, const SurfaceCell& cell, const Gathered& gathered,
                            std::array<Vec3, 8>& positions) const {
    const CellConfiguration& configuration = Table::get().cell(cell.mask);
    for (unsigned group = 0; group < configuration.group_count; ++group) {
        std::array<CellCrossing, edge_count> crossings;
        std::size_t count = 0;
        unsigned faces = 0;
        for (int e = 0; e < edge_count; ++e) {
            const auto i = static_cast<std::size_t>(e);
            if (configuration.edge_group[i] != group) continue;
            const Crossing& raw = grid.crossing(gathered.slot[i]);
            CellCrossing& c = crossings[count++];
            const int axis = edge_axis(e);
            for (int k = 0; k < 3; ++k) c.point[k] = corner_bit(edge_corner(e, 0), k);
            c.point[axis] += raw.hit;
            c.normal = configuration.edge_side[i] < 0 ? Vec3(-raw.normal) : raw.normal;
            c.grazing = std::abs(raw.normal[axis]) < grazing_cosine;
            c.cut = raw.cut;
            for (unsigned f = 0; f < face_count; ++f)
                for (const std::int8_t face_edge_index : face_edges[f])
                    if (face_edge_index == e) faces |= 1U << f;
        }
        Vec3 mean = Vec3::Zero();
        for (int f = 0; f < face_count; ++f) {
            if (!(faces >> f & 1U)) continue;
            const Vec3i place = face_place(cell.place, f);
            const Face& face = faces_[static_cast<std::size_t>(slots_.get(place, face_x + face_axis(f)))];
            mean += face_point(face_axis(f), f & 1, face.position);
        }
        mean /= std::popcount(faces);
        positions[group] = place_centre({crossings.data(), count}, configuration.group_oriented[group], mean);
    }
}

void Surface::set_centre(const NodeGrid& grid, SurfaceCell& cell, const CellConfiguration& configuration,
                         int fan, const Vec3& position, std::int32_t vertex) {
    const auto f = static_cast<std::size_t>(fan);
    cell.centre[f] = vertex;
    SurfaceVertex& v = vertices_[static_cast<std::size_t>(vertex)];
    v.rest = grid.rest().origin + grid.rest().cell_size * (cell.place.cast<double>() + position);
    unsigned corners = 0;
    const std::uint8_t component = configuration.component[configuration.fan_corner[f]];
    for (unsigned c = 0; c < corner_count; ++c)
        if (configuration.component[c] == component) corners |= 1U << c;
    bind(v, position, cell.place, corners);
    v.normal = Vec3::Zero();  // summed over the quads by update_cell
}

void Surface::reserve_quads(SurfaceCell& cell, std::size_t count) {
    if (count <= cell.quad_capacity) return;
    if (cell.quad_capacity > 0) free_quads_[cell.quad_capacity].push_back(cell.first_quad);
    const std::size_t capacity = (count + 3) / 4 * 4;
    if (!free_quads_[capacity].empty()) {
        cell.first_quad = free_quads_[capacity].back();
        free_quads_[capacity].pop_back();
    } else {
        cell.first_quad = static_cast<std::uint32_t>(quads_.size());
        quads_.resize(quads_.size() + capacity);
    }
    cell.quad_capacity = static_cast<std::uint8_t>(capacity);
}

void Surface::update_cell(const NodeGrid& grid, SurfaceCell& cell) {
    const CellMask mask = grid.cell_mask(cell.place);
    cell.mask = mask;
    cell.inside = static_cast<std::uint8_t>(grid.cell_inside(cell.place));
    const CellConfiguration& configuration = Table::get().cell(mask);
    const std::span<const TableQuad> table = Table::get().quads(mask);
    for (int f = 0; f < face_count; ++f) update_face(grid, cell, f);
    Gathered gathered;
    gather(grid, cell, gathered);
    std::array<Vec3, 8> positions;
    place_centres(grid, cell, gathered, positions);

    // A fan keeps its centre vertex where the quad that names it is still its
    // first; others are released and made again.
    std::array<std::uint8_t, 8> names{};
    for (std::size_t i = table.size(); i-- > 0;)
        names[table[i].fan] = static_cast<std::uint8_t>(16 * table[i].corner + table[i].edge);
    std::array<std::int32_t, 8> old = cell.centre;
    const std::array<std::uint8_t, 8> old_names = cell.fan_name;
    const int old_count = cell.fan_count;
    cell.centre.fill(-1);
    cell.fan_count = configuration.fan_count;
    cell.fan_name = names;
    std::array<std::int32_t, 8> kept;
    kept.fill(-1);
    for (std::size_t fan = 0; fan < configuration.fan_count; ++fan)
        for (std::size_t k = 0; k < static_cast<std::size_t>(old_count); ++k)
            if (old[k] >= 0 && old_names[k] == names[fan]) std::swap(kept[fan], old[k]);
    for (std::size_t k = 0; k < static_cast<std::size_t>(old_count); ++k) {
        if (old[k] < 0) continue;
        vertices_[static_cast<std::size_t>(old[k])].alive = false;
        free_vertices_.push_back(static_cast<std::uint32_t>(old[k]));
        --alive_count_;
    }
    for (std::size_t fan = 0; fan < configuration.fan_count; ++fan) {
        if (!(cell.inside >> configuration.fan_corner[fan] & 1U)) continue;
        if (kept[fan] < 0)
            kept[fan] = static_cast<std::int32_t>(new_vertex(VertexKind::centre, cell.place, 0, names[fan]));
        set_centre(grid, cell, configuration, static_cast<int>(fan), positions[configuration.fan_group[fan]],
                   kept[fan]);
    }

    std::size_t count = 0;
    for (const TableQuad& q : table) count += cell.inside >> q.corner & 1U;
    quad_count_ += count - cell.quad_count;
    reserve_quads(cell, count);
    cell.quad_count = static_cast<std::uint8_t>(count);
    std::uint32_t next = cell.first_quad;
    for (const TableQuad& q : table) {
        if (!(cell.inside >> q.corner & 1U)) continue;
        const std::int32_t slot = gathered.slot[q.edge];
        const int end = edge_corner(q.edge, 0) == q.corner ? 0 : 1;
        SurfaceQuad& quad = quads_[next++];
        quad.crossing = slot;
        quad.vertices = {edge_vertex(grid, slot, end),
                         face_vertex(grid, cell, q.first_face, q.first_instance),
                         static_cast<std::uint32_t>(cell.centre[q.fan]),
                         face_vertex(grid, cell, q.second_face, q.second_instance)};
        vertices_[quad.vertices[2]].normal += outward_normal(grid.crossing(slot), end == 0);
    }
    for (const std::int32_t centre : cell.centre)
        if (centre >= 0) {
            Vec3& normal = vertices_[static_cast<std::size_t>(centre)].normal;
            normal = unit_or(normal, Vec3::UnitZ());
        }
}

std::uint32_t Surface::face_vertex(const NodeGrid&, const SurfaceCell& cell, int face, int instance) {
    const std::int32_t slot = slots_.get(face_place(cell.place, face), face_x + face_axis(face));
    return static_cast<std::uint32_t>(
        faces_[static_cast<std::size_t>(slot)].vertex[static_cast<std::size_t>(instance)]);
}

std::size_t Surface::bytes() const {
    return slots_.bytes() + cells_.capacity() * sizeof(SurfaceCell) + faces_.capacity() * sizeof(Face) +
           edge_vertices_.capacity() * sizeof(edge_vertices_[0]) +
           vertices_.capacity() * sizeof(SurfaceVertex) + quads_.capacity() * sizeof(SurfaceQuad) +
           nodes_.capacity() * sizeof(Vec3i) + cell_stamp_.capacity() * sizeof(std::uint64_t);
}

void deform(const Surface& surface, const RestGrid& rest, std::span<const geometry::Frame> frames,
            std::vector<Vec3>& positions, std::vector<Vec3>& normals, const Parallel& parallel) {
    const std::vector<SurfaceVertex>& vertices = surface.vertices();
    const std::vector<Vec3i>& nodes = surface.nodes();
    assert(frames.size() == nodes.size());
    positions.resize(vertices.size());
    normals.resize(vertices.size());
    parallel.for_each(vertices.size(), 512, [&](std::size_t i) {
        const SurfaceVertex& v = vertices[i];
        Vec3 x = Vec3::Zero();
        Mat3 jacobian = Mat3::Zero();
        double total = 0;
        if (!v.alive) {
            positions[i] = v.rest;
            normals[i] = v.normal;
            return;
        }
        for (std::size_t k = 0; k < v.node_count; ++k) {
            const geometry::Frame& frame = frames[v.nodes[k]];
            const double w = v.weights[k];
            x += w * (frame.position + frame.jacobian * (v.rest - rest.node_position(nodes[v.nodes[k]])));
            jacobian += w * frame.jacobian;
            total += w;
        }
        positions[i] = x / total;
        // Cofactor: columns are cross products of the other two columns.
        Mat3 cofactor;
        cofactor.col(0) = jacobian.col(1).cross(jacobian.col(2));
        cofactor.col(1) = jacobian.col(2).cross(jacobian.col(0));
        cofactor.col(2) = jacobian.col(0).cross(jacobian.col(1));
        normals[i] = unit_or(cofactor * v.normal, v.normal);
    });
}

}  // namespace splitcubes::splitting
