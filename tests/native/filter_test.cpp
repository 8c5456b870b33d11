// Pixel filters: samples follow the filter, whose integral is 1.
#include <gtest/gtest.h>

#include <cmath>

#include "film/filter.h"
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
                const Vec2 x = sample(filter, width, random.next_2d());
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

TEST(PixelFilter, BlackmanHarrisInverse) {
    EXPECT_EQ(blackman_harris_inverse(0.5f), 0.5f);
    float last = 0;
    for (int i = 0; i < 1 << 16; ++i) {
        const float u = static_cast<float>(i) * 0x1p-16f, x = blackman_harris_inverse(u);
        const float below = blackman_harris(min_of(x, 1 - x)).cumulative;
        EXPECT_NEAR(x < 0.5f ? below : 1 - below, u, 7e-7f);
        EXPECT_GE(x, last - 1e-6f);
        EXPECT_LE(x, 1.0f);
        last = x;
    }
    EXPECT_LE(blackman_harris_inverse(1 - 0x1p-24f), 1.0f);
    EXPECT_NEAR(blackman_harris(0.5f).cumulative, 0.5f, 1e-6);
    EXPECT_NEAR(blackman_harris(0).density, 0, 2e-4);
}

}  // namespace
}  // namespace vlp::test
