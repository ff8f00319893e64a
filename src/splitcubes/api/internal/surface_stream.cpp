#include <splitcubes/api/internal/surface_stream.h>
#include <splitcubes/api/internal/tuning.h>
#include <splitcubes/body/body.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <atomic>
#include <numeric>

namespace splitcubes::api {

namespace {

void make_ascending(std::vector<std::uint32_t>& slots) {
    std::sort(slots.begin(), slots.end());
    slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
}

// Returns ranges of ascending indices; each index stands for `each` slots.
void append_ranges(std::span<const std::uint32_t> indices, std::uint32_t each, std::uint32_t gap,
                   std::vector<Range>& out) {
    out.clear();
    for (const std::uint32_t index : indices) {
        const std::uint32_t first = each * index;
        if (!out.empty() && first <= out.back().first + out.back().count + gap)
            out.back().count = first + each - out.back().first;
        else
            out.push_back({first, each});
    }
}

// Streams never share a revision: one that shows another state of a body must not seem unchanged.
std::uint64_t first_revision() {
    static std::atomic<std::uint64_t> streams{0};
    return ++streams << 32;
}

// No two vertices of a surface have the same; not 0.
std::uint64_t identity_of(const splitting::SurfaceVertex& v) {
    std::uint64_t out = 1;
    for (int axis = 0; axis < 3; ++axis)
        out = out << 12 | static_cast<std::uint64_t>(v.lowest_node[axis] & 0xfff);
    return ((out << 2 | static_cast<std::uint64_t>(v.kind)) << 2 | v.axis) << 8 | v.instance;
}

void put(const Vec3& v, std::size_t slot, std::vector<float>& out) {
    for (int k = 0; k < 3; ++k) out[3 * slot + static_cast<std::size_t>(k)] = static_cast<float>(v[k]);
}

// Materials of a surface with cut faces: all that a later one can have.
std::vector<std::string> names_of_materials(const geometry::AttributeTransfer* transfer) {
    if (transfer == nullptr) return {geometry::boundary_material, geometry::cut_material};
    geometry::SurfaceMesh one;
    one.mesh.positions = {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY()};
    one.mesh.triangles = {{0, 1, 2}};
    one.triangle_origin = {geometry::Origin::cut};
    std::vector<std::string> out;
    for (const geometry::Material& material : transfer->onto(one, Parallel(1)).materials)
        out.push_back(material.name);
    return out;
}

}  // namespace

SurfaceStream::SurfaceStream(const body::Body& body,
                             std::shared_ptr<const geometry::AttributeTransfer> transfer,
                             const Parallel& parallel)
    : transfer_(std::move(transfer)),
      material_names_(names_of_materials(transfer_.get())),
      revision_(first_revision()) {
    std::vector<std::uint32_t> cells(body.surface().cells().size());
    std::iota(cells.begin(), cells.end(), 0U);
    update_cells(body, cells, parallel);
    move(body, parallel);
    // A copy may hold another surface: free slots have changed, too.
    const auto vertices = static_cast<std::uint32_t>(pieces_.size());
    const auto triangles = static_cast<std::uint32_t>(material_.size());
    if (vertices > 0) vertex_ranges_ = new_ranges_ = {{0, vertices}};
    if (triangles > 0) triangle_ranges_ = {{0, triangles}};
}

void SurfaceStream::forget_changes() {
    for (auto* ranges : {&vertex_ranges_, &triangle_ranges_, &new_ranges_}) ranges->clear();
}

void SurfaceStream::take_changes(const body::Body& body, const Parallel& parallel) {
    update_cells(body, body.surface().changed_cells(), parallel);
}

void SurfaceStream::update_cells(const body::Body& body, std::span<const std::uint32_t> cells,
                                 const Parallel& parallel) {
    if (cells.empty()) return;
    const splitting::Surface& surface = body.surface();
    changed_quads_.clear();
    changed_.clear();
    fresh_.clear();
    runs_.resize(surface.cells().size());
    const std::size_t vertices = surface.vertices().size(), triangles = 2 * surface.quad_slot_count();
    for (auto* indices : {&positions_, &normals_, &rest_}) indices->resize(3 * vertices, 0.0F);
    pieces_.resize(vertices, -1);
    identity_.resize(vertices, 0);
    triangles_.resize(3 * triangles, 0);
    origins_.resize(triangles, SurfaceOrigin::boundary);
    material_.resize(triangles, 0);
    cuts_.resize(triangles, 0);
    edges_.resize(triangles, 0);
    if (transfer_ && !transfer_->input_attributes().corner_uv.empty()) uv_.resize(6 * triangles, 0.0F);
    // All are cleared first: the slots that one cell leaves may be another's now.
    for (const std::uint32_t cell : cells) clear_run(runs_[cell]);
    for (const std::uint32_t cell : cells) write_run(body, cell);
    make_ascending(changed_quads_);
    make_ascending(changed_);
    for (const std::uint32_t vertex : changed_) update_vertex(body, vertex);
    if (!body.splits().empty()) update_pieces(body, parallel);
    update_attributes(body, parallel);
    append_ranges(changed_, 1, tuning::surface_stream::max_gap, vertex_ranges_);
    append_ranges(changed_quads_, 2, tuning::surface_stream::max_gap, triangle_ranges_);
    append_ranges(fresh_, 1, 0, new_ranges_);
    ++revision_;
}

void SurfaceStream::clear_run(const Run& run) {
    for (std::uint32_t quad = run.first; quad < run.first + run.count; ++quad) {
        changed_quads_.push_back(quad);
        for (std::size_t k = 6 * std::size_t{quad}; k < 6 * std::size_t{quad} + 6; ++k) {
            changed_.push_back(triangles_[k]);
            triangles_[k] = 0;
        }
        for (std::size_t slot = 2 * std::size_t{quad}; slot < 2 * std::size_t{quad} + 2; ++slot) {
            cuts_[slot] = 0;
            edges_[slot] = 0;
        }
    }
}

void SurfaceStream::write_run(const body::Body& body, std::uint32_t cell) {
    const splitting::SurfaceCell& own = body.surface().cells()[cell];
    runs_[cell] = {own.first_quad, own.quad_count};
    std::size_t slot = 2 * std::size_t{own.first_quad};
    for (const splitting::SurfaceQuad& quad : body.surface().quads(own)) {
        changed_quads_.push_back(static_cast<std::uint32_t>(slot / 2));
        const splitting::Crossing& crossing = body.grid().crossing(quad.crossing);
        for (const auto& corners : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
            for (std::size_t k = 0; k < 3; ++k)
                triangles_[3 * slot + k] = quad.vertices[static_cast<std::size_t>(corners[k])];
            origins_[slot] = static_cast<SurfaceOrigin>(crossing.origin);
            cuts_[slot] = crossing.cut;
            edges_[slot++] = quad.crossing;
        }
        for (const std::uint32_t vertex : quad.vertices) changed_.push_back(vertex);
    }
}

void SurfaceStream::update_vertex(const body::Body& body, std::uint32_t vertex) {
    const splitting::SurfaceVertex& v = body.surface().vertices()[vertex];
    const std::uint64_t identity = v.alive() ? identity_of(v) : 0;
    if (identity != 0 && identity != identity_[vertex]) fresh_.push_back(vertex);
    identity_[vertex] = identity;
    pieces_[vertex] = identity == 0 ? -1 : body.pieces().piece_of(body.grid(), body.surface().influence(v));
    put(body.pose() * v.rest, vertex, rest_);
}

// Vertices far from a cut come off with their piece.
void SurfaceStream::update_pieces(const body::Body& body, const Parallel& parallel) {
    std::vector<std::uint8_t> differs(pieces_.size(), 0);
    parallel.for_each(pieces_.size(), 4096, [&](std::size_t i) {
        const splitting::SurfaceVertex& v = body.surface().vertices()[i];
        if (!v.alive()) return;
        const std::int32_t piece = body.pieces().piece_of(body.grid(), body.surface().influence(v));
        differs[i] = piece != pieces_[i];
        pieces_[i] = piece;
    });
    for (std::uint32_t i = 0; i < differs.size(); ++i)
        if (differs[i] != 0) changed_.push_back(i);
    make_ascending(changed_);
}

// Updates the changed triangles alone: the attributes of one depend on no other.
void SurfaceStream::update_attributes(const body::Body& body, const Parallel& parallel) {
    geometry::SurfaceMesh part;
    std::vector<std::size_t> slots;
    for (const std::uint32_t quad : changed_quads_)
        for (std::size_t slot = 2 * std::size_t{quad}; slot < 2 * std::size_t{quad} + 2; ++slot) {
            const bool is_free = triangles_[3 * slot] == triangles_[3 * slot + 1];
            material_[slot] = !is_free && origins_[slot] == SurfaceOrigin::cut ? 1 : 0;
            if (!uv_.empty()) std::fill_n(uv_.begin() + static_cast<std::ptrdiff_t>(6 * slot), 6, 0.0F);
            if (!is_free) slots.push_back(slot);
        }
    if (!transfer_) return;
    for (const std::size_t slot : slots) {
        const auto first = static_cast<std::uint32_t>(part.mesh.positions.size());
        for (std::size_t k = 0; k < 3; ++k)
            part.mesh.positions.push_back(body.pose() *
                                          body.surface().vertices()[triangles_[3 * slot + k]].rest);
        part.mesh.triangles.push_back({first, first + 1, first + 2});
        part.triangle_origin.push_back(static_cast<geometry::Origin>(origins_[slot]));
    }
    const geometry::MeshAttributes attributes = transfer_->onto(part, parallel);
    for (std::size_t t = 0; t < slots.size(); ++t) {
        material_[slots[t]] = attributes.triangle_material[t];
        if (uv_.empty()) continue;
        for (std::size_t k = 0; k < 6; ++k) uv_[6 * slots[t] + k] = attributes.corner_uv[t][k / 2][k % 2];
    }
}

void SurfaceStream::move(const body::Body& body, const Parallel& parallel) {
    parallel.for_each(pieces_.size(), 4096, [&](std::size_t i) {
        if (pieces_[i] < 0) return;
        put(body.vertex_positions()[i], i, positions_);
        put(body.vertex_normals()[i], i, normals_);
    });
}

SurfaceView SurfaceStream::view() const {
    return {.positions = positions_,
            .normals = normals_,
            .rest_positions = rest_,
            .pieces = pieces_,
            .triangles = triangles_,
            .origins = origins_,
            .triangle_material = material_,
            .corner_uv = uv_,
            .cuts = cuts_,
            .edges = edges_,
            .changed_vertices = vertex_ranges_,
            .changed_triangles = triangle_ranges_,
            .new_vertices = new_ranges_,
            .revision = revision_};
}

std::size_t SurfaceStream::bytes() const {
    return sizeof(float) * (positions_.capacity() + normals_.capacity() + rest_.capacity() + uv_.capacity()) +
           sizeof(std::int32_t) * (pieces_.capacity() + triangles_.capacity() + material_.capacity() +
                                   cuts_.capacity() + edges_.capacity()) +
           sizeof(std::uint64_t) * (identity_.capacity() + runs_.capacity()) + origins_.capacity();
}

}  // namespace splitcubes::api
