// Each law is broken by a run that is spoilt in one way, and by no other law's.
#include "hand_made_run.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <set>
#include <utility>

namespace splitcubes::torture {
namespace {

std::set<std::string> broken(const Verdict& verdict) {
    std::set<std::string> out;
    for (const LawText& text : law_texts)
        if (verdict.breaks(text.law)) out.insert(text.name);
    return out;
}

using Names = std::set<std::string>;

TEST(Laws, AreInTheOrderOfTheirNumbers) {
    for (std::size_t k = 0; k < law_count; ++k) EXPECT_EQ(static_cast<std::size_t>(law_texts[k].law), k);
}

TEST(Checker, FreeFallHolds) {
    const Verdict verdict = falling_box().check();
    EXPECT_EQ(broken(verdict), Names{});
    for (const Law law : {Law::complete, Law::closed, Law::manifold, Law::mass, Law::momentum, Law::energy,
                          Law::speed, Law::rest_volume, Law::rest_piece_volume, Law::piece_volume})
        EXPECT_TRUE(verdict.of(law).measured) << text_of(law).name;
    EXPECT_TRUE(falling_box(Vec3::Zero()).check().of(Law::angular_momentum).measured);
}

// Bodies of built-in shapes are written without positions at rest. The law of energy needs no positions at
// rest of one piece.
TEST(Checker, TakesSurfacesWithoutPositionsAtRest) {
    HandMadeRun run = falling_box();
    run.scene["ground"] = {{"height", 0}};
    for (Surface& surface : run.surfaces) surface.rest.clear();
    const Verdict verdict = run.check();
    EXPECT_EQ(broken(verdict), Names{});
    EXPECT_TRUE(verdict.of(Law::energy).measured);
    EXPECT_FALSE(verdict.of(Law::rest_volume).measured);
    for (Surface& surface : run.surfaces) surface.rest.clear();
    run.rows[5]["kinetic_energy"] *= 1.05;
    EXPECT_EQ(broken(run.check()), Names{"energy"});
}

TEST(Checker, FindsAFlippedTriangle) {
    HandMadeRun run = falling_box();
    std::swap(run.surfaces[3].triangles[5][0], run.surfaces[3].triangles[5][1]);
    const Verdict verdict = run.check();
    EXPECT_TRUE(verdict.breaks(Law::closed));
    EXPECT_EQ(verdict.of(Law::closed).frame, 3);
}

TEST(Checker, FindsAMissingTriangle) {
    HandMadeRun run = falling_box();
    run.surfaces[2].triangles.pop_back();
    EXPECT_TRUE(run.check().breaks(Law::closed));
}

TEST(Checker, FindsTwoFansAtAVertex) {
    HandMadeRun run = falling_box();
    for (Surface& surface : run.surfaces) {
        const Vec3 corner = surface.positions[7];
        Surface second = box_surface(corner, corner + Vec3::Constant(0.05));
        append(surface, second);
        for (auto& triangle : surface.triangles)
            for (int& vertex : triangle)
                if (vertex == 8) vertex = 7;  // its lowest corner
    }
    const Verdict verdict = run.check();
    EXPECT_TRUE(verdict.breaks(Law::manifold));
    EXPECT_EQ(verdict.of(Law::manifold).worst, 1);
    EXPECT_FALSE(verdict.breaks(Law::closed));
}

TEST(Checker, FindsAddedMass) {
    HandMadeRun run = falling_box();
    run.rows[4]["mass"] *= 1 + 1e-6;
    EXPECT_EQ(broken(run.check()), Names{"mass"});
}

TEST(Checker, FindsAnImpulseFromNowhere) {
    HandMadeRun run = falling_box();
    for (std::size_t k = 4; k < run.rows.size(); ++k) run.rows[k]["momentum_x"] += 1e-5;
    const Verdict verdict = run.check();
    EXPECT_EQ(broken(verdict), Names{"momentum"});
    EXPECT_EQ(verdict.of(Law::momentum).frame, 5);
}

TEST(Checker, FindsATurnFromNowhere) {
    HandMadeRun run = falling_box(Vec3::Zero());
    for (std::size_t k = 4; k < run.rows.size(); ++k) run.rows[k]["angular_momentum_y"] += 1e-4;
    EXPECT_EQ(broken(run.check()), Names{"angular_momentum"});
}

TEST(Checker, FindsAddedEnergy) {
    for (const char* kind : {"kinetic_energy", "elastic_energy", "contact_energy"}) {
        HandMadeRun run = falling_box();
        run.rows[5][kind] += 0.03 * run.rows[5]["kinetic_energy"];
        const Verdict verdict = run.check();
        EXPECT_EQ(broken(verdict), Names{"energy"}) << kind;
        EXPECT_EQ(verdict.of(Law::energy).frame, 6) << kind;
    }
}

// With the potential energy in the table, energy is exact beside an obstacle, too.
TEST(Checker, KnowsThePotentialEnergyOfGravity) {
    HandMadeRun run = falling_box();
    run.scene["ground"] = {{"height", -5}};
    for (std::size_t k = 0; k < run.rows.size(); ++k)
        run.rows[k]["potential_energy"] = -run.rows[k]["kinetic_energy"];
    EXPECT_EQ(broken(run.check()), Names{});
    for (std::size_t k = 5; k < run.rows.size(); ++k)
        run.rows[k]["potential_energy"] += 0.1 * run.rows[5]["kinetic_energy"];
    const Verdict verdict = run.check();
    EXPECT_EQ(broken(verdict), Names{"energy"});
    EXPECT_EQ(verdict.of(Law::energy).frame, 6);
}

// Work that cannot be told from momentum is what the table lists.
TEST(Checker, CountsTheListedWorkOfHandlesAndOfHoldsBesideObstacles) {
    const auto listed = [](const char* column, double share) {
        HandMadeRun run = falling_box(Vec3::Zero());
        if (std::string(column) == "handle_work")
            run.scene["handles"] = {{{"body", "box"}}};
        else {
            run.scene["ground"] = {{"height", -5}};
            const nlohmann::ordered_json turning = {
                {{"time", 0}, {"position", {0, 0, 0}}},
                {{"time", 10},
                 {"position", {0, 0, 0}},
                 {"rotation", {{"axis", {0, 0, 1}}, {"angle_degrees", 90}}}}};
            run.scene["constraints"] = {{{"body", "box"}, {"kind", "move"}, {"keyframes", turning}}};
        }
        for (std::size_t k = 0; k < run.rows.size(); ++k) {
            run.rows[k]["potential_energy"] = 0;
            run.rows[k][column] = k == 5 ? share * run.rows[5]["kinetic_energy"] : 0;
            if (k >= 5) run.rows[k]["elastic_energy"] += 0.5 * run.rows[5]["kinetic_energy"];
        }
        return broken(run.check());
    };
    for (const char* column : {"handle_work", "hold_work"}) {
        EXPECT_EQ(listed(column, 0.5), Names{}) << column;
        EXPECT_EQ(listed(column, 0.3), Names{"energy"}) << column;
    }
}

TEST(Checker, EnergyThatWasLostDoesNotComeBack) {
    HandMadeRun run = falling_box();
    for (std::size_t k = 2; k < 5; ++k) run.rows[k]["kinetic_energy"] *= 0.5;
    EXPECT_EQ(broken(run.check()), Names{"energy"});
}

TEST(Checker, CountsTheWorkOfASupport) {
    const Verdict verdict = carried_box(5).check();
    EXPECT_EQ(broken(verdict), Names{});
    EXPECT_TRUE(verdict.of(Law::energy).measured);
    HandMadeRun run = carried_box(5);
    for (std::size_t k = 3; k < run.rows.size(); ++k) run.rows[k]["kinetic_energy"] *= 1.3;
    EXPECT_EQ(broken(run.check()), Names{"energy"});
}

TEST(Checker, FindsTooFastAPhyxel) {
    HandMadeRun run = falling_box();
    run.rows[6]["top_speed"] *= 10;
    EXPECT_EQ(broken(run.check()), Names{"speed"});
}

// The box is at a height of 1 m and falls 0.13 m.
TEST(Checker, FindsAVertexInTheGround) {
    HandMadeRun run = falling_box();
    run.scene["ground"] = {{"height", 0.86}};
    EXPECT_EQ(broken(run.check()), Names{});
    run.surfaces[8].positions[1].z() = 0.857;
    EXPECT_EQ(broken(run.check()), Names{"ground"});
}

HandMadeRun above(const nlohmann::ordered_json& collider) {
    HandMadeRun run = falling_box();
    run.scene["colliders"] = nlohmann::ordered_json::array({collider});
    return run;
}

TEST(Checker, FindsAVertexInACollider) {
    using Json = nlohmann::ordered_json;
    // The surface that faces the box is at a height of 0.86 m each time, and then at 0.88 m.
    const Json box = {{"name", "c"},
                      {"shape", {{"box", {{"size", {2, 2, 0.1}}}}}},
                      {"placement", {{"position", {0, 0, 0.81}}}}};
    Json turned = box;
    turned["shape"]["box"]["size"] = {0.1, 2, 2};
    turned["rounding"] = 0.01;
    turned["placement"]["rotation"] = {{"axis", {0, 1, 0}}, {"angle_degrees", 90}};
    const Json ball = {{"name", "c"},
                       {"shape", {{"sphere", {{"radius", 100}}}}},
                       {"placement", {{"position", {0.2, 0.05, -99.14}}}}};
    const Json plane = {{"name", "c"}, {"half_space", {{"point", {5, 0, 0.86}}, {"normal", {0, 0, 2}}}}};
    Json rising = plane;
    rising["half_space"]["point"][2] = 0.76;
    rising["keyframes"] = {{{"time", 0}}, {{"time", 0.16}, {"position", {0, 0, 0.1}}}};
    for (Json collider : {box, turned, ball, plane, rising}) {
        EXPECT_EQ(broken(above(collider).check()), Names{}) << collider;
        for (const char* key : {"placement", "half_space"})
            if (collider.contains(key)) {
                Json& point =
                    collider[key].contains("position") ? collider[key]["position"] : collider[key]["point"];
                point[2] = point[2].get<double>() + 0.02;
            }
        EXPECT_EQ(broken(above(collider).check()), Names{"colliders"}) << collider;
    }
}

TEST(Checker, FindsAChangeOfTheVolumeAtRest) {
    HandMadeRun run = falling_box();
    // Only surfaces with other triangles are measured again.
    for (std::size_t k = 4; k < run.surfaces.size(); ++k) {
        run.surfaces[k].rest[7].z() += 0.003;
        std::swap(run.surfaces[k].triangles[0], run.surfaces[k].triangles[1]);
    }
    EXPECT_EQ(broken(run.check()), Names{"rest_volume"});
}

TEST(Checker, FindsPiecesOfNegativeVolume) {
    HandMadeRun run = falling_box();
    for (Surface& surface : run.surfaces) {
        Surface inverted = box_surface({2, 2, 2}, {2.001, 2.001, 2.001}, 1);
        for (auto& triangle : inverted.triangles) std::swap(triangle[0], triangle[1]);
        append(surface, inverted);
    }
    EXPECT_EQ(broken(run.check()), (Names{"rest_piece_volume", "piece_volume"}));
}

TEST(Checker, FindsADeformedPieceOfNegativeVolume) {
    HandMadeRun run = falling_box(Vec3::Zero());
    for (Vec3& p : run.surfaces[8].positions) p.x() = -p.x();
    EXPECT_EQ(broken(run.check()), Names{"piece_volume"});
}

TEST(Checker, FindsMissingAndDamagedFiles) {
    HandMadeRun shorter = falling_box();
    shorter.rows.pop_back();
    EXPECT_EQ(broken(shorter.check()), Names{"complete"});
    HandMadeRun infinite = falling_box();
    infinite.rows[3]["elastic_energy"] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(infinite.check().breaks(Law::complete));
    HandMadeRun missing = falling_box();
    missing.surfaces.pop_back();
    EXPECT_EQ(broken(missing.check()), Names{"complete"});
    HandMadeRun nowhere = falling_box();
    nowhere.surfaces[1].positions[2].y() = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(nowhere.check().breaks(Law::complete));
}

TEST(Checker, OfAStoppedRunCountsWhatThereIs) {
    HandMadeRun run = falling_box();
    run.rows.resize(5);
    const TemporaryFolder folder;
    run.write(folder.path());
    const Verdict verdict = check_run(folder.path(), folder.path() / "run", false);
    EXPECT_EQ(broken(verdict), Names{});
    EXPECT_TRUE(verdict.of(Law::energy).measured);
}

TEST(SurfaceFile, RefusesDamage) {
    const std::string good = encode_surface(box_surface({0, 0, 0}, {1, 1, 1}));
    EXPECT_NO_THROW(parse_surface(good, "x"));
    EXPECT_THROW(parse_surface(good.substr(0, good.size() - 1), "x"), std::runtime_error);
    EXPECT_THROW(parse_surface(good + "x", "x"), std::runtime_error);
    EXPECT_THROW(parse_surface("ply\n", "x"), std::runtime_error);
    std::string wild = good;
    wild[good.size() - 1] = 0x7f;
    EXPECT_THROW(parse_surface(wild, "x"), std::runtime_error);
}

}  // namespace
}  // namespace splitcubes::torture
