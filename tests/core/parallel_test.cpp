#include <gtest/gtest.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/core/random.h>
#include <splitcubes/core/state_hash.h>

#include <numeric>

using namespace splitcubes;

TEST(Parallel, VisitsEachIndexOnce) {
    for (const int threads : {1, 2, 5}) {
        const Parallel parallel(threads);
        for (const std::size_t count : {0U, 1U, 7U, 64U, 1000U}) {
            std::vector<int> visits(count, 0);
            parallel.for_each(count, 7, [&](std::size_t i) { ++visits[i]; });
            EXPECT_EQ(visits, std::vector<int>(count, 1));
        }
    }
}

TEST(Parallel, SumIsTheSameToTheLastBitForAnyThreadCount) {
    Random random(1);
    std::vector<double> values(10007);
    for (double& v : values) v = random.uniform(-1, 1) * 1e6;
    const auto total = [&](int threads) {
        return Parallel(threads).sum(values.size(), 64, 0.0, [&](std::size_t begin, std::size_t end) {
            return std::accumulate(values.begin() + static_cast<long>(begin),
                                   values.begin() + static_cast<long>(end), 0.0);
        });
    };
    const double one = total(1);
    EXPECT_EQ(one, total(2));
    EXPECT_EQ(one, total(3));
    EXPECT_EQ(one, total(8));
}

TEST(StateHash, DependsOnOrderAndSign) {
    StateHash a, b, c;
    a.add(1.0);
    a.add(2.0);
    b.add(2.0);
    b.add(1.0);
    c.add(1.0);
    c.add(-2.0);
    EXPECT_NE(a.value(), b.value());
    EXPECT_NE(a.value(), c.value());
    EXPECT_EQ(a.text().size(), 16U);
}
