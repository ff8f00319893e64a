// Frames that follow the material of a body.
#include <splitcubes/core/random.h>
#include <splitcubes/scene/material_frame.h>

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace splitcubes::scene {
namespace {

// A body's samples, as arrays that the test changes.
struct Cloud {
    std::vector<Vec3> rest, position, velocity;
    std::vector<double> mass;
    std::vector<std::int32_t> piece;

    void add(const Vec3& p, double kilograms = 1) {
        rest.push_back(p);
        position.push_back(p);
        velocity.push_back(Vec3::Zero());
        mass.push_back(kilograms);
        piece.push_back(0);
    }
    BodySamples samples() const { return {rest, position, velocity, mass, piece, 1}; }
    void move(std::size_t i, const Isometry& motion) { position[i] = motion * rest[i]; }
};

Isometry random_motion(Random& random) {
    const auto number = [&] { return random.uniform(-1, 1); };
    Isometry out = Isometry::Identity();
    out.linear() =
        Eigen::AngleAxisd(3 * number(), Vec3(number(), number(), 1.1).normalized()).toRotationMatrix();
    out.translation() = Vec3(number(), number(), number());
    return out;
}

Cloud random_cloud(Random& random, int count) {
    Cloud out;
    for (int k = 0; k < count; ++k)
        out.add(Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)),
                random.uniform(0.5, 2));
    return out;
}

double motion_distance(const Isometry& a, const Isometry& b) {
    return (a.matrix() - b.matrix()).norm();
}

TEST(MaterialFrame, TakesARigidMotionAsItIs) {
    Random random(3);
    for (int k = 0; k < 50; ++k) {
        Cloud cloud = random_cloud(random, 4 + k);
        const MaterialFrame frame({}, cloud.samples());
        const Isometry motion = random_motion(random);
        for (std::size_t i = 0; i < cloud.rest.size(); ++i) cloud.move(i, motion);
        EXPECT_LT(motion_distance(frame.fit(cloud.samples(), 0, Isometry::Identity()), motion), 1e-10);
    }
}

TEST(MaterialFrame, MovesWithTheBodyWhateverItsShape) {
    Random random(4);
    Cloud cloud = random_cloud(random, 30);
    const MaterialFrame frame({}, cloud.samples());
    for (Vec3& p : cloud.position)
        p += 0.2 * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const Isometry before = frame.fit(cloud.samples(), 0, Isometry::Identity());
    const Isometry motion = random_motion(random);
    for (Vec3& p : cloud.position) p = motion * p;
    EXPECT_LT(motion_distance(frame.fit(cloud.samples(), 0, Isometry::Identity()), motion * before), 1e-9);
}

TEST(MaterialFrame, LooksAheadAtTheVelocitiesOfTheSamples) {
    Random random(5);
    Cloud cloud = random_cloud(random, 20);
    const MaterialFrame frame({}, cloud.samples());
    for (Vec3& v : cloud.velocity) v = Vec3(1, -2, 3);
    const Isometry ahead = frame.fit(cloud.samples(), 0.1, Isometry::Identity());
    EXPECT_LT((ahead.translation() - Vec3(0.1, -0.2, 0.3)).norm(), 1e-12);
    EXPECT_LT((ahead.linear() - Mat3::Identity()).norm(), 1e-12);
}

TEST(MaterialFrame, StaysWithThePartThatHoldsItsMiddle) {
    Cloud cloud;
    for (int k = 0; k < 10; ++k)
        for (int j = 0; j < 4; ++j) cloud.add(Vec3(k, j % 2, j / 2));
    const auto region = [](const Vec3& p) { return p.x() < 6.5; };
    const MaterialFrame frame(region, cloud.samples());
    // What lies beyond x = 4.5 comes off and flies away; so does all that is outside of the region.
    Random random(6);
    const Isometry stays = random_motion(random), goes = random_motion(random);
    for (std::size_t i = 0; i < cloud.rest.size(); ++i) {
        cloud.piece[i] = cloud.rest[i].x() < 4.5 ? 1 : 0;
        cloud.move(i, cloud.piece[i] == 1 ? stays : goes);
    }
    EXPECT_LT(motion_distance(frame.fit(cloud.samples(), 0, Isometry::Identity()), stays), 1e-10);
}

TEST(MaterialFrame, IsARotationWhateverIsLeftOfTheRegion) {
    Random random(7);
    for (const int count : {1, 2, 3}) {
        Cloud cloud;
        for (int k = 0; k < count; ++k) cloud.add(Vec3(0.3 * k, 0.1, 0.2));  // a line
        const MaterialFrame frame({}, cloud.samples());
        const Isometry motion = random_motion(random);
        for (std::size_t i = 0; i < cloud.rest.size(); ++i) cloud.move(i, motion);
        const Isometry found = frame.fit(cloud.samples(), 0, motion);
        EXPECT_LT(motion_distance(found, motion), 1e-9) << "what is not determined is as it was last";
        cloud.position.assign(cloud.position.size(), Vec3(1, 2, 3));  // all in one point
        EXPECT_TRUE(frame.fit(cloud.samples(), 0, motion).matrix().allFinite());
        cloud.position[0].x() = std::numeric_limits<double>::quiet_NaN();
        EXPECT_EQ(frame.fit(cloud.samples(), 0, motion).matrix(), motion.matrix());
    }
    const Cloud none;
    EXPECT_FALSE(MaterialFrame({}, none.samples()).has_samples());
    EXPECT_EQ(MaterialFrame({}, none.samples()).fit(none.samples(), 0, Isometry::Identity()).matrix(),
              Isometry::Identity().matrix());
}

}  // namespace
}  // namespace splitcubes::scene
