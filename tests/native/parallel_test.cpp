// The thread pool: every piece once, exceptions handed on, and fit for use afterwards.
#include "core/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace vlp::test {
namespace {

TEST(ThreadPool, RunsEveryPieceOnce) {
    for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        ThreadPool pool(threads);
        EXPECT_EQ(pool.size(), threads);
        for (const uint32_t count : {0u, 1u, 7u, 1000u, 20000u}) {
            std::vector<std::atomic<int>> runs(count);
            pool.run(count, [&](uint32_t i) { ++runs[i]; });
            for (const auto& n : runs) ASSERT_EQ(n, 1);
        }
    }
}

TEST(ThreadPool, ManyShortLoops) {
    ThreadPool pool(3);
    std::atomic<uint64_t> sum{0};
    for (uint32_t loop = 0; loop < 3000; ++loop) {
        pool.run(loop % 5, [&](uint32_t i) { sum += i + 1; });
    }
    EXPECT_EQ(sum, 600u * (0 + 1 + 3 + 6 + 10));
}

TEST(ThreadPool, ZeroThreadsMeansOneForEachProcessor) {
    EXPECT_EQ(ThreadPool(0).size(), std::max(1u, std::thread::hardware_concurrency()));
}

TEST(ThreadPool, HandsOnAnExceptionAndGoesOn) {
    for (const unsigned threads : {1u, 4u}) {
        ThreadPool pool(threads);
        for (int round = 0; round < 20; ++round) {
            EXPECT_THROW(pool.run(500,
                                  [](uint32_t i) {
                                      if (i % 100 == 37) throw std::runtime_error("piece");
                                  }),
                         std::runtime_error);
            std::atomic<uint32_t> done{0};
            pool.run(500, [&](uint32_t) { ++done; });
            EXPECT_EQ(done, 500u);
        }
    }
}

}  // namespace
}  // namespace vlp::test
