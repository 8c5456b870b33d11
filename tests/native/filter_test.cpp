// Pixel filters: samples follow the filter, whose integral is 1.
#include <gtest/gtest.h>

#include <cmath>

#include "film/filter_tables.h"
#include "goodness_of_fit.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_seed = 20240614;
constexpr Filter k_filters[] = {Filter::box, Filter::gaussian, Filter::blackman_harris};

// Six fits of significance 1e-6 over cells of the middle half of the support, with all the rest as one more cell.
TEST(PixelFilter, SamplesFollowTheFilter) {
    Random random{k_seed};
    for (const Filter filter : k_filters) {
        for (const float width : {1.0f, 1.5f}) {
            const float extent = 2 * filter_radius(filter, width) * (filter == Filter::box ? 1.0f : 0.7f);
            const auto draw = [&](float (&point)[2]) {
                const Vec2 x = sample(filter, width, filter_tables().data(), random.next_2d());
                EXPECT_LE(max_of(std::fabs(x.x), std::fabs(x.y)), filter_radius(filter, width));
                point[0] = x.x / extent + 0.5f, point[1] = x.y / extent + 0.5f;
                return point[0] >= 0 && point[0] < 1 && point[1] >= 0 && point[1] < 1;
            };
            const auto density = [&](const float (&point)[2]) {
                return eval(filter, width, {(point[0] - 0.5f) * extent, (point[1] - 0.5f) * extent}) * square(extent);
            };
            const Fit fit = goodness_of_fit({40, 40}, 2000000, 6, random, draw, density);
            EXPECT_GT(fit.p, 1e-6) << static_cast<int>(filter) << ", width " << width << ", seed " << k_seed;
        }
    }
}

TEST(PixelFilter, IntegralIsOne) {
    for (const Filter filter : k_filters) {
        for (const float width : {0.7f, 1.5f, 4.0f}) {
            constexpr int k_steps = 4000;
            const double radius = static_cast<double>(filter_radius(filter, width));
            double sum = 0, spread = 0;
            for (int i = 0; i < k_steps; ++i) {
                const double x = radius * (2 * (i + 0.5) / k_steps - 1);
                const double f = static_cast<double>(eval_1d(filter, width, static_cast<float>(x)));
                sum += f * 2 * radius / k_steps;
                spread += f * x * x * 2 * radius / k_steps;
            }
            EXPECT_NEAR(sum, 1, 2e-6);
            // Standard deviations of Cycles' filters in their widths; the window's from its Fourier terms.
            const double window =
                4 * (1.0 / 12 + (-0.48829 + 0.14128 / 4 - 0.01168 / 9) / 0.35875 / (2 * 9.8696044011));
            const double expected = filter == Filter::box ? 1.0 / 12 : filter == Filter::gaussian ? 1.0 / 16 : window;
            const double w = static_cast<double>(width);
            EXPECT_NEAR(spread / (w * w), expected, 2e-5) << static_cast<int>(filter);
            EXPECT_EQ(eval(filter, width, {static_cast<float>(radius) * 1.001f, 0}), 0);
        }
    }
}

// Numbers u in [0, 1) are those of the sampler: whole multiples of 2^-24.
TEST(PixelFilter, SamplesInvertTheFilter) {
    for (const Filter filter : {Filter::gaussian, Filter::blackman_harris}) {
        const float* const tables = filter_tables().data();
        double last = -2;
        for (int i = 0; i < 1 << 16; ++i) {
            const float u = i < 1000 ? static_cast<float>(i) * 0x1p-24f : static_cast<float>(i) * 0x1p-16f;
            const double x = static_cast<double>(sample(filter, 1.0f, tables, {u, u}).y);
            const double share = filter_share_beyond(filter, std::fabs(x)),
                         p = 0.5 - std::fabs(static_cast<double>(u) - 0.5);
            EXPECT_NEAR(share, p, 1.5e-7) << u;
            if (p > 0) {
                EXPECT_NEAR(share / p, 1, 1e-4) << u;
            }
            if (i != 1000) {
                EXPECT_GE(x, last - 1e-7) << u;
            }
            last = x;
        }
        EXPECT_EQ(sample(filter, 1.0f, tables, {0.5f, 0.5f}).x, 0);
        EXPECT_LE(sample(filter, 1.0f, tables, {1 - 0x1p-24f, 0}).x, filter_radius(filter, 1.0f));
    }
}

// The shares that the tables invert are those of `eval_1d`.
TEST(PixelFilter, SharesAreIntegrals) {
    for (const Filter filter : {Filter::gaussian, Filter::blackman_harris}) {
        for (double x = 0.02; x < 0.95; x += 0.03) {
            const double slope = (filter_share_beyond(filter, x - 1e-4) - filter_share_beyond(filter, x + 1e-4)) / 2e-4;
            EXPECT_NEAR(slope, static_cast<double>(eval_1d(filter, 1.0f, static_cast<float>(x))), 1e-6) << x;
        }
        EXPECT_NEAR(filter_share_beyond(filter, 0), 0.5, 1e-12);
    }
}

}  // namespace
}  // namespace vlp::test
