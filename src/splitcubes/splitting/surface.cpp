#include <splitcubes/splitting/placement.h>
#include <splitcubes/splitting/surface.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace splitcubes::splitting {

namespace {

Vec3 face_point(int axis, double level, const Vec2& in_face) {
    Vec3 p;
    p[axis] = level;
    p[(axis + 1) % 3] = in_face[0];
    p[(axis + 2) % 3] = in_face[1];
    return p;
}

Vec3 face_rest(const RestGrid& rest, const Vec3i& node, int axis, const Vec2& in_face) {
    return rest.origin + rest.cell_size * (node.cast<double>() + face_point(axis, 0, in_face));
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

// Data of the cell that update_cell processes.
struct Surface::CellContext {
    std::uint32_t cell;
    CellEdges edges;
    const Table& table;
    const CellConfiguration& configuration;

    const Crossing& crossing(const NodeGrid& grid, int edge) const {
        return grid.crossing(edges.slots[static_cast<std::size_t>(edge)]);
    }
};

namespace {

// Returns the slots of all cut edges, brick by brick, so that neighbours in space are neighbours in memory.
std::vector<std::int32_t> slots_by_brick(const NodeGrid& grid) {
    std::vector<std::int32_t> slots;
    slots.reserve(grid.crossings().size());
    for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick)
        for (int axis = 0; axis < 3; ++axis)
            for (std::uint64_t word = grid.cut_word(brick, axis); word != 0; word &= word - 1) {
                const auto local = static_cast<unsigned>(std::countr_zero(word));
                slots.push_back(
                    grid.slot({grid.bricks().base(brick) + BrickLayout::local_node(local), axis}));
            }
    return slots;
}

}  // namespace

Surface::Surface(const NodeGrid& grid) : Surface(grid, nullptr) {}

Surface::Surface(const NodeGrid& grid, const Parallel& parallel) : Surface(grid, &parallel) {}

Surface::Surface(const NodeGrid& grid, const Parallel* watched) : slots_(grid.bricks()) {
    // Reserves memory for as much again in cuts, so that nothing is copied until then; pages that are never
    // written cost nothing.
    const std::size_t crossings = grid.crossings().size();
    cells_.reserve(3 * crossings);
    cell_stamp_.reserve(3 * crossings);
    faces_.reserve(8 * crossings);
    vertices_.reserve(12 * crossings);
    quads_.reserve(12 * crossings);
    nodes_.reserve(4 * crossings);
    edge_vertices_.reserve(2 * crossings);
    take_in(grid, slots_by_brick(grid), {}, watched);
}

const std::vector<std::uint32_t>& Surface::retessellate(const NodeGrid& grid,
                                                        std::span<const std::int32_t> new_slots,
                                                        std::span<const CutFront> moved_fronts) {
    take_in(grid, new_slots, moved_fronts, nullptr);
    return touched_;
}

void Surface::take_in(const NodeGrid& grid, std::span<const std::int32_t> new_slots,
                      std::span<const CutFront> moved_fronts, const Parallel* watched) {
    touched_.clear();
    if (new_slots.empty() && moved_fronts.empty()) return;
    std::size_t done = 0;
    const auto check = [&] {
        if (watched && ++done % tuning::surface::cells_between_checks == 0) watched->check();
    };
    ++revision_;
    edge_vertices_.resize(grid.crossings().size(), {-1, -1});
    for (const std::int32_t slot : new_slots) {
        touch_cells_around(grid, grid.crossing(slot).edge);
        check();
    }
    for (const CutFront& front : moved_fronts)
        touch_cells_beside(grid, face_beside(grid.crossing(front.slot).edge, front.side));
    for (const std::uint32_t cell : touched_) {
        update_cell(grid, cell);
        check();
    }
    const std::size_t updated = touched_.size();
    for (std::size_t i = 0; i < updated; ++i) {
        settle_faces(grid, touched_[i]);
        check();
    }
    settle_small_pieces(grid);
}

void Surface::touch_cells_around(const NodeGrid& grid, const GridEdge& edge) {
    const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
    for (int k = 0; k < 4; ++k) {
        Vec3i node = edge.node;
        node[u] -= 1 - (k & 1);
        node[v] -= 1 - (k >> 1);
        if (grid.has_cell(node)) touch(cell_at(node));
    }
}

void Surface::touch_cells_beside(const NodeGrid& grid, const GridFace& face) {
    Vec3i below = face.node;
    --below[face.axis];
    for (const Vec3i& node : {below, face.node})
        if (grid.has_cell(node)) touch(cell_at(node));
}

std::uint32_t Surface::cell_at(const Vec3i& node) {
    std::int32_t slot = slots_.get(node, cell_channel);
    if (slot < 0) {
        slot = static_cast<std::int32_t>(cells_.size());
        slots_.set(node, cell_channel, slot);
        SurfaceCell& cell = cells_.emplace_back();
        cell.lowest_node = node;
        cell.centre.fill(-1);
        cell.face.fill(-1);
        cell.node.fill(-1);
        cell_stamp_.push_back(0);
    }
    return static_cast<std::uint32_t>(slot);
}

std::int32_t Surface::face_at(const Vec3i& node, int axis) {
    std::int32_t slot = slots_.get(node, face_x + axis);
    if (slot < 0) {
        slot = static_cast<std::int32_t>(faces_.size());
        slots_.set(node, face_x + axis, slot);
        faces_.emplace_back();
    }
    return slot;
}

std::uint32_t Surface::new_vertex(VertexKind kind, const Vec3i& node, int axis, int instance) {
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
    v.lowest_node = node;
    v.axis = static_cast<std::uint8_t>(axis);
    v.instance = static_cast<std::uint8_t>(instance);
    ++alive_count_;
    return index;
}

// Makes corners of a cell move a vertex.
void Surface::set_nodes(SurfaceVertex& vertex, std::uint32_t cell, unsigned corners) {
    vertex.cell = cell;
    vertex.corners = static_cast<std::uint8_t>(corners);
    SurfaceCell& at = cells_[cell];
    for (; corners != 0; corners &= corners - 1) {
        const auto c = static_cast<std::size_t>(std::countr_zero(corners));
        if (at.node[c] >= 0) continue;
        const Vec3i node = corner_node(at.lowest_node, static_cast<int>(c));
        at.node[c] = slots_.get(node, node_channel);
        if (at.node[c] >= 0) continue;
        at.node[c] = static_cast<std::int32_t>(nodes_.size());
        slots_.set(node, node_channel, at.node[c]);
        nodes_.push_back(node);
    }
}

Influences Surface::influences(const RestGrid& rest, const SurfaceVertex& vertex) const {
    Influences out;
    const double total = visit_influences(rest, vertex, [&](std::uint32_t node, double weight) {
        out.nodes[out.count] = node;
        out.weights[out.count++] = weight;
    });
    for (std::size_t k = 0; k < out.count; ++k) out.weights[k] /= total;
    return out;
}

const Vec3i& Surface::influence(const SurfaceVertex& vertex) const {
    const auto corner = static_cast<std::size_t>(std::countr_zero(vertex.corners));
    return nodes_[static_cast<std::size_t>(cells_[vertex.cell].node[corner])];
}

std::uint32_t Surface::edge_vertex(const NodeGrid& grid, std::int32_t slot, int corner, int end,
                                   const CellContext& context) {
    std::int32_t& known = edge_vertices_[static_cast<std::size_t>(slot)][static_cast<std::size_t>(end)];
    if (known >= 0) return static_cast<std::uint32_t>(known);
    const Crossing& crossing = grid.crossing(slot);
    const std::uint32_t index = new_vertex(VertexKind::edge, crossing.edge.node, crossing.edge.axis, end);
    known = static_cast<std::int32_t>(index);
    SurfaceVertex& v = vertices_[index];
    v.rest = grid.crossing_position(crossing);
    v.normal = outward_normal(crossing, end == 0).cast<float>();
    set_nodes(v, context.cell, 1U << corner);
    return index;
}

namespace {

Vec3i face_node(const Vec3i& cell, int face) {
    Vec3i node = cell;
    node[face_axis(face)] += face & 1;
    return node;
}

// Returns the front of a crossing in a face beside its edge.
std::uint8_t front_in(const GridFace& face, const Crossing& crossing) {
    int side = 0;
    while (side < 3 && !(face_beside(crossing.edge, side) == face)) ++side;
    return crossing.front[static_cast<std::size_t>(side)];
}

}  // namespace

// Updates a face to its present mask: its position and the vertices of its instances, which keep their
// indices and may lose nodes.
void Surface::update_face(const NodeGrid& grid, int face, const CellContext& context) {
    SurfaceCell& cell = cells_[context.cell];
    const unsigned mask = face_mask(cell.mask, face);
    if (mask == 0) return;
    const auto f = static_cast<std::size_t>(face);
    const int axis = face_axis(face);
    if (cell.face[f] < 0) cell.face[f] = face_at(face_node(cell.lowest_node, face), axis);
    Face& record = faces_[static_cast<std::size_t>(cell.face[f])];
    std::uint8_t front = 0;
    if (std::has_single_bit(mask)) {
        const auto k = static_cast<std::size_t>(std::countr_zero(mask));
        front = front_in({face_node(cell.lowest_node, face), axis}, context.crossing(grid, face_edges[f][k]));
    }
    if (record.mask == mask && record.front == front) return;
    const bool is_known = record.mask == mask;
    record.mask = static_cast<std::uint8_t>(mask);
    record.front = front;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<FaceCrossing, 4> crossings;
    std::array<const Crossing*, 4> raw{};
    for (int k = 0; k < 4; ++k) {
        if (!(mask >> k & 1U)) continue;
        const auto i = static_cast<std::size_t>(k);
        raw[i] = &context.crossing(grid, face_edges[f][i]);
        crossings[i] = face_crossing(k, raw[i]->hit, raw[i]->normal[u], raw[i]->normal[v], raw[i]->cut);
        if (front > 0) crossings[i].front = static_cast<double>(front) / front_steps;
    }
    const FacePlacement placement = place_face_vertex(mask, crossings);
    record.position = placement.point;
    record.smooth = placement.smooth;
    if (!placement.smooth) {
        bool is_cut = false, is_rim = false;
        Vec2 mean = Vec2::Zero();
        for (std::size_t k = 0; k < 4; ++k) {
            if (!raw[k]) continue;
            (raw[k]->cut >= 0 ? is_cut : is_rim) = true;
            mean += crossings[k].point / std::popcount(mask);
        }
        const Vec3 point = face_point(axis, 0, record.position), inner = face_point(axis, 0, mean);
        const Vec3 kept = is_cut ? within_boundary(grid, face_node(cell.lowest_node, face),
                                                   -Vec3i::Unit(axis), Vec3i::Ones(), point, inner, is_rim)
                                 : point;
        record.position = Vec2(kept[u], kept[v]);
    }
    if (is_known)
        move_face(grid, {face_node(cell.lowest_node, face), axis}, record);
    else
        update_face_vertices(grid, face, record, context, raw);
}

// Moves the vertices of a face whose front moved. They keep the cell whose corners move them, so that a
// surface made again from the last fronts has the same weights.
void Surface::move_face(const NodeGrid& grid, const GridFace& face, const Face& record) {
    for (const std::int32_t vertex : record.vertex)
        if (vertex >= 0) place(vertex, face_rest(grid.rest(), face.node, face.axis, record.position));
}

void Surface::update_face_vertices(const NodeGrid& grid, int face, Face& record, const CellContext& context,
                                   const std::array<const Crossing*, 4>& crossings) {
    const Vec3i node = face_node(cells_[context.cell].lowest_node, face);
    const int axis = face_axis(face);
    const FaceConfiguration& configuration = context.table.face(record.mask);
    for (int instance = 0; instance < 4; ++instance) {
        if (configuration.instance[static_cast<std::size_t>(instance)] != instance) continue;
        if (!(context.edges.inside >> face_corner(face, instance) & 1U)) continue;
        std::int32_t& vertex = record.vertex[static_cast<std::size_t>(instance)];
        if (vertex < 0)
            vertex = static_cast<std::int32_t>(new_vertex(VertexKind::face, node, axis, instance));
        SurfaceVertex& out = vertices_[static_cast<std::size_t>(vertex)];
        place(vertex, face_rest(grid.rest(), node, axis, record.position));
        set_nodes(out, context.cell, face_corners(face, instance, configuration));
        Vec3 normal = Vec3::Zero();
        for (std::size_t k = 0; k < 4; ++k) {
            if (!crossings[k]) continue;
            // Ring edge k runs from ring corner k to k+1; edges 2 and 3 run against their axis.
            const double sign = k < 2 ? 1 : -1;
            if (configuration.instance[k] == instance) normal += sign * crossings[k]->normal;
            if (configuration.instance[(k + 1) % 4] == instance) normal -= sign * crossings[k]->normal;
        }
        out.normal = unit_or(normal, Vec3::Unit(axis)).cast<float>();
    }
}

// Finds the centre vertex of the sheets that cross a face of the cell. Returns false if the sheets are of
// several groups, which are unrelated in this cell.
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
            centre = wanted_rest(cell.centre[fan]);
            return true;
        }
    return false;
}

// Places the faces of the cell on which sheets meet. This is the second pass, when all centres are known. A
// face that moves also changes the cell on its other side.
void Surface::settle_faces(const NodeGrid& grid, std::uint32_t cell) {
    for (int face = 0; face < face_count; ++face) {
        const int axis = face_axis(face);
        const std::int32_t slot = cells_[cell].face[static_cast<std::size_t>(face)];
        if (slot < 0) continue;
        Face& record = faces_[static_cast<std::size_t>(slot)];
        if (record.smooth) continue;
        const Vec3i node = face_node(cells_[cell].lowest_node, face);
        Vec3i below = node;
        --below[axis];
        if (below[axis] < 0) continue;  // a face on the grid's rim has only one cell
        const std::int32_t low = slots_.get(below, cell_channel), high = slots_.get(node, cell_channel);
        if (low < 0 || high < 0) continue;
        Vec3 centre[2];
        const bool known = centre_of_face(cells_[static_cast<std::size_t>(low)], 2 * axis + 1, centre[0]) &&
                           centre_of_face(cells_[static_cast<std::size_t>(high)], 2 * axis, centre[1]);
        const Vec3 rest =
            known ? place_between_centres(axis, grid.rest().node_position(node)[axis], centre[0], centre[1])
                  : face_rest(grid.rest(), node, axis, record.position);
        bool moved = false;
        for (const std::int32_t index : record.vertex) {
            if (index < 0) continue;
            moved = moved || wanted_rest(index) != rest;
            place(index, rest);
        }
        if (moved) touch(static_cast<std::uint32_t>(face & 1 ? high : low));
    }
}

// Returns the faces whose vertices place the centre of a group: if its sheet is of one cut and known fronts
// of it lie in the cell, the faces in which it ends, so that the front runs straight between them; else all.
unsigned Surface::faces_that_place(const CellContext& context, unsigned faces,
                                   std::span<const CellCrossing> crossings) const {
    const auto is_first = [&](const CellCrossing& c) { return c.cut == crossings[0].cut; };
    if (crossings[0].cut < 0 || !std::all_of(crossings.begin(), crossings.end(), is_first)) return faces;
    const SurfaceCell& cell = cells_[context.cell];
    unsigned ends = 0;
    bool is_known = false;
    for (int f = 0; f < face_count; ++f) {
        if ((faces >> f & 1U) == 0 || !std::has_single_bit(face_mask(cell.mask, f))) continue;
        ends |= 1U << f;
        const auto record = static_cast<std::size_t>(cell.face[static_cast<std::size_t>(f)]);
        is_known = is_known || faces_[record].front > 0;
    }
    return is_known ? ends : faces;
}

// Returns the position of the centre vertices of a group of linked crossings; cells, in the cell.
Vec3 Surface::place_group(const NodeGrid& grid, unsigned group, const CellContext& context) const {
    const CellConfiguration& configuration = context.configuration;
    std::array<CellCrossing, edge_count> crossings;
    std::size_t count = 0;
    for (int e = 0; e < edge_count; ++e) {
        const auto i = static_cast<std::size_t>(e);
        if (configuration.edge_group[i] != group) continue;
        const Crossing& raw = context.crossing(grid, e);
        CellCrossing& c = crossings[count++];
        const int axis = edge_axis(e);
        for (int k = 0; k < 3; ++k) c.point[k] = corner_bit(edge_corners[i][0], k);
        c.point[axis] += raw.hit;
        c.normal = configuration.edge_side[i] < 0 ? Vec3(-raw.normal) : raw.normal;
        c.grazing = std::abs(raw.normal[axis]) < tuning::placement::grazing_edge_cosine;
        c.cut = raw.cut;
    }
    const unsigned faces =
        faces_that_place(context, configuration.group_faces[group], {crossings.data(), count});
    Vec3 mean = Vec3::Zero();
    for (int f = 0; f < face_count; ++f)
        if (faces >> f & 1U)
            mean += face_point(
                face_axis(f), f & 1,
                faces_[static_cast<std::size_t>(cells_[context.cell].face[static_cast<std::size_t>(f)])]
                    .position);
    mean /= std::popcount(faces);
    const std::span<const CellCrossing> all(crossings.data(), count);
    const Vec3 centre = place_centre(all, configuration.group_oriented[group], mean);
    const auto is_of_cut = [](const CellCrossing& c) { return c.cut >= 0; };
    if (std::none_of(all.begin(), all.end(), is_of_cut)) return centre;
    return within_boundary(grid, cells_[context.cell].lowest_node, Vec3i::Zero(), Vec3i::Ones(), centre, mean,
                           !std::all_of(all.begin(), all.end(), is_of_cut));
}

// Keeps the centre vertex of each fan whose first quad still gives it the same name; releases the others and
// makes new ones.
void Surface::update_fans(const NodeGrid& grid, const CellContext& context) {
    SurfaceCell& cell = cells_[context.cell];
    const CellConfiguration& configuration = context.configuration;
    const std::span<const TableQuad> table = context.table.quads(cell.mask);
    std::array<std::uint8_t, 8> names{};
    for (std::size_t i = table.size(); i-- > 0;)
        names[table[i].fan] = static_cast<std::uint8_t>(16 * table[i].corner + table[i].edge);
    std::array<std::int32_t, 8> kept;
    kept.fill(-1);
    for (std::size_t k = 0; k < cell.fan_count; ++k) {
        if (cell.centre[k] < 0) continue;
        const auto same = std::find(names.begin(), names.begin() + configuration.fan_count, cell.fan_name[k]);
        if (same != names.begin() + configuration.fan_count) {
            kept[static_cast<std::size_t>(same - names.begin())] = cell.centre[k];
        } else {
            vertices_[static_cast<std::size_t>(cell.centre[k])].corners = 0;
            wanted_.erase(cell.centre[k]);
            free_vertices_.push_back(static_cast<std::uint32_t>(cell.centre[k]));
            --alive_count_;
        }
    }
    cell.fan_count = configuration.fan_count;
    cell.fan_name = names;
    cell.centre = kept;
    std::array<Vec3, 8> positions;
    for (unsigned group = 0; group < configuration.group_count; ++group)
        positions[group] = place_group(grid, group, context);
    for (std::size_t fan = 0; fan < configuration.fan_count; ++fan) {
        if (!(cell.inside >> configuration.fan_corner[fan] & 1U)) continue;
        if (cell.centre[fan] < 0)
            cell.centre[fan] =
                static_cast<std::int32_t>(new_vertex(VertexKind::centre, cell.lowest_node, 0, names[fan]));
        SurfaceVertex& v = vertices_[static_cast<std::size_t>(cell.centre[fan])];
        place(cell.centre[fan],
              grid.rest().origin + grid.rest().cell_size * (cell.lowest_node.cast<double>() +
                                                            positions[configuration.fan_group[fan]]));
        set_nodes(v, context.cell, configuration.fan_corners[fan]);
    }
}

void Surface::update_quads(const NodeGrid& grid, const CellContext& context) {
    SurfaceCell& cell = cells_[context.cell];
    const std::span<const TableQuad> table = context.table.quads(cell.mask);
    std::size_t count = 0;
    for (const TableQuad& q : table) count += cell.inside >> q.corner & 1U;
    quad_count_ += count - cell.quad_count;
    reserve_quads(cell, count);
    cell.quad_count = static_cast<std::uint8_t>(count);
    const auto face_vertex = [&](std::uint8_t face, std::uint8_t instance) {
        return static_cast<std::uint32_t>(faces_[static_cast<std::size_t>(cell.face[face])].vertex[instance]);
    };
    std::array<Vec3, 8> normals;
    normals.fill(Vec3::Zero());
    std::uint32_t next = cell.first_quad;
    for (const TableQuad& q : table) {
        if (!(cell.inside >> q.corner & 1U)) continue;
        const std::int32_t slot = context.edges.slots[q.edge];
        const int end = edge_corners[q.edge][0] == q.corner ? 0 : 1;
        SurfaceQuad& quad = quads_[next++];
        quad.crossing = slot;
        quad.vertices = {
            edge_vertex(grid, slot, q.corner, end, context), face_vertex(q.first_face, q.first_instance),
            static_cast<std::uint32_t>(cell.centre[q.fan]), face_vertex(q.second_face, q.second_instance)};
        normals[q.fan] += outward_normal(grid.crossing(slot), end == 0);
    }
    for (std::size_t fan = 0; fan < cell.fan_count; ++fan)
        if (cell.centre[fan] >= 0)
            vertices_[static_cast<std::size_t>(cell.centre[fan])].normal =
                unit_or(normals[fan], Vec3::UnitZ()).cast<float>();
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

void Surface::update_cell(const NodeGrid& grid, std::uint32_t index) {
    SurfaceCell& cell = cells_[index];
    const Table& table = Table::get();
    const CellEdges edges = grid.cell_edges(cell.lowest_node);
    cell.mask = edges.mask;
    cell.inside = edges.inside;
    const CellContext context{index, edges, table, table.cell(edges.mask)};
    for (int face = 0; face < face_count; ++face) update_face(grid, face, context);
    update_fans(grid, context);
    update_quads(grid, context);
}

std::size_t Surface::bytes() const {
    return slots_.bytes() + cells_.size() * sizeof(SurfaceCell) + faces_.size() * sizeof(Face) +
           edge_vertices_.size() * sizeof(edge_vertices_[0]) + vertices_.size() * sizeof(SurfaceVertex) +
           quads_.size() * sizeof(SurfaceQuad) + nodes_.size() * sizeof(Vec3i) +
           cell_stamp_.size() * sizeof(std::uint64_t);
}

}  // namespace splitcubes::splitting
