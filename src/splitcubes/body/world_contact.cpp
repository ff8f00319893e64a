// The step of bodies that push on each other.
#include <splitcubes/body/world.h>

#include <algorithm>
#include <array>

namespace splitcubes::body {

namespace {

using meshless::ContactInput;
using meshless::ContactMemory;

// What is remembered of these contacts; both sorted by key.
void find_memory_of(std::span<const meshless::Contact> contacts, const std::vector<ContactMemory>& all,
                    std::vector<ContactMemory>& out) {
    meshless::MemoryFinder finder(&all);
    out.clear();
    for (const meshless::Contact& c : contacts)
        if (const ContactMemory* memory = finder.find(c.key)) out.push_back(*memory);
}

}  // namespace

void World::integrate(const StepContext& context, StepReport& report) {
    next_memory_.clear();
    std::size_t handles = 0;
    for (const auto& body : bodies_) handles += body->handles().size();
    report.handle_forces.assign(handles, Vec3::Zero());
    for (const ContactGroup& group : contact_groups_) integrate_group(group, context, report);
    std::sort(next_memory_.begin(), next_memory_.end(),
              [](const ContactMemory& a, const ContactMemory& b) { return a.key < b.key; });
    contact_memory_.swap(next_memory_);
}

void World::integrate_group(const ContactGroup& group, const StepContext& context, StepReport& report) {
    if (bodies_[group.bodies[0]]->is_carried())
        return bodies_[group.bodies[0]]->advance_deformation(context, report);
    GroupStep& step = group_step_;
    find_memory_of(group.contacts, contact_memory_, step.memory);
    step.pulls.clear();
    step.limits.clear();
    step.inputs.clear();
    step.pull_forces.clear();
    for (std::uint32_t k = 0; k < group.bodies.size(); ++k) {
        Body& body = *bodies_[group.bodies[k]];
        body.add_pulls(context, k, step.pulls, step.limits);
        step.inputs.push_back(body.begin_step(context));
    }
    const ContactInput contacts{group.contacts, step.pulls, step.limits, &step.memory, &step.pull_forces};
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
    next_memory_.insert(next_memory_.end(), step.memory.begin(), step.memory.end());
    std::size_t number = 0;
    for (const std::size_t b : group.bodies) {
        std::size_t first = 0;
        for (std::size_t before = 0; before < b; ++before) first += bodies_[before]->handles().size();
        for (std::size_t h = 0; h < bodies_[b]->handles().size(); ++h, ++number)
            if (number < step.pull_forces.size()) report.handle_forces[first + h] = step.pull_forces[number];
    }
}

// Implicit steps: one solve for all.
void World::step_together(const ContactGroup& group, const ContactInput& contacts, const StepContext& context,
                          StepReport& report) {
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
        body.solver().mend(body.phyxels(), body.neighbourhoods(), body.settings().material, step.inputs[k],
                           contacts, k, context.solver, step.members[k].report, context.parallel);
        body.solver().end(body.phyxels(), step.members[k].report);
        body.end_step(context, step.members[k].report, report);
    }
}

// Explicit steps: each body with what touches it alone, then once, by impulses, the contacts
// between bodies.
void World::step_apart(const ContactGroup& group, const ContactInput& contacts, const StepContext& context,
                       StepReport& report) {
    std::vector<meshless::Contact> between;
    std::vector<ContactMemory> next;
    std::vector<Vec3> forces;
    std::vector<meshless::SolverReport> solved;
    std::vector<meshless::StepInput> inputs;
    for (std::uint32_t k = 0; k < group.bodies.size(); ++k) {
        Body& body = *bodies_[group.bodies[k]];
        std::vector<meshless::Contact> own;
        for (meshless::Contact c : contacts.contacts) {
            const bool mine = c.upper.part == k && (c.lower.is_collider() || c.lower.part == k);
            if (!mine && c.upper.part == k) between.push_back(c);
            c.upper.part = c.lower.part = 0;
            if (mine) own.push_back(c);
        }
        std::vector<meshless::Pull> pulls;
        std::vector<double> limits;
        body.add_pulls(context, 0, pulls, limits);
        std::vector<ContactMemory> memory;
        find_memory_of(own, *contacts.memory, memory);
        std::vector<Vec3> pulled;
        inputs.push_back(body.begin_step(context));
        inputs[k].contacts = {own, pulls, limits, &memory, &pulled};
        solved.push_back(body.solver().step(body.phyxels(), body.neighbourhoods(), body.settings().material,
                                            inputs[k], context.solver, context.parallel));
        next.insert(next.end(), memory.begin(), memory.end());
        forces.insert(forces.end(), pulled.begin(), pulled.end());
    }
    *contacts.pull_forces = forces;
    push_between(group, between, inputs, context, next);
    *contacts.memory = next;
    for (std::size_t k = 0; k < group.bodies.size(); ++k)
        bodies_[group.bodies[k]]->end_step(context, solved[k], report);
}

void World::push_between(const ContactGroup& group, std::vector<meshless::Contact>& between,
                         std::span<const meshless::StepInput> inputs, const StepContext& context,
                         std::vector<ContactMemory>& next) {
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
    std::vector<ContactMemory> memory;
    ContactInput input;
    input.contacts = between;
    input.memory = &memory;
    impulses.begin(input, parts, context.dt);
    impulses.put_apart(position, 1);
    impulses.stop(velocity);
    impulses.finish(touching);
    next.insert(next.end(), memory.begin(), memory.end());
}

}  // namespace splitcubes::body
