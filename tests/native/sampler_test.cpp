// Random numbers: a (0, 2)-sequence in every draw, and no dependence between draws, pixels, iterations and streams.
#include "core/sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "integrator/pass.h"
#include "tails.h"

namespace vlp::test {
namespace {

uint32_t seed_of(uint32_t i) { return hash(5, k_eye_stream, i); }

TEST(Sampler, EveryAlignedBlockFillsEveryElementaryInterval) {
    for (uint32_t trial = 0; trial < 40; ++trial) {
        for (uint32_t m = 0; m <= 10; ++m) {
            const uint32_t count = 1u << m, first = trial * count;
            std::vector<Vec2> points;
            std::vector<float> numbers;
            for (uint32_t i = first; i < first + count; ++i) {
                Sampler sampler = make_sampler(seed_of(trial), i);
                sampler.dimension = trial % 7;
                points.push_back(sampler.next_2d());
                numbers.push_back(sampler.next());
            }
            for (uint32_t wide = 0; wide <= m; ++wide) {  // 2^wide columns of 2^(m - wide) rows
                std::vector<bool> seen(count);
                for (const Vec2 p : points) {
                    ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1);
                    const auto column = static_cast<uint32_t>(p.x * static_cast<float>(1u << wide));
                    const auto row = static_cast<uint32_t>(p.y * static_cast<float>(1u << (m - wide)));
                    ASSERT_FALSE(seen[(column << (m - wide)) | row]) << "trial " << trial << ", 2^" << m << " points";
                    seen[(column << (m - wide)) | row] = true;
                }
            }
            std::vector<bool> seen(count);
            for (const float x : numbers) {
                ASSERT_TRUE(x >= 0 && x < 1);
                const auto i = static_cast<uint32_t>(x * static_cast<float>(count));
                ASSERT_FALSE(seen[i]);
                seen[i] = true;
            }
        }
    }
}

// Renders can be continued and merged by another version: the numbers of (seed, index, dimension) never change.
TEST(Sampler, NumbersStayTheSame) {
    struct Known {
        uint32_t seed, index, dimension, x, y;  // y: upper 24 bits
    };
    for (const Known& known : {Known{1, 0, 0, 0x2268faec, 0x63c7b7},
                               {1, 0, 5, 0x9d898555, 0x1a3ce1},
                               {1, 77, 0, 0x6180c5aa, 0x96b5c9},
                               {1, 77, 5, 0x4de661e5, 0x0f9be8},
                               {1, 0x80000001, 0, 0x79fe06ca, 0x21d1a7},
                               {0xdeadbeef, 0, 5, 0xdb28f1c7, 0xf2fd3a},
                               {0xdeadbeef, 77, 5, 0xefc1cc9f, 0x6654f8}}) {
        Sampler sampler = make_sampler(known.seed, known.index);
        sampler.dimension = known.dimension;
        EXPECT_EQ(sampler.next_bits(), known.x);
        sampler.dimension = known.dimension;
        const Vec2 u = sampler.next_2d();
        EXPECT_EQ(u.x, unit_float(known.x));
        EXPECT_EQ(u.y, static_cast<float>(known.y) * 0x1p-24f);
    }
}

TEST(Sampler, DrawsDoNotDependOnTheOnesBefore) {
    Sampler sampler = make_sampler(7, 1234);
    for (uint32_t i = 0; i < 2000; ++i) {
        const uint32_t dimension = hash(i / 3) % 100;
        const SamplePair pair = sample_pair(7, reverse_bits(1234), dimension);
        sampler.dimension = dimension;
        if (i % 2 == 0) {
            EXPECT_EQ(sampler.next_bits(), pair.x);
        } else {
            const Vec2 u = sampler.next_2d();
            EXPECT_EQ(u.x, unit_float(pair.x));
            EXPECT_EQ(u.y, unit_float(pair.y));
        }
        EXPECT_EQ(sampler.dimension, dimension + 1);
    }
}

// Each number alone is uniform over the seeds; z-tests at 5 standard deviations, 40 of them: false alarms 2e-5.
TEST(Sampler, MeanAndVarianceOverSeeds) {
    constexpr uint32_t k_seeds = 100000;
    for (const uint32_t index : {0u, 1u, 2u, 77u, 123456u}) {
        for (uint32_t dimension = 0; dimension < 4; ++dimension) {
            double sum = 0, squares = 0;
            for (uint32_t s = 0; s < k_seeds; ++s) {
                Sampler sampler = make_sampler(seed_of(s), index);
                sampler.dimension = dimension;
                const double x = static_cast<double>(sampler.next_2d().y) - 0.5;
                sum += x, squares += x * x;
            }
            EXPECT_NEAR(sum / k_seeds, 0, 5 / std::sqrt(12.0 * k_seeds)) << index << ", " << dimension;
            EXPECT_NEAR(squares / k_seeds, 1.0 / 12, 5 / std::sqrt(180.0 * k_seeds)) << index << ", " << dimension;
        }
    }
}

// Chi-squared of pairs (x, y) in a grid.
constexpr int k_side = 16;

class PairTable {
public:
    void add(float x, float y) {
        ++cells_[static_cast<size_t>(x * k_side) * k_side + static_cast<size_t>(y * k_side)];
        ++count_;
    }
    double p() const {
        double statistic = 0;
        const double expected = count_ / (k_side * k_side);
        for (const double seen : cells_) statistic += (seen - expected) * (seen - expected) / expected;
        return chi_squared_tail(statistic, k_side * k_side - 1);
    }

private:
    std::vector<double> cells_ = std::vector<double>(k_side * k_side);
    double count_ = 0;
};

// Holds what p-values say against a false-alarm rate of 1e-4 over all of them.
class Family {
public:
    void add(double p) { smallest_ = std::min(smallest_, p), ++tests_; }
    void check() const { EXPECT_GT(smallest_, sidak(1e-4, tests_)) << tests_ << " tests"; }

private:
    double smallest_ = 1;
    size_t tests_ = 0;
};

constexpr uint32_t k_draws = 1 << 13;

// Of each block of k_side successive indices, which fill rows and columns evenly together, the pairs take one: those are
// independent.
uint32_t index_of(uint32_t i) { return i * k_side; }

Vec2 draw(uint32_t seed, uint32_t index, uint32_t dimension) {
    Sampler sampler = make_sampler(seed, index);
    sampler.dimension = dimension;
    return sampler.next_2d();
}

TEST(Sampler, DrawsOfOnePathAreIndependent) {
    Family family;
    for (uint32_t trial = 0; trial < 4; ++trial) {
        for (uint32_t a = 0; a < 12; ++a) {
            for (uint32_t b = a + 1; b < 12; ++b) {
                PairTable along_indices, along_seeds;
                for (uint32_t i = 0; i < k_draws; ++i) {
                    const uint32_t index = index_of(i);
                    along_indices.add(draw(seed_of(trial), index, a).x, draw(seed_of(trial), index, b).y);
                    along_seeds.add(draw(seed_of(i), trial, a).x, draw(seed_of(i), trial, b).x);
                }
                family.add(along_indices.p());
                family.add(along_seeds.p());
            }
        }
    }
    family.check();
}

TEST(Sampler, PixelsIterationsAndStreamsAreIndependent) {
    Family family;
    for (uint32_t trial = 0; trial < 60; ++trial) {
        const uint32_t dimension = trial % 12;
        PairTable pixels, rows, iterations, streams, seeds;
        for (uint32_t i = 0; i < k_draws; ++i) {
            const auto pixel = [&](uint32_t seed, uint32_t p) {
                return draw(hash(seed, k_eye_stream, p), index_of(i), dimension);
            };
            const auto path = [&](Stream s, uint32_t iteration) {
                return draw(hash(0, s, iteration), index_of(i), dimension);
            };
            pixels.add(pixel(0, trial).x, pixel(0, trial + 1).x);
            rows.add(pixel(0, trial).y, pixel(0, trial + 1920).y);
            iterations.add(path(k_light_stream, trial).x, path(k_light_stream, trial + 1).x);
            streams.add(path(k_light_stream, trial).y, path(k_pilot_stream, trial).y);
            seeds.add(pixel(trial, 9).x, pixel(trial + 1, 9).x);
        }
        for (const PairTable* table : {&pixels, &rows, &iterations, &streams, &seeds}) family.add(table->p());
    }
    family.check();
}

}  // namespace
}  // namespace vlp::test
