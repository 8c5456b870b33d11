// Sums of the film: exact, whatever the order, and merged without a change of a bit.
#include "film/film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

namespace vlp::test {
namespace {

using Wide = unsigned __int128;

// `value` in units of 2^-64, by its bits; what is below is cut off.
Wide in_fixed_point(float value) {
    int exponent = 0;
    const auto mantissa = static_cast<Wide>(std::ldexp(std::frexp(value, &exponent), 24));
    const int shift = exponent - 24 + 64;
    return shift >= 0 ? mantissa << shift : shift > -64 ? mantissa >> -shift : Wide{0};
}

Wide in_fixed_point(const ExactSum& sum) {
    return (static_cast<Wide>(static_cast<uint64_t>(sum.whole)) << 64) | sum.fraction;
}

std::vector<float> random_values(uint32_t seed, size_t count) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> mantissa(1, 2);
    std::uniform_int_distribution<int> exponent(-100, 40);
    std::vector<float> values;
    for (size_t i = 0; i < count; ++i) values.push_back(std::ldexp(mantissa(random), exponent(random)));
    for (const float v : {0.0f, 1.0f, 0x1p-64f, 0x1p-149f, 0x1.fffffep-1f, 0x1.fffffep61f}) values.push_back(v);
    return values;
}

TEST(ExactSum, EqualsIntegerArithmeticInEveryOrder) {
    for (uint32_t seed = 0; seed < 20; ++seed) {
        std::vector<float> values = random_values(seed, 2000);
        Wide expected = 0;
        for (const float v : values) expected += in_fixed_point(v);
        std::mt19937 random(seed);
        for (int order = 0; order < 5; ++order) {
            std::shuffle(values.begin(), values.end(), random);
            ExactSum sum, parts[3];
            for (size_t i = 0; i < values.size(); ++i) {
                sum.add(values[i]);
                parts[i % 3].add(values[i]);
            }
            EXPECT_TRUE(in_fixed_point(sum) == expected);
            parts[0].add(parts[1]);
            parts[0].add(parts[2]);
            EXPECT_TRUE(in_fixed_point(parts[0]) == expected);
        }
    }
}

TEST(ExactSum, KeepsSmallBesideLarge) {
    ExactSum sum;
    sum.add(0x1p60f);
    for (int i = 0; i < 1000; ++i) sum.add(0x1p-64f);
    EXPECT_EQ(sum.whole, int64_t{1} << 60);
    EXPECT_EQ(sum.fraction, 1000u);
}

TEST(ExactSum, StaysAtItsEnd) {
    ExactSum large, small;
    for (int i = 0; i < 3; ++i) large.add(0x1.fffffep127f);
    EXPECT_EQ(large.whole, std::numeric_limits<int64_t>::max());
    small.add(0.5f);
    small.add(large);
    EXPECT_EQ(small.whole, large.whole);
    EXPECT_EQ(small.fraction, large.fraction);
}

TEST(ExactSum, ValueIsTheNearestDouble) {
    ExactSum sum;
    for (int i = 0; i < 3; ++i) sum.add(0.1f);
    EXPECT_EQ(sum.value(), 3 * static_cast<double>(0.1f));
}

// Threads that add to one sum at once: most of what they add, and it alone, makes the fraction wrap.
TEST(ExactSum, SharedByThreadsEqualsOneThread) {
    const auto fetch_add = [](uint64_t& word, uint64_t x) { return std::atomic_ref(word).fetch_add(x); };
    std::mt19937 random(5);
    std::uniform_real_distribution<float> value(0, 3);
    std::vector<float> values(400000);
    for (float& v : values) v = value(random);
    ExactSum alone, shared;
    for (const float v : values) alone.add(v);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            for (size_t i = t; i < values.size(); i += 4) add_shared(shared, exact(values[i]), fetch_add);
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(shared.whole, alone.whole);
    EXPECT_EQ(shared.fraction, alone.fraction);
}

TEST(ExactSum, LimitsWhatIsAdded) {
    EXPECT_EQ(exact(0x1p62f, 1000.5f).whole, 1000);
    EXPECT_EQ(exact(0x1p62f, 1000.5f).fraction, uint64_t{1} << 63);
    EXPECT_EQ(exact(3, 1000.5f).whole, 3);
    EXPECT_EQ(exact(0x1p-64f).fraction, 1u);
}

TEST(Film, SplatsAreCommittedUnlessCleared) {
    Film film({2, 1, 3, 4}, true);
    ASSERT_EQ(film.splats().size(), 36u);
    for (uint32_t iteration = 0; iteration < 2; ++iteration) {
        for (PixelSample& p : film.frame()) p = {{1, 2, 3, 1}};
        for (size_t i = 0; i < 36; ++i) film.splats()[i].add(static_cast<float>(i));
        film.commit_rows(0, 1);
        film.commit_rows(1, 4);
        film.count_iteration();
        film.clear_splats(0, 3);
        film.clear_splats(3, 4);
    }
    for (const ExactSum& s : film.splats()) EXPECT_EQ(s.value(), 0);
    std::vector<float> rgba(48);
    film.read(rgba);
    for (size_t pixel = 0; pixel < 12; ++pixel) {
        for (size_t c = 0; c < 3; ++c) EXPECT_EQ(rgba[4 * pixel + c], static_cast<float>(1 + c + 3 * pixel + c));
        EXPECT_EQ(rgba[4 * pixel + 3], 1);  // splats have no alpha
    }
}

void fill(Film& film, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> value(0, 10);
    for (PixelSample& p : film.frame()) {
        for (float& x : p.rgba) x = value(random);
    }
    film.commit_rows(0, 2);
    film.commit_rows(2, film.window().height);
    film.count_iteration();
}

TEST(Film, MergedRangesEqualOneRender) {
    const Window window{3, 4, 5, 6};
    Film whole(window), first(window), second(window);
    for (uint32_t i = 0; i < 7; ++i) {
        fill(whole, i);
        fill(i < 4 ? first : second, i);
    }
    second.add(first.sums(), first.iterations());
    EXPECT_EQ(second.iterations(), 7u);
    std::vector<float> a(window.pixel_count() * 4), b(a.size());
    whole.read(a);
    second.read(b);
    EXPECT_EQ(a, b);
    for (size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(whole.sums()[i].whole, second.sums()[i].whole);
        EXPECT_EQ(whole.sums()[i].fraction, second.sums()[i].fraction);
    }
}

TEST(Film, ReadsTheMean) {
    Film film({0, 0, 2, 3});
    for (uint32_t i = 0; i < 4; ++i) {
        for (PixelSample& p : film.frame()) p = {{static_cast<float>(i), 1, 0.5f, 0}};
        film.commit_rows(0, 3);
        film.count_iteration();
    }
    std::vector<float> rgba(24);
    film.read(rgba);
    for (size_t i = 0; i < 24; i += 4) {
        EXPECT_EQ(rgba[i], 1.5f);
        EXPECT_EQ(rgba[i + 1], 1);
        EXPECT_EQ(rgba[i + 2], 0.5f);
        EXPECT_EQ(rgba[i + 3], 0);
    }
}

TEST(Film, KeepsGuidesAndSplatsOfOnePixel) {
    const Window window{0, 0, 2, 3};
    Film whole(window, true, true), part(window, true, true);
    ASSERT_EQ(whole.channels(), 13u);
    for (uint32_t i = 0; i < 4; ++i) {
        Film& film = i < 3 ? whole : part;
        film.clear_splats(0, 3);
        for (PixelSample& p : film.frame()) p = {{1, 2, 3, 1}};
        for (ExactSum& s : film.splats()) s.add(0.5f);
        for (ExactSum& s : film.point_splats()) s.add(static_cast<float>(i));
        for (GuideSample& g : film.guide_frame())
            g = {{0.25f, static_cast<float>(i), 3}, {-1, 0, i < 2 ? 1.0f : -1.0f}};
        film.commit_rows(0, 3);
        film.count_iteration();
    }
    whole.add(part.sums(), part.iterations());
    std::vector<float> rgba(24), color(18), albedo(18), normal(18);
    whole.read(rgba);
    whole.read_guided(color, albedo, normal);
    for (size_t pixel = 0; pixel < 6; ++pixel) {
        for (size_t c = 0; c < 3; ++c) {
            EXPECT_EQ(rgba[4 * pixel + c], static_cast<float>(c) + 1.5f);
            EXPECT_EQ(color[3 * pixel + c], static_cast<float>(c) + 1 + 1.5f);  // the mean of 0, 1, 2, 3
        }
        EXPECT_EQ(rgba[4 * pixel + 3], 1);
        EXPECT_EQ(albedo[3 * pixel], 0.25f);
        EXPECT_EQ(albedo[3 * pixel + 1], 1);  // no more
        EXPECT_EQ(albedo[3 * pixel + 2], 1);
        EXPECT_EQ(normal[3 * pixel], -1);
        EXPECT_EQ(normal[3 * pixel + 1], 0);
        EXPECT_EQ(normal[3 * pixel + 2], 0);
    }
}

TEST(Film, ReadsGuidesOfTheFirstUnfinishedFrame) {
    Film film({0, 0, 1, 1}, false, true);
    film.frame()[0] = {{1, 2, 3, 1}};
    film.guide_frame()[0] = {{0.5f, 0, 2}, {0, 0, -1}};
    std::vector<float> color(3), albedo(3), normal(3);
    film.read_guided(color, albedo, normal);
    EXPECT_EQ(color, (std::vector<float>{1, 2, 3}));
    EXPECT_EQ(albedo, (std::vector<float>{0.5f, 0, 1}));
    EXPECT_EQ(normal, (std::vector<float>{0, 0, -1}));
}

TEST(Film, RefusesGuidesThatItDoesNotKeep) {
    Film plain({0, 0, 2, 3}), guided({0, 0, 2, 3}, false, true);
    std::vector<float> right(18), wrong(24);
    EXPECT_THROW(plain.read_guided(right, right, right), std::invalid_argument);
    EXPECT_THROW(guided.read_guided(right, wrong, right), std::invalid_argument);
    EXPECT_THROW(guided.add(plain.sums(), 1), std::invalid_argument);
}

TEST(Film, RefusesOtherSizes) {
    Film film({0, 0, 2, 3}), other({0, 0, 3, 3});
    std::vector<float> rgba(20);
    EXPECT_THROW(film.read(rgba), std::invalid_argument);
    EXPECT_THROW(film.add(other.sums(), 1), std::invalid_argument);
    EXPECT_EQ(film.iterations(), 0u);
}

}  // namespace
}  // namespace vlp::test
