#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/step_events.h>
#include <splitcubes/body/body.h>

#include <algorithm>

namespace splitcubes::api {

namespace {

std::vector<std::int32_t> rigid_pieces(const body::Body& body) {
    std::vector<std::int32_t> out;
    for (const meshless::RigidPiece& piece : body.phyxels().rigid.bodies) out.push_back(piece.piece);
    std::sort(out.begin(), out.end());
    return out;
}

}  // namespace

void StepEvents::begin(const Session& session) {
    before_.clear();
    for (const auto& body : session.world().bodies())
        before_.push_back({body->grid().crossings().size(), rigid_pieces(*body)});
}

StepResult StepEvents::end(Session& session, const body::StepReport& report) {
    for (std::size_t k = 0; k < body::stage_count; ++k) {
        stages_.resize(body::stage_count);
        stages_[k] = {body::stage_names[k], report.seconds[k]};
    }
    cuts_began_.clear();
    pieces_separated_.clear();
    torn_.clear();
    made_rigid_.clear();
    cutting_.assign(session.things().tools.size(), {});
    for (std::size_t b = 0; b < before_.size(); ++b) {
        list_cuts(session, b);
        list_pieces(session, b);
    }
    for (std::size_t k = 0; k < cutting_.size(); ++k) session.things().tools.at(k).cutting = cutting_[k];
    list_forces(session, report);
    return {.time = report.time,
            .stages = stages_,
            .tools = tools_,
            .handles = handles_,
            .cuts_began = cuts_began_,
            .pieces_separated = pieces_separated_,
            .torn = torn_,
            .made_rigid = made_rigid_,
            .pieces = report.totals.pieces,
            .new_cut_edges = report.counts.new_cut_edges,
            .contacts = report.counts.contacts,
            .kinetic_energy = report.totals.kinetic_energy,
            .elastic_energy = report.totals.elastic_energy,
            .solver_iterations = report.solver.iterations,
            .warnings = report.flags};
}

// By the numbers that the new crossings carry.
void StepEvents::list_cuts(Session& session, std::size_t index) {
    const body::Body& body = *session.world().bodies()[index];
    const BodyId id = session.things().bodies.id_at(index);
    const std::vector<body::Tool>& tools = session.world().tools();
    std::size_t torn = 0;
    for (const splitting::Crossing& crossing :
         std::span(body.grid().crossings()).subspan(before_[index].crossings)) {
        torn += crossing.cut == body::tear_cut_number;
        for (std::size_t k = 0; k < tools.size(); ++k)
            if (tools[k].cut_number == crossing.cut &&
                std::find(cutting_[k].begin(), cutting_[k].end(), id) == cutting_[k].end())
                cutting_[k].push_back(id);
    }
    if (torn > 0) torn_.push_back({id, torn});
    for (std::size_t k = 0; k < tools.size(); ++k) {
        const std::vector<BodyId>& last = session.things().tools.at(k).cutting;
        const bool cuts = std::find(cutting_[k].begin(), cutting_[k].end(), id) != cutting_[k].end();
        if (cuts && std::find(last.begin(), last.end(), id) == last.end())
            cuts_began_.push_back({session.things().tools.id_at(k), id});
    }
}

void StepEvents::list_pieces(const Session& session, std::size_t index) {
    const body::Body& body = *session.world().bodies()[index];
    const BodyId id = session.things().bodies.id_at(index);
    for (const splitting::PieceSplit& split : body.splits())
        pieces_separated_.push_back({id, split.piece, split.parent});
    const std::vector<std::int32_t>& last = before_[index].rigid;
    for (const std::int32_t piece : rigid_pieces(body))
        if (!std::binary_search(last.begin(), last.end(), piece)) made_rigid_.push_back({id, piece});
}

void StepEvents::list_forces(const Session& session, const body::StepReport& report) {
    const Things& things = session.things();
    tools_.clear();
    for (std::size_t k = 0; k < report.tools.size(); ++k) {
        const body::ToolForce& force = report.tools[k];
        tools_.push_back({things.tools.id_at(k), public_vector(force.force), public_vector(force.torque),
                          force.area, force.work});
    }
    handles_.clear();
    std::size_t next = 0;
    for (std::size_t b = 0; b < things.bodies.size(); ++b)
        for (std::size_t h = 0; h < things.handles.size(); ++h)
            if (things.handles.at(h).body == things.bodies.id_at(b))
                handles_.push_back({things.handles.id_at(h), public_vector(report.handle_forces[next++])});
}

}  // namespace splitcubes::api
