// Impulses between rigid bodies: they keep momenta, add no energy and stay in the cones of friction.
#include <splitcubes/contact/detection/rigid_impulses.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace splitcubes::body {
namespace {

Vec3 vector_in(Random& random, double size) {
    const double x = random.uniform(-size, size), y = random.uniform(-size, size);
    return {x, y, random.uniform(-size, size)};
}

/// Balls in a heap with contacts wherever two are near, and the resting ground as the last mover.
struct Heap {
    std::vector<RigidImpulses::Mover> movers;
    std::vector<Vec3> centres;
    std::vector<Mat3> inertia;
    std::vector<RigidImpulses::Contact> contacts;
};

Heap random_heap(Random& random, int count, double friction) {
    Heap heap;
    for (int k = 0; k < count; ++k) {
        RigidImpulses::Mover mover;
        mover.mobility = std::pow(10, random.uniform(-1, 1));
        const Vec3 axes = Vec3::Constant(1.2) + vector_in(random, 0.5);
        heap.inertia.emplace_back(0.4 / mover.mobility * axes.asDiagonal());
        mover.inverse_inertia = heap.inertia.back().inverse();
        mover.velocity = vector_in(random, 1);
        mover.angular_velocity = vector_in(random, 1);
        heap.movers.push_back(mover);
        heap.centres.push_back(vector_in(random, 1.5) + Vec3(0, 0, 1.5));
    }
    heap.movers.emplace_back();
    const auto add = [&](std::uint32_t upper, std::uint32_t lower, const Vec3& normal, const Vec3& at) {
        RigidImpulses::Contact contact;
        contact.upper = upper;
        contact.lower = lower;
        contact.normal = normal.normalized();
        contact.arm = at - heap.centres[upper];
        if (lower < heap.centres.size()) contact.lower_arm = at - heap.centres[lower];
        contact.friction = friction;
        heap.contacts.push_back(contact);
    };
    for (std::uint32_t a = 0; a < heap.centres.size(); ++a) {
        if (heap.centres[a].z() < 0.8)
            add(a, static_cast<std::uint32_t>(count), Vec3::UnitZ(), heap.centres[a] - Vec3(0, 0, 0.5));
        for (std::uint32_t b = 0; b < a; ++b) {
            const Vec3 apart = heap.centres[a] - heap.centres[b];
            if (apart.norm() < 1.2)
                add(a, b, apart + vector_in(random, 0.1), 0.5 * (heap.centres[a] + heap.centres[b]));
        }
    }
    return heap;
}

double energy_of(const std::vector<RigidImpulses::Mover>& movers, const Heap& heap) {
    double sum = 0;
    for (std::size_t k = 0; k < heap.centres.size(); ++k)
        sum += 0.5 * movers[k].velocity.squaredNorm() / movers[k].mobility +
               0.5 * movers[k].angular_velocity.dot(heap.inertia[k] * movers[k].angular_velocity);
    return sum;
}

TEST(RigidImpulses, RandomHeapsKeepMomentaAndGainNothing) {
    Random random(3);
    for (int trial = 0; trial < 40; ++trial) {
        const double friction = trial % 4 == 0 ? 0 : random.uniform(0, 1);
        const Heap heap = random_heap(random, 12, friction);
        RigidImpulses impulses;
        impulses.reset(heap.movers);
        for (const RigidImpulses::Contact& contact : heap.contacts) impulses.add(contact);
        impulses.solve(13, 13);
        const std::vector<RigidImpulses::Mover>& after = impulses.movers();
        EXPECT_LT(energy_of(after, heap), (1 + 1e-12) * energy_of(heap.movers, heap)) << "trial " << trial;
        EXPECT_TRUE(after.back().velocity.isZero(0)) << "the ground moves";
        Vec3 linear = Vec3::Zero(), angular = Vec3::Zero(), ground = Vec3::Zero(), torque = Vec3::Zero();
        for (std::size_t k = 0; k < heap.centres.size(); ++k) {
            const Vec3 change = (after[k].velocity - heap.movers[k].velocity) / heap.movers[k].mobility;
            linear += change;
            angular += heap.centres[k].cross(change) +
                       heap.inertia[k] * (after[k].angular_velocity - heap.movers[k].angular_velocity);
        }
        for (std::size_t c = 0; c < heap.contacts.size(); ++c) {
            const RigidImpulses::Contact& contact = heap.contacts[c];
            const Vec3 impulse = impulses.impulse(c);
            const double along = contact.normal.dot(impulse);
            EXPECT_GE(along, 0);
            EXPECT_LE((impulse - along * contact.normal).norm(), friction * along + 1e-12);
            if (contact.lower < heap.centres.size()) continue;
            ground += impulse;
            torque += (heap.centres[contact.upper] + contact.arm).cross(impulse);
        }
        EXPECT_LT((linear - ground).norm(), 1e-11) << "trial " << trial;
        EXPECT_LT((angular - torque).norm(), 1e-11) << "trial " << trial;
    }
}

TEST(RigidImpulses, NothingApproachesAfterwards) {
    Random random(4);
    for (int trial = 0; trial < 20; ++trial) {
        const Heap heap = random_heap(random, 8, 0.4);
        RigidImpulses impulses;
        impulses.reset(heap.movers);
        for (const RigidImpulses::Contact& contact : heap.contacts) impulses.add(contact);
        impulses.solve(9, 9);
        for (const RigidImpulses::Contact& contact : heap.contacts) {
            const RigidImpulses::Mover &upper = impulses.movers()[contact.upper],
                                       &lower = impulses.movers()[contact.lower];
            const Vec3 apart = upper.velocity_at(contact.arm) - lower.velocity_at(contact.lower_arm);
            EXPECT_GT(contact.normal.dot(apart), -0.02) << "trial " << trial;
        }
    }
}

// Projected Gauss-Seidel that solves every contact in each of its sweeps.
struct PlainSweeps {
    explicit PlainSweeps(const Heap& of)
        : heap(of),
          movers(of.movers),
          along(of.contacts.size(), 0),
          across(of.contacts.size(), Vec3::Zero()) {}

    static Mat3 mobility(const RigidImpulses::Mover& mover, const Vec3& arm) {
        Mat3 cross;
        cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
        return mover.mobility * Mat3::Identity() - cross * mover.inverse_inertia * cross;
    }

    void solve(std::size_t k) {
        const RigidImpulses::Contact& contact = heap.contacts[k];
        RigidImpulses::Mover &upper = movers[contact.upper], &lower = movers[contact.lower];
        const Mat3 both = mobility(upper, contact.arm) + mobility(lower, contact.lower_arm);
        const double normal_mobility = contact.normal.dot(both * contact.normal);
        const auto velocity = [&] {
            return Vec3(upper.velocity_at(contact.arm) - lower.velocity_at(contact.lower_arm));
        };
        const auto push = [&](const Vec3& impulse) {
            upper.push(contact.arm, impulse);
            lower.push(contact.lower_arm, -impulse);
        };
        const double before = along[k];
        along[k] = std::max(0.0, before - contact.normal.dot(velocity()) / normal_mobility);
        push((along[k] - before) * contact.normal);
        const Vec3 sliding = velocity() - contact.normal * contact.normal.dot(velocity());
        Vec3 friction = across[k] - sliding / (both.trace() - normal_mobility);
        const double limit = contact.friction * along[k];
        if (friction.norm() > limit) friction *= limit / friction.norm();
        push(friction - across[k]);
        across[k] = friction;
    }

    void sweep() {
        for (std::size_t n = 0; n < along.size(); ++n) solve(sweeps % 2 == 0 ? n : along.size() - 1 - n);
        ++sweeps;
    }

    const Heap& heap;
    std::vector<RigidImpulses::Mover> movers;
    std::vector<double> along;  // N s, impulses
    std::vector<Vec3> across;
    int sweeps = 0;
};

TEST(RigidImpulses, ContactsThatAreSkippedWouldChangeNothing) {
    Random random(5);
    for (int trial = 0; trial < 30; ++trial) {
        Heap heap = random_heap(random, 30, trial % 3 == 0 ? 0 : random.uniform(0, 1));
        // Most contacts part.
        for (RigidImpulses::Mover& mover : heap.movers) mover.velocity.z() *= trial % 2 == 0 ? 0.1 : 4;
        RigidImpulses impulses;
        impulses.reset(heap.movers);
        for (const RigidImpulses::Contact& contact : heap.contacts) impulses.add(contact);
        impulses.solve(31, 31);
        PlainSweeps plain(heap);
        double nearest = 1;
        while (plain.sweeps < 200 && nearest > 1e-10) {
            plain.sweep();
            double farthest = 0;
            for (std::size_t k = 0; k < plain.movers.size(); ++k) {
                const RigidImpulses::Mover &one = plain.movers[k], &other = impulses.movers()[k];
                farthest = std::max({farthest, (one.velocity - other.velocity).norm(),
                                     (one.angular_velocity - other.angular_velocity).norm()});
            }
            nearest = std::min(nearest, farthest);
        }
        EXPECT_LT(nearest, 1e-10) << "trial " << trial
                                  << ": no number of plain sweeps gives these velocities";
    }
}

}  // namespace
}  // namespace splitcubes::body
