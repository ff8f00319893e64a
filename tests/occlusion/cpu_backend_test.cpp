// Bit masks compared with rays in double precision, sample by sample.
#include <splitcubes/occlusion/brute_force.h>
#include <splitcubes/occlusion/cpu/packs.h>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <bit>

#include "occlusion/scenes.h"

namespace splitcubes::occlusion {
namespace {

using namespace testing;

DiskMasks cpu_masks(const geometry::OccluderGrid& grid, const PairQuery& pair, const DiskRaster& raster) {
    cpu::Buffers buffers;
    return cpu::masks_of(grid, pair, make_disk(pair), raster, buffers);
}

int differing(const DiskBits& a, const DiskBits& b, const DiskRaster& raster) {
    int count = 0;
    for (std::size_t w = 0; w < raster.words; ++w) count += std::popcount((a[w] ^ b[w]) & raster.samples[w]);
    return count;
}

// Returns triangles of many sizes, some through the apexes, some edge-on, some boundary.
Triangles soup(Random& random, const PairQuery& pair) {
    Triangles out;
    const int count = static_cast<int>(random.below(80));
    for (int k = 0; k < count; ++k) {
        const double size = std::pow(10.0, random.uniform(-2.5, 0.3));
        const Vec3 centre = random_in_box(random, 0.7);
        geometry::OccluderTriangle t;
        for (Vec3& p : t.corner) p = centre + random_in_box(random, size);
        if (random.below(8) == 0) t.corner[0] = pair.a;
        if (random.below(8) == 0) t.corner[1] = pair.a + random.uniform(-2, 2) * (t.corner[0] - pair.a);
        if (random.below(16) == 0) t.corner[2] = pair.b + random.uniform(-1, 1) * (pair.b - pair.a);
        if (random.below(16) == 0) t.corner[2] = t.corner[1];
        t.boundary = random.below(2) == 1;
        out.push_back(t);
    }
    return out;
}

// Returns a scene with everything at multiples of 1/16, so rays meet edges exactly.
Triangles lattice_soup(Random& random) {
    Triangles out;
    for (int k = 0; k < 40; ++k) {
        geometry::OccluderTriangle t;
        const Vec3 centre = (8 * random_in_box(random, 1)).array().round() / 16;
        for (Vec3& p : t.corner) p = centre + Vec3((4 * random_in_box(random, 1)).array().round() / 16);
        t.boundary = random.below(2) == 1;
        out.push_back(t);
    }
    return out;
}

struct Difference {
    int samples = 0, obscured = 0, outside = 0;
};

Difference compare(const geometry::OccluderGrid& grid, const PairQuery& pair, const DiskRaster& raster) {
    const DiskMasks fast = cpu_masks(grid, pair, raster), slow = brute_force_masks(grid, pair, raster);
    return {raster.sample_count, differing(fast.obscured, slow.obscured, raster),
            differing(fast.outside, slow.outside, raster)};
}

TEST(CpuBackend, EqualsBruteForceSampleBySample) {
    Random random(21);
    Difference total;
    for (int round = 0; round < repetitions(4000); ++round) {
        const DiskRaster raster(8 << random.below(3));
        const PairQuery pair{random_in_box(random, 0.4), random_in_box(random, 0.4)};
        const Difference one = compare(grid_of(soup(random, pair)), pair, raster);
        total.samples += one.samples;
        total.obscured += one.obscured;
        total.outside += one.outside;
    }
    RecordProperty("samples", total.samples);
    // The error bound is conservative: samples that single precision calls certain are correct.
    EXPECT_EQ(total.obscured, 0) << "of " << total.samples;
    EXPECT_EQ(total.outside, 0) << "of " << total.samples;
}

TEST(CpuBackend, EqualsBruteForceOnTheLattice) {
    Random random(22);
    for (int round = 0; round < repetitions(1000); ++round) {
        const DiskRaster raster(8 << random.below(3));
        PairQuery pair{Vec3::Zero(), Vec3::Zero()};
        while (pair.a == pair.b) {
            pair.a = (8 * random_in_box(random, 1)).array().round() / 16;
            pair.b = (8 * random_in_box(random, 1)).array().round() / 16;
        }
        const Difference one = compare(grid_of(lattice_soup(random)), pair, raster);
        EXPECT_EQ(one.obscured, 0) << round;
        EXPECT_EQ(one.outside, 0) << round;
    }
}

// Nearly horizontal or vertical sides, corners that nearly project on samples, nearly edge-on triangles:
// their distance from the lattice is near or below single precision, but above the error of rays in double
// precision along triangles (1e-11).
TEST(CpuBackend, EqualsBruteForceBesideTheLattice) {
    Random random(24);
    for (int round = 0; round < repetitions(500); ++round) {
        const DiskRaster raster(8 << random.below(3));
        const double off = std::pow(10.0, random.uniform(-9, -2));
        const PairQuery pair{Vec3(0, 0, -0.5) + random_in_box(random, random.below(2) * off),
                             Vec3(0, 0, 0.5) + random_in_box(random, random.below(2) * off)};
        Triangles triangles = lattice_soup(random);
        for (auto& t : triangles)
            for (Vec3& p : t.corner) p += random_in_box(random, random.below(2) * off);
        const Difference one = compare(grid_of(triangles), pair, raster);
        EXPECT_EQ(one.obscured, 0) << round << " off by " << off;
        EXPECT_EQ(one.outside, 0) << round << " off by " << off;
    }
}

// Cells much larger and much smaller than the pair, and a body far from the origin.
TEST(CpuBackend, EqualsBruteForceForAnyCellSize) {
    Random random(25);
    for (int round = 0; round < repetitions(1000); ++round) {
        const DiskRaster raster(8 << random.below(3));
        const Vec3 shift = random_in_box(random, random.below(2) * 100.0);
        const double scale = std::pow(10.0, random.uniform(-3, 0));
        PairQuery pair{random_in_box(random, 0.4), random_in_box(random, 0.4)};
        Triangles triangles = soup(random, pair);
        for (auto& t : triangles)
            for (Vec3& p : t.corner) p = scale * p + shift;
        pair = {scale * pair.a + shift, scale * pair.b + shift};
        const double cell = scale * std::pow(10.0, random.uniform(-1, 2));
        const int cells = 8;
        geometry::OccluderGrid grid(shift - Vec3::Constant(cell * cells / 2), cell, Vec3i::Constant(cells));
        // Triangles may be assigned to any cell.
        std::vector<Triangles> by_cell(8);
        for (const auto& t : triangles) by_cell[random.below(8)].push_back(t);
        for (int k = 0; k < 8; ++k) grid.set_cell({k, 3 + k % 2, 4}, by_cell[static_cast<std::size_t>(k)]);
        const Difference one = compare(grid, pair, raster);
        EXPECT_EQ(one.obscured, 0) << round << " cell " << cell << " scale " << scale;
        EXPECT_EQ(one.outside, 0) << round << " cell " << cell << " scale " << scale;
    }
}

TEST(CpuBackend, EveryInstructionSetGivesTheSameBits) {
    Random random(23);
    std::vector<Triangles> scenes;
    std::vector<PairQuery> pairs;
    for (int k = 0; k < repetitions(300); ++k) {
        pairs.push_back({random_in_box(random, 0.4), random_in_box(random, 0.4)});
        scenes.push_back(soup(random, pairs.back()));
    }
    const auto run = [&] {
        std::vector<DiskMasks> out;
        for (std::size_t k = 0; k < pairs.size(); ++k)
            for (const int size : {8, 16, 32})
                out.push_back(cpu_masks(grid_of(scenes[k], 1, 4), pairs[k], DiskRaster(size)));
        return out;
    };
    const auto first = run();
    const std::int64_t all = hwy::SupportedTargets();
    int tried = 0;
    for (std::int64_t left = all; left; left &= left - 1) {
        const std::int64_t target = left & -left;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        const auto again = run();
        ASSERT_EQ(again.size(), first.size());
        for (std::size_t k = 0; k < first.size(); ++k) {
            EXPECT_EQ(first[k].obscured, again[k].obscured) << hwy::TargetName(target) << ' ' << k;
            EXPECT_EQ(first[k].outside, again[k].outside) << hwy::TargetName(target) << ' ' << k;
        }
        ++tried;
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    RecordProperty("instruction_sets", tried);
    EXPECT_GE(tried, 1);
}

}  // namespace
}  // namespace splitcubes::occlusion
