// Rigid fragments in contact with surfaces, each other and colliders.
#include "body/rubber.h"

#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {
namespace {

using fixtures::box_at;
using fixtures::rubber;

// Components in -1..1.
Vec3 random_vector(Random& random) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    return {x, y, random.uniform(-1, 1)};
}

World make_fragment_world(bool pieces, const Vec3& gravity) {
    WorldSettings settings;
    settings.gravity = gravity;
    settings.contact.pieces = pieces;
    settings.contact.friction = 0.6;
    settings.validate_each_step = false;
    return {settings, std::make_shared<const Parallel>(2)};
}

// Cuts the top of the block off in columns: pieces of two cells a side, which are rigid.
void cut_fragments(World& world, Body& body, double top, int count) {
    geometry::TriangleMesh level = geometry::make_plane_sheet({0, 0, top}, Vec3::UnitZ(), 0.3);
    std::int32_t cut_id = 0;
    for (int k = 0; k < count; ++k)
        for (int axis = 0; axis < 2; ++axis) {
            // Vertical sheets that end at the horizontal cut.
            const double at = (k - 0.5 * (count - 1)) * 0.0205 + 0.0002;
            geometry::TriangleMesh wall;
            for (const Vec2& p :
                 {Vec2(-0.3, top - 0.001), Vec2(0.3, top - 0.001), Vec2(0.3, 0.3), Vec2(-0.3, 0.3)})
                wall.positions.push_back(axis == 0 ? Vec3(at, p.x(), p.y()) : Vec3(p.x(), at, p.y()));
            wall.triangles = {{0, 1, 2}, {0, 2, 3}};
            body.cut_with_sheet(wall, cut_id++, world.parallel());
        }
    body.cut_with_sheet(level, cut_id, world.parallel());
}

double lowest_fragment(const Body& body) {
    double out = 1e300;
    for (const meshless::RigidPiece& piece : body.phyxels().rigid.bodies)
        out = std::min(out, piece.centre.z());
    return out;
}

TEST(RigidContacts, FragmentsRestOnTheBodyTheyWereCutFrom) {
    for (const bool pieces : {false, true}) {
        World world = make_fragment_world(pieces, Vec3(0, 0, -9.81));
        Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.08, 0.08)), rubber(0.02));
        HoldConstraint foot;
        foot.region = [](const Vec3& rest) { return rest.z() < -0.03; };
        foot.motion = [](double) { return Isometry::Identity(); };
        body.add_constraint(foot);
        cut_fragments(world, body, 0.0204, 4);
        ASSERT_GT(body.phyxels().rigid.bodies.size(), 8U);
        const double before = lowest_fragment(body);
        // Fragments at the rim may slide off.
        std::vector<std::int32_t> inner;
        for (const meshless::RigidPiece& piece : body.phyxels().rigid.bodies)
            if (piece.centre.head<2>().cwiseAbs().maxCoeff() < 0.025) inner.push_back(piece.piece);
        ASSERT_GT(inner.size(), 3U);
        StepReport report;
        for (int step = 0; step < 90; ++step) report = world.step();
        if (pieces) {
            for (const std::int32_t piece_id : inner) {
                const meshless::RigidPiece& piece =
                    body.phyxels()
                        .rigid.bodies[static_cast<std::size_t>(body.phyxels().rigid.index(piece_id))];
                EXPECT_GT(piece.centre.z(), before - 0.003) << "it rests";
                EXPECT_LT(piece.velocity().norm(), 0.02) << "m/s";
            }
        } else {
            EXPECT_LT(lowest_fragment(body), before - 0.5) << "they fall through";
        }
    }
}

// The body yields under what lies on it, and no energy is left that could pay for lifting it.
TEST(RigidContacts, FragmentsDoNotSinkIntoASoftBody) {
    WorldSettings settings;
    settings.time_step = 1.0 / 60;
    settings.contact.pieces = true;
    settings.contact.friction = 0.6;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.06, 0.6};
    settings.validate_each_step = false;
    World world(settings, std::make_shared<const Parallel>(2));
    Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.08, 0.08)), rubber(0.02, 1e4));
    cut_fragments(world, body, 0.0204, 4);
    for (int step = 0; step < 30; ++step) world.step();
    const std::vector<meshless::RigidPiece> before = body.phyxels().rigid.bodies;
    for (int step = 0; step < 60; ++step) world.step();
    int resting = 0;
    for (std::size_t k = 0; k < before.size(); ++k) {
        const meshless::RigidPiece& now = body.phyxels().rigid.bodies[k];
        // Those beside the edge may slide off.
        if (before[k].centre.head<2>().cwiseAbs().maxCoeff() > 0.02) continue;
        EXPECT_GT(now.centre.z(), before[k].centre.z() - 0.0006);
        ++resting;
    }
    EXPECT_GE(resting, 4);
}

TEST(RigidContacts, AHeapOfFragmentsRestsOnTheGround) {
    WorldSettings settings;
    settings.contact.pieces = true;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.6};
    settings.validate_each_step = false;
    World world(settings, std::make_shared<const Parallel>(2));
    Body& body = world.add_body(box_at(Vec3(0.04, 0.04, 0.12), Vec3(0, 0, 0.0605)), rubber(0.02));
    std::int32_t cut_id = 0;
    for (int k = 1; k < 5; ++k)
        body.cut_with_sheet(geometry::make_plane_sheet({0, 0, 0.024 * k + 0.0003}, Vec3::UnitZ(), 0.2),
                            cut_id++, world.parallel());
    body.cut_with_sheet(geometry::make_plane_sheet({0.0003, 0, 0}, Vec3::UnitX(), 0.3), cut_id++,
                        world.parallel());
    body.cut_with_sheet(geometry::make_plane_sheet({0, 0.0003, 0}, Vec3::UnitY(), 0.3), cut_id++,
                        world.parallel());
    const std::size_t count = body.phyxels().rigid.bodies.size();
    ASSERT_GE(count, 12U);
    double energy = 1e300, first = 0;
    StepReport report;
    for (int step = 0; step < 240; ++step) {
        report = world.step();
        double now = report.totals.kinetic_energy + report.totals.elastic_energy;
        for (std::size_t i = 0; i < body.phyxels().size(); ++i)
            now += 9.81 * body.phyxels().mass[i] * body.phyxels().position[i].z();
        if (step == 0) first = now;
        EXPECT_LT(now, energy + 3e-3 * first) << "step " << step;
        energy = std::min(energy, now);
    }
    EXPECT_LT(report.totals.kinetic_energy, 1e-5);
    // Pieces of 2 cm, stacked five high.
    const std::vector<meshless::RigidPiece>& pieces = body.phyxels().rigid.bodies;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
        EXPECT_GT(pieces[k].centre.z(), 0.004) << "above the ground";
        for (std::size_t other = 0; other < k; ++other)
            EXPECT_GT((pieces[k].centre - pieces[other].centre).norm(), 0.012) << "not in each other";
    }
}

TEST(RigidContacts, FragmentsThatHitABodyConserveMomenta) {
    World world = make_fragment_world(true, Vec3::Zero());
    Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.08, 0.08)), rubber(0.02));
    cut_fragments(world, body, 0.0204, 4);
    ASSERT_GT(body.phyxels().rigid.bodies.size(), 8U);
    // All are thrown back at the body, on different paths.
    double speed = 0.8;
    for (meshless::RigidPiece& piece : body.phyxels().rigid.bodies) {
        piece.centre.z() += 0.03;
        piece.momentum = piece.mass * Vec3(0.1, speed - 0.9, -speed);
        piece.angular_momentum = piece.rotation * piece.inertia * Vec3(1, 5, 2);
        speed += 0.03;
    }
    meshless::write_phyxels(body.phyxels());
    const auto sums = [&] {
        std::vector<meshless::Momenta> pieces;
        meshless::momenta_of_pieces(body.phyxels(), static_cast<int>(body.pieces().count()), pieces);
        meshless::Momenta all;
        for (const meshless::Momenta& one : pieces) {
            all.linear += one.linear;
            all.angular_momentum += one.angular();
        }
        return all;
    };
    const meshless::Momenta before = sums();
    double energy = 1e300;
    std::size_t contacts = 0;
    for (int step = 0; step < 40; ++step) {
        const StepReport report = world.step();
        contacts = std::max(contacts, report.counts.contacts);
        const double now = report.totals.kinetic_energy + report.totals.elastic_energy;
        EXPECT_LT(now, energy * (1 + 1e-3)) << "step " << step;
        energy = std::min(energy, now);
    }
    EXPECT_GT(contacts, 3U);
    const meshless::Momenta after = sums();
    EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * before.linear.norm());
    EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(),
              1e-9 * before.angular_momentum.norm());
}

// A block in random pieces drops by five millimetres. Boxes around fragments overlap where the cuts left
// none, and the ground stops some while others fall: what is lifted out of each other costs energy.
TEST(RigidContacts, RandomPiecesThatDropHardlyGainEnergy) {
    int gained = 0;
    for (std::uint64_t seed = 15; seed <= 26; ++seed) {
        const double rate = seed % 4 == 0 ? 500 : 60;  // 1/s, of steps
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        WorldSettings settings;
        settings.time_step = 1 / rate;
        settings.contact.pieces = true;
        settings.contact.friction = 0.4;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.045, 0.4};
        settings.validate_each_step = false;
        World world(settings, std::make_shared<const Parallel>(2));
        Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.08, 0.08)), rubber(0.02));
        Random random(seed);
        for (std::int32_t cut = 0; cut < 9; ++cut) {
            const Vec3 point = 0.02 * random_vector(random);
            body.cut_with_sheet(geometry::make_plane_sheet(point, random_vector(random), 0.3), cut,
                                world.parallel());
        }
        ASSERT_GT(body.phyxels().rigid.bodies.size(), 50U);
        double lowest = 1e300, weight = 0, rise = 0;
        for (int step = 0; step < std::min(0.4 * rate, 60.0); ++step) {
            const StepReport report = world.step();
            const meshless::Momenta all = meshless::total_momenta(body.phyxels());
            weight = 9.81 * all.mass;
            const double now = report.totals.kinetic_energy + report.totals.elastic_energy +
                               report.totals.contact_energy + weight * all.centre.z();
            rise = std::max(rise, now - lowest);
            lowest = std::min(lowest, now);
        }
        gained += rise > 0.02 * weight * 0.005;
        EXPECT_LT(rise, 0.06 * weight * 0.005);
        EXPECT_LT(lowest, -0.002 * weight) << "they have dropped";
    }
    EXPECT_LE(gained, 2) << "of 12";
}

// Cuts a piece of two cells a side out of the middle.
void cut_core(World& world, Body& body) {
    constexpr double low = -0.01005, high = 0.01045;
    std::int32_t cut_id = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (const double at : {low, high}) {
            geometry::TriangleMesh wall;
            for (const Vec2& p : {Vec2(low, low), Vec2(high, low), Vec2(high, high), Vec2(low, high)}) {
                Vec3 point;
                point[axis] = at;
                point[(axis + 1) % 3] = p.x() + (p.x() > 0 ? 0.001 : -0.001);
                point[(axis + 2) % 3] = p.y() + (p.y() > 0 ? 0.001 : -0.001);
                wall.positions.push_back(point);
            }
            wall.triangles = {{0, 1, 2}, {0, 2, 3}};
            body.cut_with_sheet(wall, cut_id++, world.parallel());
        }
}

// Impulses on whole pieces cannot stop a surface from closing on a fragment that it encloses: the fragment
// must not be thrown out.
// Results depend on relative motion only, and so does the number of contacts that are listed.
TEST(RigidContacts, FragmentsThatFlyTogetherMeetAsAtRest) {
    const auto listed_at = [](const Vec3& common, std::vector<Vec3>& centres) {
        World world = make_fragment_world(true, Vec3::Zero());
        Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.08, 0.08)), rubber(0.02));
        cut_fragments(world, body, 0.0204, 4);
        meshless::Phyxels& phyxels = body.phyxels();
        Random random(7);
        for (meshless::RigidPiece& piece : phyxels.rigid.bodies) {
            piece.momentum = piece.mass * (common + 0.3 * random_vector(random));
            piece.angular_momentum = 1e-6 * random_vector(random);
        }
        for (Vec3& velocity : phyxels.velocity) velocity = common;
        const std::vector<BodyView> bodies = views_of(world.bodies());
        ContactFinder finder;
        std::vector<ContactIsland> islands;
        const double dt = 1.0 / 60;
        finder.find({bodies, {}, world.settings().contact, 0, dt, Vec3::Zero()}, world.parallel(), islands);
        RigidContacts contacts;
        const RigidContacts::Task task{bodies, {}, 0.6, dt, Vec3::Zero()};
        contacts.find(task, finder, islands, world.parallel());
        for (meshless::RigidPiece& piece : phyxels.rigid.bodies) piece.centre += dt * piece.velocity();
        for (Vec3& position : phyxels.position) position += dt * common;
        contacts.push(task, world.parallel());
        for (const meshless::RigidPiece& piece : phyxels.rigid.bodies)
            centres.push_back(piece.centre - dt * common);
        return contacts.listed();
    };
    std::vector<Vec3> resting, flying;
    const std::size_t at_rest = listed_at(Vec3::Zero(), resting);
    const std::size_t in_flight = listed_at(Vec3(12, -5, 20), flying);
    EXPECT_GT(at_rest, 10U);
    EXPECT_LE(in_flight, at_rest + at_rest / 50);
    ASSERT_EQ(flying.size(), resting.size());
    for (std::size_t k = 0; k < resting.size(); ++k)
        ASSERT_LT((flying[k] - resting[k]).norm(), 1e-7) << "fragment " << k;
}

TEST(RigidContacts, AClosingSurfaceDoesNotThrowTheFragmentItEncloses) {
    World world = make_fragment_world(true, Vec3::Zero());
    Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.08, 0.08)), rubber(0.02));
    cut_core(world, body);
    ASSERT_EQ(body.phyxels().rigid.bodies.size(), 1U);
    meshless::Phyxels& phyxels = body.phyxels();
    const std::int32_t core = phyxels.rigid.bodies[0].piece;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (phyxels.piece[i] != core) phyxels.velocity[i] = -8.0 * phyxels.position[i];
    double energy = 1e300, first = 0;
    std::size_t contacts = 0;
    for (int step = 0; step < 60; ++step) {
        const StepReport report = world.step();
        contacts = std::max(contacts, report.counts.contacts);
        const double now = report.totals.kinetic_energy + report.totals.elastic_energy;
        if (step == 0) first = now;
        EXPECT_LT(now, energy + 1e-3 * first) << "step " << step;
        energy = std::min(energy, now);
        const meshless::RigidPiece& piece = phyxels.rigid.bodies[0];
        EXPECT_LT(piece.centre.norm(), 0.004) << "step " << step;
        EXPECT_LT(piece.velocity().norm(), 0.1) << "m/s, step " << step;
    }
    EXPECT_GT(contacts, 5U);
}

TEST(RigidContacts, ThreadsDoNotMatter) {
    std::string first;
    for (const int threads : {1, 3}) {
        WorldSettings settings;
        settings.contact.pieces = true;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.6};
        settings.validate_each_step = false;
        World world(settings, std::make_shared<const Parallel>(threads));
        Body& body = world.add_body(box_at(Vec3(0.08, 0.08, 0.08), Vec3(0, 0, 0.06)), rubber(0.02));
        cut_fragments(world, body, 0.0804, 4);
        for (int step = 0; step < 30; ++step) world.step();
        const std::string hash = world.state_hash().text();
        if (first.empty()) first = hash;
        EXPECT_EQ(hash, first);
    }
}

}  // namespace
}  // namespace splitcubes::body
