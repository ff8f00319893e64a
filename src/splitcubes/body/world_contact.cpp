// Time step of bodies that push on each other.
#include <splitcubes/body/world.h>

#include <algorithm>
#include <array>

namespace splitcubes::body {

namespace {

using meshless::CachedContact;
using meshless::ContactInput;

// Copies the cached contacts with the keys of `contacts`; all lists are sorted by key.
void copy_cached(std::span<const meshless::Contact> contacts, const std::vector<CachedContact>& all,
                 std::vector<CachedContact>& out) {
    meshless::CachedContactFinder finder(&all);
    out.clear();
    for (const meshless::Contact& c : contacts)
        if (const CachedContact* cached = finder.find(c.key)) out.push_back(*cached);
}

}  // namespace

void World::integrate(const StepContext& context, StepReport& report) {
    next_memory_.clear();
    std::size_t handles = 0;
    for (const auto& body : bodies_) handles += body->handles().size();
    report.handle_forces.assign(handles, Vec3::Zero());
    for (const ContactIsland& group : contact_groups_) integrate_group(group, context, report);
    std::sort(next_memory_.begin(), next_memory_.end(),
              [](const CachedContact& a, const CachedContact& b) { return a.key < b.key; });
    contact_memory_.swap(next_memory_);
}

void World::integrate_group(const ContactIsland& group, const StepContext& context, StepReport& report) {
    if (bodies_[group.bodies[0]]->is_lattice_driven())
        return bodies_[group.bodies[0]]->advance_deformation(context, report);
    GroupStep& step = group_step_;
    copy_cached(group.contacts, contact_memory_, step.cached);
    step.handle_springs.clear();
    step.limits.clear();
    step.inputs.clear();
    step.handle_forces.clear();
    for (std::uint32_t k = 0; k < group.bodies.size(); ++k) {
        Body& body = *bodies_[group.bodies[k]];
        body.add_handle_springs(context, k, step.handle_springs, step.limits);
        step.inputs.push_back(body.begin_step(context));
    }
    const ContactInput contacts{group.contacts, step.handle_springs, step.limits, &step.cached,
                                &step.handle_forces};
    if (group.bodies.size() == 1) {
        Body& body = *bodies_[group.bodies[0]];
        step.inputs[0].contacts = contacts;
        const meshless::SolverReport solved =
            body.solver().step(body.phyxels(), body.neighbourhoods(), body.settings().material,
                               step.inputs[0], context.solver, context.parallel);
        body.end_step(context, solved, report);
    } else if (context.solver.kind == meshless::SolverKind::implicit_steps) {
        step_together(group, contacts, context, report);
    } else {
        step_apart(group, contacts, context, report);
    }
    next_memory_.insert(next_memory_.end(), step.cached.begin(), step.cached.end());
    std::size_t handle = 0;
    for (const std::size_t b : group.bodies) {
        std::size_t first = 0;
        for (std::size_t before = 0; before < b; ++before) first += bodies_[before]->handles().size();
        for (std::size_t h = 0; h < bodies_[b]->handles().size(); ++h, ++handle)
            if (handle < step.handle_forces.size())
                report.handle_forces[first + h] = step.handle_forces[handle];
    }
}

// Implicit steps: one solve for all bodies.
void World::step_together(const ContactIsland& group, const ContactInput& contacts,
                          const StepContext& context, StepReport& report) {
    GroupStep& step = group_step_;
    step.members.clear();
    for (std::size_t k = 0; k < group.bodies.size(); ++k) {
        Body& body = *bodies_[group.bodies[k]];
        step.inputs[k] = body.solver().begin(body.phyxels(), body.settings().material, step.inputs[k]);
        body.solver().watch(body.phyxels(), body.neighbourhoods(), body.settings().material, step.inputs[k],
                            context.solver, context.parallel);
        step.members.push_back({body.solver().implicit_solver(), body.phyxels(), body.neighbourhoods(),
                                body.settings().material, step.inputs[k]});
    }
    meshless::ImplicitSolver::step_together(step.members, contacts, context.solver, context.parallel);
    for (std::uint32_t k = 0; k < group.bodies.size(); ++k) {
        Body& body = *bodies_[group.bodies[k]];
        body.solver().correct(body.phyxels(), body.neighbourhoods(), body.settings().material, step.inputs[k],
                              contacts, k, context.solver, step.members[k].report, context.parallel);
        body.solver().end(body.phyxels(), step.members[k].report);
        body.end_step(context, step.members[k].report, report);
    }
}

// Explicit steps: each body with its own contacts and colliders; then the contacts between bodies, once per
// step, by impulses.
void World::step_apart(const ContactIsland& group, const ContactInput& contacts, const StepContext& context,
                       StepReport& report) {
    std::vector<meshless::Contact> between;
    std::vector<CachedContact> next;
    std::vector<Vec3> forces;
    std::vector<meshless::SolverReport> solved;
    std::vector<meshless::StepInput> inputs;
    for (std::uint32_t k = 0; k < group.bodies.size(); ++k) {
        Body& body = *bodies_[group.bodies[k]];
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
        copy_cached(own, *contacts.cached, cached);
        std::vector<Vec3> own_handle_forces;
        inputs.push_back(body.begin_step(context));
        inputs[k].contacts = {own, handle_springs, limits, &cached, &own_handle_forces};
        solved.push_back(body.solver().step(body.phyxels(), body.neighbourhoods(), body.settings().material,
                                            inputs[k], context.solver, context.parallel));
        next.insert(next.end(), cached.begin(), cached.end());
        forces.insert(forces.end(), own_handle_forces.begin(), own_handle_forces.end());
    }
    *contacts.handle_forces = forces;
    push_between(group, between, inputs, context, next);
    *contacts.cached = next;
    for (std::size_t k = 0; k < group.bodies.size(); ++k)
        bodies_[group.bodies[k]]->end_step(context, solved[k], report);
}

void World::push_between(const ContactIsland& group, std::vector<meshless::Contact>& between,
                         std::span<const meshless::StepInput> inputs, const StepContext& context,
                         std::vector<CachedContact>& next) {
    if (between.empty()) return;
    std::sort(between.begin(), between.end(),
              [](const meshless::Contact& a, const meshless::Contact& b) { return a.key < b.key; });
    std::vector<meshless::ContactImpulses::Part> parts;
    std::vector<std::span<Vec3>> position, velocity;
    std::vector<std::span<std::uint8_t>> touching;
    for (std::size_t k = 0; k < group.bodies.size(); ++k) {
        meshless::Phyxels& phyxels = bodies_[group.bodies[k]]->phyxels();
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
