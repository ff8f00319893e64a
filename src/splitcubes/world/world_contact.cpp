// Integration of bodies, alone or in islands of bodies in contact.
#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/dynamics/time_integrator.h>
#include <splitcubes/world/island_step.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <array>

namespace splitcubes::body {

namespace {

using meshless::CachedContact;
using meshless::ContactInput;

// Collects the cached data of the given contacts; `contacts` and `all` are sorted by key.
void find_cached_contacts(std::span<const meshless::Contact> contacts, const std::vector<CachedContact>& all,
                          std::vector<CachedContact>& out) {
    meshless::CachedContactFinder finder(&all);
    out.clear();
    for (const meshless::Contact& c : contacts)
        if (const CachedContact* cached = finder.find(c.key)) out.push_back(*cached);
}

}  // namespace

void World::integrate(const StepContext& context, StepReport& report) {
    next_cached_contacts_.clear();
    std::size_t handles = 0;
    for (const auto& body : bodies_) handles += body->handles().size();
    report.handle_forces.assign(handles, Vec3::Zero());
    for (const ContactIsland& island : contact_islands_) integrate_island(island, context, report);
    std::sort(next_cached_contacts_.begin(), next_cached_contacts_.end(),
              [](const CachedContact& a, const CachedContact& b) { return a.key < b.key; });
    cached_contacts_.swap(next_cached_contacts_);
}

void World::integrate_island(const ContactIsland& island, const StepContext& context, StepReport& report) {
    if (bodies_[island.bodies[0]]->is_lattice_driven())
        return bodies_[island.bodies[0]]->advance_deformation(context, report);
    IslandStep& step = *island_step_;
    find_cached_contacts(island.contacts, cached_contacts_, step.cached);
    step.handle_springs.clear();
    step.limits.clear();
    step.inputs.clear();
    step.handle_forces.clear();
    for (std::uint32_t k = 0; k < island.bodies.size(); ++k) {
        Body& body = *bodies_[island.bodies[k]];
        body.add_handle_springs(context, k, step.handle_springs, step.limits);
        step.inputs.push_back(body.begin_step(context));
    }
    const ContactInput contacts{island.contacts, step.handle_springs, step.limits, &step.cached,
                                &step.handle_forces};
    if (island.bodies.size() == 1) {
        Body& body = *bodies_[island.bodies[0]];
        step.inputs[0].contacts = contacts;
        const meshless::SolverReport solved =
            body.solver().step(body.phyxels(), body.neighbourhoods(), body.settings().material,
                               step.inputs[0], context.solver, context.parallel);
        body.end_step(context, solved, report);
    } else if (context.solver.kind == meshless::SolverKind::implicit_steps) {
        step_together(island, contacts, context, report);
    } else {
        step_separately(island, contacts, context, report);
    }
    next_cached_contacts_.insert(next_cached_contacts_.end(), step.cached.begin(), step.cached.end());
    std::size_t handle = 0;  // within the island
    for (const std::size_t b : island.bodies) {
        std::size_t first = 0;
        for (std::size_t before = 0; before < b; ++before) first += bodies_[before]->handles().size();
        for (std::size_t h = 0; h < bodies_[b]->handles().size(); ++h, ++handle)
            if (handle < step.handle_forces.size())
                report.handle_forces[first + h] = step.handle_forces[handle];
    }
}

// Implicit steps: solves one system for all bodies of the island.
void World::step_together(const ContactIsland& island, const ContactInput& contacts,
                          const StepContext& context, StepReport& report) {
    IslandStep& step = *island_step_;
    step.members.clear();
    for (std::size_t k = 0; k < island.bodies.size(); ++k) {
        Body& body = *bodies_[island.bodies[k]];
        step.inputs[k] = body.solver().begin(body.phyxels(), body.settings().material, step.inputs[k]);
        body.solver().watch(body.phyxels(), body.neighbourhoods(), body.settings().material, step.inputs[k],
                            context.solver, context.parallel);
        step.members.push_back({body.solver().implicit_solver(), body.phyxels(), body.neighbourhoods(),
                                body.settings().material, step.inputs[k]});
    }
    meshless::ImplicitSolver::step_together(step.members, contacts, context.solver, context.parallel);
    for (std::uint32_t k = 0; k < island.bodies.size(); ++k) {
        Body& body = *bodies_[island.bodies[k]];
        body.solver().correct(body.phyxels(), body.neighbourhoods(), body.settings().material, step.inputs[k],
                              contacts, k, context.solver, step.members[k].report, context.parallel);
        body.solver().end(body.phyxels(), step.members[k].report);
        body.end_step(context, step.members[k].report, report);
    }
}

// Explicit steps: steps each body with the contacts that involve it alone, then resolves the contacts between
// bodies once by impulses.
void World::step_separately(const ContactIsland& island, const ContactInput& contacts,
                            const StepContext& context, StepReport& report) {
    std::vector<meshless::Contact> between;
    std::vector<CachedContact> next;
    std::vector<Vec3> forces;
    std::vector<meshless::SolverReport> solved;
    std::vector<meshless::StepInput> inputs;
    for (std::uint32_t k = 0; k < island.bodies.size(); ++k) {
        Body& body = *bodies_[island.bodies[k]];
        std::vector<meshless::Contact> own;
        for (meshless::Contact c : contacts.contacts) {
            const bool is_own = c.upper.part == k && (c.lower.is_collider() || c.lower.part == k);
            if (!is_own && c.upper.part == k) between.push_back(c);
            c.upper.part = c.lower.part = 0;
            if (is_own) own.push_back(c);
        }
        std::vector<meshless::HandleSpring> handle_springs;
        std::vector<double> limits;
        body.add_handle_springs(context, 0, handle_springs, limits);
        std::vector<CachedContact> cached;
        find_cached_contacts(own, *contacts.cached, cached);
        std::vector<Vec3> own_forces;
        inputs.push_back(body.begin_step(context));
        inputs[k].contacts = {own, handle_springs, limits, &cached, &own_forces};
        solved.push_back(body.solver().step(body.phyxels(), body.neighbourhoods(), body.settings().material,
                                            inputs[k], context.solver, context.parallel));
        next.insert(next.end(), cached.begin(), cached.end());
        forces.insert(forces.end(), own_forces.begin(), own_forces.end());
    }
    *contacts.handle_forces = forces;
    push_between(island, between, inputs, context, next);
    *contacts.cached = next;
    for (std::size_t k = 0; k < island.bodies.size(); ++k)
        bodies_[island.bodies[k]]->end_step(context, solved[k], report);
}

void World::push_between(const ContactIsland& island, std::vector<meshless::Contact>& between,
                         std::span<const meshless::StepInput> inputs, const StepContext& context,
                         std::vector<CachedContact>& next) {
    if (between.empty()) return;
    std::sort(between.begin(), between.end(),
              [](const meshless::Contact& a, const meshless::Contact& b) { return a.key < b.key; });
    std::vector<meshless::ContactImpulses::Part> parts;
    std::vector<std::span<Vec3>> position, velocity;
    std::vector<std::span<std::uint8_t>> touching;
    for (std::size_t k = 0; k < island.bodies.size(); ++k) {
        meshless::Phyxels& phyxels = bodies_[island.bodies[k]]->phyxels();
        parts.push_back({phyxels.previous_position, phyxels.mass, inputs[k].held});
        position.emplace_back(phyxels.position);
        velocity.emplace_back(phyxels.velocity);
        touching.emplace_back(phyxels.touching);
    }
    meshless::ContactImpulses impulses;
    std::vector<CachedContact> cached;
    ContactInput input;
    input.contacts = between;
    input.cached = &cached;
    impulses.begin(input, parts, context.dt);
    impulses.separate_points(position, 1);
    impulses.stop(velocity);
    impulses.finish(touching);
    next.insert(next.end(), cached.begin(), cached.end());
}

}  // namespace splitcubes::body
