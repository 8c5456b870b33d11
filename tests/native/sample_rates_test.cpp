// Adaptive sampling: samples go where there is noise, as many as asked for, and their mean is right at any time.
#include "film/sample_rates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <random>

namespace vlp::test {
namespace {

int total(std::span<const int8_t> levels) {
    double sum = 0;
    for (const int8_t level : levels) sum += std::ldexp(1.0, level);
    return static_cast<int>(std::ceil(sum));
}

TEST(Levels, SpendOneSampleAPixel) {
    std::mt19937 random(1);
    for (const float spread : {0.0f, 0.5f, 2.0f, 8.0f}) {
        std::lognormal_distribution<float> deviations(-3, spread);
        std::vector<float> deviation(10000);
        for (float& x : deviation) x = deviations(random);
        const auto levels = levels_for(deviation);
        EXPECT_LE(total(levels), 10000);
        // A scale more would be too many; with few extremes an eighth of an octave is what it can miss.
        EXPECT_GE(total(levels), spread > 4 ? 4000 : 8000) << spread;
    }
}

TEST(Levels, FollowTheNoise) {
    std::vector<float> deviation(1024, 1.0f);
    std::fill(deviation.begin(), deviation.begin() + 64, 8.0f);
    const auto levels = levels_for(deviation);
    EXPECT_EQ(levels.front() - levels.back(), 3);  // eight times the samples
    for (const float scale : {1e-12f, 1e12f}) {
        std::vector<float> scaled = deviation;
        for (float& x : scaled) x *= scale;
        EXPECT_EQ(levels_for(scaled), levels) << "the unit of noise does not matter";
    }
}

TEST(Levels, AreBounded) {
    std::vector<float> deviation(4096, 0.0f);
    deviation[5] = 1e30f;
    const auto levels = levels_for(deviation);
    EXPECT_EQ(levels[5], k_most_level);
    EXPECT_EQ(levels[6], -1) << "the most that leaves room for it";
    for (const float same : {0.0f, 1.0f}) {
        const auto even = levels_for(std::vector<float>(100, same));
        EXPECT_TRUE(std::all_of(even.begin(), even.end(), [](int8_t level) { return level <= 0; }));
    }
    EXPECT_TRUE(levels_for({}).empty());
}

TEST(PixelMoments, TellTheVarianceOfASample) {
    // Means of n samples, for varying n.
    std::mt19937 random(2);
    std::gamma_distribution<float> values(2, 1.5f);  // mean 3, variance 4.5
    PixelMoments moments;
    EXPECT_EQ(moments.relative_variance(), 0);
    for (uint32_t i = 0; i < 20000; ++i) {
        const uint32_t n = 1u << (i % 5);
        float sum = 0;
        for (uint32_t k = 0; k < n; ++k) sum += values(random);
        const float mean = sum / static_cast<float>(n);
        moments.add({{mean, mean, mean, 1}}, n);
    }
    EXPECT_NEAR(moments.relative_variance(), 4.5f / square(3.1f), 0.02f);
    PixelMoments specks;
    for (int i = 0; i < 3; ++i) specks.add({{i == 0 ? 3e38f : 0.0f, 0, 0, 1}}, 16);
    EXPECT_TRUE(is_finite(specks.relative_variance()));
}

// A film of k_side^2 pixels whose samples are numbers from a distribution.
struct Simulation {
    static constexpr uint32_t k_side = 16, k_pixels = k_side * k_side;
    using Draw = std::function<float(uint32_t pixel, uint32_t index)>;

    SamplePlan plan{{0, 0, k_side, k_side}, true};
    std::vector<PixelMoments> moments = std::vector<PixelMoments>(k_pixels);
    std::vector<PixelSample> frame = std::vector<PixelSample>(k_pixels);
    std::vector<double> sums = std::vector<double>(k_pixels);
    std::vector<uint32_t> samples = std::vector<uint32_t>(k_pixels);
    uint32_t iterations = 0, first_iteration = 0;

    void iterate(const Draw& draw) {
        if (plan.due()) {
            std::vector<float> variance(k_pixels);
            for (uint32_t i = 0; i < k_pixels; ++i) variance[i] = moments[i].relative_variance();
            plan.plan(variance);
        }
        const SampleRates rates = plan.rates(first_iteration + 2 * iterations, plan.levels().data(), moments.data());
        uint64_t taken = 0;
        for (uint32_t i = 0; i < k_pixels; ++i) {
            const PixelTurn turn = turn_of(rates, i);
            if (turn.samples > 0) {
                EXPECT_EQ(turn.first_index, samples[i]) << "no number is used twice, and none is left out";
                EXPECT_EQ(turn.sequence, first_iteration);
                float sum = 0;
                for (uint32_t k = 0; k < turn.samples; ++k) sum += draw(i, turn.first_index + k);
                frame[i].rgba[0] = frame[i].rgba[1] = frame[i].rgba[2] = sum / static_cast<float>(turn.samples);
            }
            samples[i] += turn.samples;
            taken += turn.samples;
            sums[i] += frame[i].rgba[0];
        }
        for (uint32_t i = 0; i < k_pixels; ++i) {
            const PixelTurn turn = turn_of(rates, i);
            if (turn.samples > 0) moments[i].add(frame[i], turn.samples);
        }
        EXPECT_EQ(plan.finish_iteration(), taken);
        ++iterations;
    }
    double mean(uint32_t begin, uint32_t end) const {
        return std::accumulate(sums.begin() + begin, sums.begin() + end, 0.0) / ((end - begin) * iterations);
    }
};

TEST(SamplePlan, SamplesGoWhereTheNoiseIs) {
    std::mt19937 random(3);
    std::exponential_distribution<float> noise(1);
    Simulation film;
    const auto noisy = [](uint32_t i) { return i < Simulation::k_pixels / 6; };
    for (int i = 0; i < 256; ++i)
        film.iterate([&](uint32_t pixel, uint32_t) { return noisy(pixel) ? noise(random) : 1.0f; });
    const auto middle = Simulation::k_pixels / 12, far = Simulation::k_pixels - 8;
    EXPECT_GT(film.samples[middle], 3 * 256u);
    EXPECT_LT(film.samples[far], 256u / 3);
    const auto all = std::accumulate(film.samples.begin(), film.samples.end(), 0u);
    EXPECT_GT(all, 0.75 * 256 * Simulation::k_pixels);
    EXPECT_LT(all, 1.1 * 256 * Simulation::k_pixels);  // a block's first turn takes some more
}

// Iterations that are dealt out: each of two devices has every other one.
TEST(SamplePlan, DevicesHaveSequencesOfTheirOwn) {
    std::mt19937 random(5);
    std::exponential_distribution<float> noise(1);
    Simulation devices[2];
    devices[1].first_iteration = 1;
    for (int i = 0; i < 40; ++i) {
        for (Simulation& device : devices) device.iterate([&](uint32_t, uint32_t) { return noise(random); });
    }
}

TEST(SamplePlan, WithoutAdaptingIterationsAreNumbers) {
    SamplePlan plan({0, 0, 4, 2}, false);
    for (uint32_t i = 7; i < 40; i += 3) {
        const PixelTurn turn = turn_of(plan.rates(i, nullptr, nullptr), 5);
        EXPECT_EQ(turn.samples, 1u);
        EXPECT_EQ(turn.sequence, 0u);
        EXPECT_EQ(turn.first_index, i);
        EXPECT_EQ(plan.finish_iteration(), 8u);
        EXPECT_FALSE(plan.due());
    }
}

TEST(SamplePlan, TheMeanIsRightAtAnyTime) {
    // Rare bright specks, which dark pixels have not met yet: what stops too soon stays dark.
    std::mt19937 random(4);
    std::uniform_real_distribution<float> uniform;
    const auto draw = [&](uint32_t pixel, uint32_t) {
        const float chance = 0.01f * static_cast<float>(1 + pixel % 16);
        return uniform(random) < chance ? 1 / chance : 0.0f;  // mean 1
    };
    constexpr int k_films = 600;
    const std::vector<int> times = {4, 5, 7, 8, 9, 13, 16, 21, 32, 33, 50, 64};
    std::vector<double> first(times.size()), second(times.size());
    for (int f = 0; f < k_films; ++f) {
        Simulation film;
        for (size_t t = 0; t < times.size(); ++t) {
            while (film.iterations < static_cast<uint32_t>(times[t])) film.iterate(draw);
            const double error = film.mean(0, Simulation::k_pixels) - 1;
            first[t] += error, second[t] += error * error;
        }
    }
    for (size_t t = 0; t < times.size(); ++t) {
        const double mean = first[t] / k_films, deviation = std::sqrt(second[t] / k_films / k_films);
        std::printf("  %2d iterations: %+.4f, standard error %.4f\n", times[t], mean, deviation);
        EXPECT_LT(std::fabs(mean), 4 * deviation) << times[t];
        EXPECT_LT(deviation, 0.006);
    }
}

}  // namespace
}  // namespace vlp::test
