#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/history.h>
#include <splitcubes/api/internal/sample_state.h>
#include <splitcubes/api/internal/session.h>
#include <splitcubes/api/internal/simulation_impl.h>
#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/collider_contact.h>

#include <cstdint>
#include <span>
#include <utility>

namespace splitcubes {

using namespace api;

namespace {

// Of the settings of one body.
template <class Edit>
auto edit_of(BodyId body, const Edit& edit) {
    return [body, edit](const Session& session, Snapshot& now) {
        BodyEntry& entry = now.things.bodies[body];
        body::BodySettings settings = entry.source->settings;
        edit(settings, "body '" + session.body(body).name() + "'");
        entry.source = std::make_shared<const BodySource>(
            BodySource{entry.source->model, std::move(settings), entry.source->transfer});
    };
}

}  // namespace

StepSettings Simulation::step_settings() const {
    return impl().read([](const Session& s) {
        const body::WorldSettings& now = s.world().settings();
        StepSettings out{
            now.time_step, public_vector(now.gravity), {}, now.contact.friction, now.contact.restitution};
        if (now.ground) out.ground_friction = now.ground->friction;
        return out;
    });
}

void Simulation::set_step_settings(const StepSettings& settings) {
    impl().remake([&](const Session& s, Snapshot& now) {
        change_step_settings(now.settings, settings, s.world().step_count());
    });
}

MaterialSettings Simulation::material(BodyId body) const {
    return impl().read([&](const Session& s) { return public_material(s.body(body).settings().material); });
}

void Simulation::set_material(BodyId body, const MaterialSettings& material) {
    impl().remake(edit_of(body, [&](body::BodySettings& settings, const std::string& where) {
        const meshless::Material before = settings.material;
        settings.material = material_of(material, where);
        settings.material.model = before.model;
        settings.material.volume_stiffness = before.volume_stiffness;
        settings.material.zero_energy = before.zero_energy;
    }));
}

std::optional<TearingSettings> Simulation::tearing(BodyId body) const {
    return impl().read([&](const Session& s) -> std::optional<TearingSettings> {
        const auto& tearing = s.body(body).settings().tearing;
        if (!tearing) return {};
        return TearingSettings{tearing->strength, tearing->propagation_ratio};
    });
}

void Simulation::set_tearing(BodyId body, const std::optional<TearingSettings>& tearing) {
    impl().remake(edit_of(body, [&](body::BodySettings& settings, const std::string&) {
        settings.tearing = tear_settings_of(tearing, settings.tearing);
    }));
}

double Simulation::cell_size(BodyId body) const {
    return impl().read([&](const Session& s) { return s.body(body).settings().cell_size; });
}

SampleState Simulation::samples(BodyId body) const {
    return impl().read([&](const Session& s) { return sample_state_of(s.body(body)); });
}

std::vector<SampleLink> Simulation::links(BodyId body) const {
    return impl().read([&](const Session& s) { return sample_links_of(s.body(body)); });
}

// See contact_key.
std::vector<ContactPoint> Simulation::contacts() const {
    return impl().read([](const Session& s) {
        std::vector<ContactPoint> out;
        for (const meshless::CachedContact& contact : s.world().active_contacts()) {
            const auto position = static_cast<std::size_t>(contact.key >> 48);
            const auto index = static_cast<std::uint32_t>(contact.key);
            const body::Body& of = *s.world().bodies()[position];
            const std::span<const Vec3> points = (index & body::phyxel_bit) != 0
                                                     ? std::span<const Vec3>(of.phyxels().position)
                                                     : std::span<const Vec3>(of.vertex_positions());
            const std::size_t point = index & ~body::phyxel_bit;
            if (point < points.size())
                out.push_back({s.things().bodies.id_at(position), public_vector(points[point]),
                               public_vector(contact.force), (contact.key >> 32 & 0xffffU) == 0});
        }
        return out;
    });
}

void Simulation::Impl::remake(const std::function<void(const Session&, Snapshot&)>& edit) {
    write([&](Session& session) {
        Snapshot now = session.snapshot();
        edit(session, now);
        become(Session(now, session.shared_parallel()));
    });
}

void Simulation::Impl::forget_history() {
    run_call(gate_, true, [&] { history_->clear(); });
}

void Simulation::Impl::restore(const Snapshot& kept) {
    run_call(gate_, true, [&] { become(Session(kept, session_->shared_parallel())); });
}

void Simulation::forget_history() {
    impl().forget_history();
}

KeptState Simulation::keep() const {
    KeptState out;
    impl().read([&](const Session& s) { out.state_ = std::make_shared<const Snapshot>(s.snapshot()); });
    return out;
}

void Simulation::restore(const KeptState& kept) {
    if (!kept)
        throw Error(ErrorKind::invalid_argument, "restore: there is no kept state; give one of keep()");
    impl().restore(*static_cast<const Snapshot*>(kept.state_.get()));
}

std::size_t KeptState::bytes() const {
    return state_ ? static_cast<const Snapshot*>(state_.get())->state.size() : 0;
}

}  // namespace splitcubes
