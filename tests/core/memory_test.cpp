#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>

#include <sys/resource.h>

#include "sanitized.h"

using namespace splitcubes;

TEST(Memory, SomeIsAvailable) {
    EXPECT_GT(available_memory(), 1e6);
    EXPECT_LT(available_memory(), 1e16);
}

TEST(Memory, ALimitOfTheProcessCounts) {
    if (is_sanitized) GTEST_SKIP() << "the sanitizer's tables pass any limit";
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_DATA, &before), 0);
    rlimit small = before;
    small.rlim_cur = rlim_t{1} << 30;
    ASSERT_EQ(setrlimit(RLIMIT_DATA, &small), 0);
    const double left = available_memory();
    ASSERT_EQ(setrlimit(RLIMIT_DATA, &before), 0);
    EXPECT_LE(left, 0x1p30);
}

TEST(Memory, TooLargeRequestsAreRefusedWithBothNumbers) {
    EXPECT_NO_THROW(require_memory("mesh", 1e9, "use fewer cells", 1e9));
    try {
        require_memory("mesh", 12.34e9, "use fewer cells", 345.6e6);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "mesh: needs about 12 GB of memory, 346 MB are free; use fewer cells");
    }
}

TEST(Memory, BytesAreFormatted) {
    EXPECT_EQ(bytes_text(0), "0 B");
    EXPECT_EQ(bytes_text(999), "999 B");
    EXPECT_EQ(bytes_text(999.7), "1 kB");
    EXPECT_EQ(bytes_text(1.25e6), "1.2 MB");
    EXPECT_EQ(bytes_text(3.4e9), "3.4 GB");
    EXPECT_EQ(bytes_text(2e30), "2e15 PB");
}
