// Integration of bodies, alone or in islands of bodies in contact.
#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/restitution.h>
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

HitTask World::hit_task(std::span<const BodyView> views) const {
    return {views,
            contact_islands_,
            cached_contacts_,
            settings_.gravity,
            settings_.time_step,
            settings_.contact.restitution.value_or(0)};
}

void World::begin_hits(std::span<const BodyView> views) {
    if (settings_.contact.restitution)
        restitution_->begin(hit_task(views), *parallel_);
    else
        restitution_->clear();
}

void World::finish_hits(StepReport& report) {
    if (!settings_.contact.restitution) return;
    const std::vector<BodyView> views = views_of(bodies_);  // with what constraints hold in this step
    const Restitution::Outcome changed = restitution_->finish(hit_task(views), *parallel_);
    report.totals.kinetic_energy += changed.kinetic_energy;
    report.totals.contact_energy += changed.held_energy;
    report.totals.momentum += changed.momentum;
    report.totals.angular_momentum += changed.angular_momentum;
}

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
    if (settings_.contact.restitution)
        for (const meshless::HandleSpring& spring : step.handle_springs) {
            const std::size_t body = island.bodies[spring.part];
            restitution_->leave_out(body, bodies_[body]->phyxels().piece[spring.phyxel]);
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
    } else {
        step_together(island, contacts, context, report);
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

void World::step_together(const ContactIsland& island, const ContactInput& contacts,
                          const StepContext& context, StepReport& report) {
    IslandStep& step = *island_step_;
    step.members.clear();
    for (std::size_t k = 0; k < island.bodies.size(); ++k) {
        Body& body = *bodies_[island.bodies[k]];
        step.inputs[k] = body.solver().begin(body.phyxels(), body.settings().material, step.inputs[k]);
        step.members.push_back(
            {body.solver(), body.phyxels(), body.neighbourhoods(), body.settings().material, step.inputs[k]});
    }
    meshless::TimeIntegrator::step_together(step.members, contacts, context.solver, context.parallel);
    for (std::uint32_t k = 0; k < island.bodies.size(); ++k) {
        Body& body = *bodies_[island.bodies[k]];
        body.solver().end(body.phyxels(), step.members[k].report);
        body.end_step(context, step.members[k].report, report);
    }
}

}  // namespace splitcubes::body
