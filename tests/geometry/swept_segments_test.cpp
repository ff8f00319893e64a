#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/swept_segments.h>

#include <cmath>
#include <limits>
#include <vector>

using namespace splitcubes;
using namespace splitcubes::geometry;

namespace {

using Real = long double;
using RealVec = Eigen::Matrix<Real, 3, 1>;

Vec3 random_vector_within(Random& random, double size) {
    return size * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

MovingSegment random_segment(Random& random, double motion) {
    const Vec3 a = random_vector_within(random, 1), b = random_vector_within(random, 1);
    return {a, b, a + random_vector_within(random, motion), b + random_vector_within(random, motion)};
}

RealVec at(const Vec3& start, const Vec3& end, Real t) {
    return (1 - t) * start.cast<Real>() + t * end.cast<Real>();
}

struct Directions {
    RealVec u, v, w;
};

Directions directions(const MovingSegment& blade, const MovingSegment& edge, Real t) {
    const RealVec a = at(blade.a0, blade.a1, t), c = at(edge.a0, edge.a1, t);
    return {at(blade.b0, blade.b1, t) - a, at(edge.b0, edge.b1, t) - c, c - a};
}

Real coplanarity(const MovingSegment& blade, const MovingSegment& edge, Real t) {
    const Directions d = directions(blade, edge, t);
    return d.u.cross(d.v).dot(d.w);
}

// Returns the distance between the two points of a hit.
double gap(const MovingSegment& blade, const MovingSegment& edge, const SegmentHit& hit) {
    const Directions d = directions(blade, edge, hit.time);
    return static_cast<double>((hit.blade_parameter * d.u - hit.edge_parameter * d.v - d.w).norm());
}

struct SlowHit {
    bool any = false;
    double time = 0, blade = 0, edge = 0;
    int roots_before = 0;
};

// Finds sign changes at many sampled times and refines them by bisection. Parameters must lie in
// [margin, 1 - margin].
SlowHit slow_first_hit(const MovingSegment& blade, const MovingSegment& edge, double margin) {
    constexpr int samples = 250;
    SlowHit out;
    Real before = coplanarity(blade, edge, 0);
    for (int k = 1; k <= samples; ++k) {
        const Real value = coplanarity(blade, edge, Real(k) / samples);
        if ((before < 0) != (value < 0)) {
            Real low = Real(k - 1) / samples, high = Real(k) / samples;
            for (int i = 0; i < 60; ++i) {
                const Real middle = (low + high) / 2;
                ((coplanarity(blade, edge, middle) < 0) == (before < 0) ? low : high) = middle;
            }
            const Directions d = directions(blade, edge, low);
            const RealVec n = d.u.cross(d.v);
            const auto s = static_cast<double>(d.w.cross(d.v).dot(n) / n.squaredNorm());
            const auto r = static_cast<double>(d.w.cross(d.u).dot(n) / n.squaredNorm());
            if (std::min(s, r) >= margin && std::max(s, r) <= 1 - margin) {
                out.any = true;
                out.time = static_cast<double>(low);
                out.blade = s;
                out.edge = r;
                return out;
            }
            ++out.roots_before;
        }
        before = value;
    }
    return out;
}

template <class Map>
MovingSegment mapped(const MovingSegment& s, const Map& map) {
    return {map(s.a0), map(s.b0), map(s.a1), map(s.b1)};
}

}  // namespace

TEST(SweptSegments, AgreeWithDenseSamplingInTime) {
    Random random(1);
    int hits = 0, misses = 0, late_roots = 0;
    for (int trial = 0; trial < 2500; ++trial) {
        const double motion = std::pow(10.0, random.uniform(-2, 1));
        const MovingSegment blade = random_segment(random, motion), edge = random_segment(random, motion);
        const auto hit = first_hit(blade, edge);
        if (hit) {
            EXPECT_LT(gap(blade, edge, *hit), 1e-6);
            EXPECT_GE(hit->time, 0);
            EXPECT_LE(hit->time, 1);
            EXPECT_GE(hit->blade_parameter, 0);
            EXPECT_LE(hit->blade_parameter, 1);
            EXPECT_GE(hit->edge_parameter, 0);
            EXPECT_LE(hit->edge_parameter, 1);
        }
        const SlowHit slow = slow_first_hit(blade, edge, 0);
        ASSERT_TRUE(hit || !slow.any) << "missed hit at " << slow.time;
        if (!slow.any) {
            // Sampling may only miss a pair of close roots.
            misses += !hit;
            continue;
        }
        ++hits;
        late_roots += slow.roots_before > 0;
        ASSERT_LE(hit->time, slow.time + 1e-9);
        if (hit->time > slow.time - 1e-6) {
            EXPECT_NEAR(hit->edge_parameter, slow.edge, 1e-4);
            EXPECT_NEAR(hit->blade_parameter, slow.blade, 1e-4);
        }
    }
    EXPECT_GT(hits, 120);
    EXPECT_GT(misses, 500);
    EXPECT_GT(late_roots, 10);  // the first coplanar time is often not the hit
}

TEST(SweptSegments, NoHitWithoutOneByDenseSampling) {
    Random random(2);
    int extra = 0, misses = 0;
    for (int trial = 0; trial < 1200; ++trial) {
        const MovingSegment blade = random_segment(random, 1), edge = random_segment(random, 1);
        if (slow_first_hit(blade, edge, -1e-4).any) continue;
        ++misses;
        extra += first_hit(blade, edge).has_value();
    }
    EXPECT_GT(misses, 800);
    EXPECT_LE(extra, misses / 200);  // pairs of roots between two samples
}

TEST(SweptSegments, KnownHits) {
    // A resting edge along z from -1 to 1, a blade along y that moves along x.
    const MovingSegment edge{{0, 0, -1}, {0, 0, 1}, {0, 0, -1}, {0, 0, 1}};
    const MovingSegment blade{{-1, -1, 0.5}, {-1, 3, 0.5}, {3, -1, 0.5}, {3, 3, 0.5}};
    const auto hit = first_hit(blade, edge);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->time, 0.25, 1e-15);
    EXPECT_NEAR(hit->blade_parameter, 0.25, 1e-15);
    EXPECT_NEAR(hit->edge_parameter, 0.75, 1e-15);

    // The same with a moving edge, and with both moving.
    const Vec3 shift(4, 0, 0);
    const MovingSegment still{blade.a0, blade.b0, blade.a0, blade.b0};
    const MovingSegment moving{edge.a0, edge.b0, edge.a1 - shift, edge.b1 - shift};
    ASSERT_TRUE(first_hit(still, moving));
    EXPECT_NEAR(first_hit(still, moving)->time, 0.25, 1e-15);
    // The blade is too high or too short.
    const Vec3 up(0, 0, 0.6);
    EXPECT_FALSE(first_hit(mapped(blade, [&](const Vec3& p) -> Vec3 { return p + up; }), edge));
    const Vec3 aside(0, 1.001, 0);
    EXPECT_FALSE(first_hit(mapped(blade, [&](const Vec3& p) -> Vec3 { return p + aside; }), edge));
}

TEST(SweptSegments, FinalPositionsAloneWouldMissTheHit) {
    // Both move along x, the edge more slowly, and the blade overtakes it.
    const MovingSegment edge{{1, 0, -1}, {1, 0, 1}, {2, 0, -1}, {2, 0, 1}};
    const MovingSegment blade{{0, -1, 0}, {0, 1, 0}, {4, -1, 0}, {4, 1, 0}};
    const auto hit = first_hit(blade, edge);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->time, 1.0 / 3, 1e-15);
}

// With x = 2t - 1 the blade runs from (1, -x) to (x - 1, x), the edge along z at the
// origin: they are coplanar at x^2 = 0, a double root in the middle of both, which
// rounding may leave without a sign change.
TEST(SweptSegments, GrazingContactsAreHits) {
    Random random(10);
    const MovingSegment edge{{0, 0, -1}, {0, 0, 1}, {0, 0, -1}, {0, 0, 1}};
    const MovingSegment blade{{1, 1, 0}, {-2, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    for (int trial = 0; trial < 500; ++trial) {
        const double size = std::pow(10.0, random.uniform(-6, 7));
        const Quat rotation(
            Eigen::AngleAxisd(random.uniform(0, 6), random_vector_within(random, 1).normalized()));
        const Vec3 shift = random_vector_within(random, 10);
        const auto map = [&](const Vec3& p) -> Vec3 { return size * (rotation * p + shift); };
        const auto hit = first_hit(mapped(blade, map), mapped(edge, map));
        ASSERT_TRUE(hit) << trial;
        EXPECT_NEAR(hit->time, 0.5, 1e-6);
        EXPECT_NEAR(hit->edge_parameter, 0.5, 1e-6);
    }
}

TEST(SweptSegments, CoplanarMotionsAreHitWhereEndsArrive) {
    const auto segment = [](Vec3 a, Vec3 b, Vec3 motion) {
        return MovingSegment{a, b, a + motion, b + motion};
    };
    const Vec3 rest = Vec3::Zero();
    Random random(3);
    for (int trial = 0; trial < 200; ++trial) {
        const Quat rotation = Quat(Eigen::AngleAxisd(trial == 0 ? 0 : random.uniform(0, 6),
                                                     random_vector_within(random, 1).normalized()));
        const double scale = std::pow(10.0, random.uniform(-6, 6));
        const auto hit = [&](const MovingSegment& blade, const MovingSegment& edge) {
            const auto map = [&](const Vec3& p) -> Vec3 { return scale * (rotation * p); };
            const auto one = first_hit(mapped(blade, map), mapped(edge, map));
            const auto other = first_hit(mapped(edge, map), mapped(blade, map));
            EXPECT_EQ(one.has_value(), other.has_value());
            return one;
        };
        const MovingSegment edge = segment({0, 0, 0}, {0, 1, 0}, rest);
        // A blade in the plane of its motion, tip first.
        const auto tip = hit(segment({-3, 0.25, 0}, {-1, 0.25, 0}, {4, 0, 0}), edge);
        ASSERT_TRUE(tip);
        EXPECT_NEAR(tip->time, 0.25, 1e-6);
        EXPECT_NEAR(tip->edge_parameter, 0.25, 1e-6);
        EXPECT_NEAR(tip->blade_parameter, 1, 1e-6);
        EXPECT_FALSE(hit(segment({-3, 1.25, 0}, {-1, 1.25, 0}, {4, 0, 0}), edge));
        // Parallel, arriving from the side; collinear, end to end.
        const auto parallel = hit(segment({-1, 0.5, 0}, {-1, 2, 0}, {2, 0, 0}), edge);
        ASSERT_TRUE(parallel);
        EXPECT_NEAR(parallel->time, 0.5, 1e-6);
        EXPECT_GE(parallel->edge_parameter, 0.5 - 1e-6);
        EXPECT_FALSE(hit(segment({-1, 1.5, 0}, {-1, 2, 0}, {2, 0, 0}), edge));
        EXPECT_FALSE(hit(segment({-1, 0.5, 0.1}, {-1, 2, 0.1}, {2, 0, 0}), edge));
        const auto collinear = hit(segment({0, 3, 0}, {0, 2, 0}, {0, -2, 0}), edge);
        ASSERT_TRUE(collinear);
        EXPECT_NEAR(collinear->time, 0.5, 1e-6);
        EXPECT_NEAR(collinear->edge_parameter, 1, 1e-6);
        EXPECT_FALSE(hit(segment({0, 3, 0}, {0, 2, 0}, {0, -0.9, 0}), edge));
        // Segments at rest, touching or not.
        EXPECT_TRUE(hit(segment({-1, 0.5, 0}, {1, 0.5, 0}, rest), edge));
        EXPECT_FALSE(hit(segment({-1, 0.5, 0.01}, {1, 0.5, 0.01}, rest), edge));
        EXPECT_FALSE(hit(segment({-1, 0.5, 0}, {-0.01, 0.5, 0}, rest), edge));
        // A point that runs into the edge, and past it.
        const auto point = hit(segment({-1, 0.5, 0}, {-1, 0.5, 0}, {2, 0, 0}), edge);
        ASSERT_TRUE(point);
        EXPECT_NEAR(point->time, 0.5, 1e-6);
        EXPECT_FALSE(hit(segment({-1, 0.5, 0.01}, {-1, 0.5, 0.01}, {2, 0, 0}), edge));
    }
}

TEST(SweptSegments, DoNotDependOnScaleOrPosition) {
    Random random(4);
    int hits = 0;
    for (int trial = 0; trial < 800; ++trial) {
        const MovingSegment blade = random_segment(random, 1), edge = random_segment(random, 1);
        const auto hit = first_hit(blade, edge);
        hits += hit.has_value();
        // Ignores ties.
        if (slow_first_hit(blade, edge, -1e-4).any != slow_first_hit(blade, edge, 1e-4).any) continue;
        for (const double scale : {1e-6, 1e-3, 1e7}) {
            const auto map = [&](const Vec3& p) -> Vec3 { return scale * p; };
            const auto scaled = first_hit(mapped(blade, map), mapped(edge, map));
            ASSERT_EQ(hit.has_value(), scaled.has_value());
            if (!hit) continue;
            EXPECT_NEAR(hit->time, scaled->time, 1e-6);
            EXPECT_NEAR(hit->edge_parameter, scaled->edge_parameter, 1e-5);
        }
        const Quat rotation(
            Eigen::AngleAxisd(random.uniform(0, 6), random_vector_within(random, 1).normalized()));
        const Vec3 shift = random_vector_within(random, trial % 2 == 0 ? 10 : 1e5);
        const auto move = [&](const Vec3& p) -> Vec3 { return rotation * p + shift; };
        const auto moved = first_hit(mapped(blade, move), mapped(edge, move));
        ASSERT_EQ(hit.has_value(), moved.has_value());
        if (hit && std::abs(hit->time - moved->time) > 1e-5) ADD_FAILURE() << hit->time << " " << moved->time;
    }
    EXPECT_GT(hits, 40);
}

TEST(SweptSegments, RolesCanBeSwapped) {
    Random random(5);
    for (int trial = 0; trial < 5000; ++trial) {
        const MovingSegment blade = random_segment(random, 1), edge = random_segment(random, 1);
        const auto one = first_hit(blade, edge), other = first_hit(edge, blade);
        ASSERT_EQ(one.has_value(), other.has_value());
        if (!one) continue;
        EXPECT_NEAR(one->time, other->time, 1e-8);
        EXPECT_NEAR(one->edge_parameter, other->blade_parameter, 1e-6);
    }
}

TEST(SweptSegments, RunningTimeBackwardsFindsTheSamePairs) {
    Random random(6);
    for (int trial = 0; trial < 5000; ++trial) {
        const MovingSegment blade = random_segment(random, 1), edge = random_segment(random, 1);
        const auto back = [](const MovingSegment& s) { return MovingSegment{s.a1, s.b1, s.a0, s.b0}; };
        ASSERT_EQ(first_hit(blade, edge).has_value(), first_hit(back(blade), back(edge)).has_value());
    }
}

// A wide polyline swept through a grid crosses every edge on its path, however the
// polyline and the interval are divided, even if its joints, times and path coincide with
// the grid.
TEST(SweptSegments, PolylinesDoNotLeakAtTheirJoints) {
    Random random(7);
    const auto run = [&](bool exact, int line_parts, int time_parts, double size) {
        const Quat rotation =
            exact
                ? Quat::Identity()
                : Quat(Eigen::AngleAxisd(random.uniform(0, 6), random_vector_within(random, 1).normalized()));
        const Vec3 shift = exact ? Vec3::Zero() : random_vector_within(random, 100 * size);
        const double wave = exact ? 0 : 0.3;
        const auto transformed = [&](const Vec3& p) -> Vec3 { return rotation * (size * p) + shift; };
        // The polyline along y moves along x, rotates slightly about z and waves.
        const auto line = [&](int joint, int time) {
            const double s = -4 + 8.0 * joint / line_parts, f = static_cast<double>(time) / time_parts;
            return transformed(
                Vec3(-4 + 8 * f + wave * std::sin(3 * s), s, wave * std::sin(s + 2 * f) + 0.25));
        };
        int missed = 0;
        for (int y = -3; y <= 3; ++y)
            for (int x = -3; x <= 3; ++x) {
                // The edge between two levels; at rest in exact runs, moving in others.
                const Vec3 drift = exact ? Vec3::Zero() : Vec3(0.1, -0.2, 0.05);
                const MovingSegment whole{transformed(Vec3(x, y, -1)), transformed(Vec3(x, y, 1)),
                                          transformed(Vec3(x, y, -1) + drift),
                                          transformed(Vec3(x, y, 1) + drift)};
                bool hit = false;
                for (int t = 0; t < time_parts && !hit; ++t) {
                    const MovingSegment edge = part_of(whole, static_cast<double>(t) / time_parts,
                                                       static_cast<double>(t + 1) / time_parts);
                    for (int j = 0; j < line_parts && !hit; ++j)
                        hit =
                            first_hit({line(j, t), line(j + 1, t), line(j, t + 1), line(j + 1, t + 1)}, edge)
                                .has_value();
                }
                missed += !hit;
            }
        EXPECT_EQ(missed, 0) << line_parts << " x " << time_parts << (exact ? " exact, size " : ", size ")
                             << size;
    };
    for (const double size : {1e-6, 1.0, 1e7})
        for (const int line_parts : {1, 2, 3, 8, 16, 29})
            for (const int time_parts : {1, 2, 7, 8, 16}) {
                run(true, line_parts, time_parts, size);
                for (int trial = 0; trial < 2; ++trial) run(false, line_parts, time_parts, size);
            }
}

// Edges that meet the paths of joints, where both adjacent segments could miss them.
TEST(SweptSegments, EdgesThroughAJointAreHit) {
    Random random(8);
    for (int trial = 0; trial < 10000; ++trial) {
        const double size = std::pow(10.0, random.uniform(-6, 7));
        const double motion = std::pow(10.0, random.uniform(-3, 1.5));
        const Vec3 offset = random_vector_within(random, trial % 2 == 0 ? 0 : 1e3);
        const auto point = [&] { return random_vector_within(random, 1); };
        const Vec3 p = point(), q = point(), r = point();
        const Vec3 dp = point() * motion, dq = point() * motion, dr = point() * motion;
        // The edge's point at parameter c meets the joint q at time t.
        const double t = trial % 5 == 0 ? 1 : random.unit(), c = random.unit();
        const Vec3 meeting = q + t * dq, along = point(), drift = point() * motion;
        const Vec3 a = meeting - c * along - t * drift, b = a + along;
        const auto map = [&](const Vec3& x) -> Vec3 { return size * (x + offset); };
        const MovingSegment edge = mapped(MovingSegment{a, b, a + drift, b + drift}, map);
        const MovingSegment left = mapped(MovingSegment{p, q, p + dp, q + dq}, map);
        const MovingSegment right = mapped(MovingSegment{q, r, q + dq, r + dr}, map);
        const auto one = first_hit(left, edge), other = first_hit(right, edge);
        ASSERT_TRUE(one || other) << trial;
    }
}

TEST(SweptSegments, NotFiniteInputIsNoHit) {
    const MovingSegment good{{-1, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {1, 0, 0}};
    ASSERT_TRUE(first_hit(good, good));
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        for (int corner = 0; corner < 4; ++corner) {
            MovingSegment s = good;
            (corner == 0 ? s.a0 : corner == 1 ? s.b0 : corner == 2 ? s.a1 : s.b1)[corner % 3] = bad;
            EXPECT_FALSE(first_hit(s, good));
            EXPECT_FALSE(first_hit(good, s));
        }
}

TEST(SweptSegments, PartsOfAMotionJoinWithoutAGap) {
    Random random(9);
    const MovingSegment s = random_segment(random, 1);
    const MovingSegment first = part_of(s, 0, 1.0 / 3), second = part_of(s, 1.0 / 3, 1);
    EXPECT_EQ(first.a0, s.a0);
    EXPECT_EQ(first.a1, second.a0);
    EXPECT_EQ(first.b1, second.b0);
    EXPECT_EQ(second.b1, s.b1);
}
