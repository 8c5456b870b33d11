// Where samples go: deviations of pixels, smoothed, and the levels that suit them.
#include "film/sample_rates.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

namespace vlp {
namespace {

constexpr uint32_t k_first_block = 4;  // iterations
// A pixel's own variance is known badly, and a pixel that has not met its speck yet seems to have none: it is the mean over
// the pixels around, up to so far, that counts, and this share of what deviates on average is added everywhere.
constexpr int k_radius = 2;
constexpr float k_least_share = 0.1f;

// Means over 2 k_radius + 1 values along lines: `count` lines that begin `next_line` apart, of `size` values `stride` apart.
void smooth(std::span<const float> from, std::span<float> to, size_t count, size_t next_line, size_t size,
            size_t stride) {
    for (size_t line = 0; line < count; ++line) {
        const float* const values = from.data() + line * next_line;
        for (size_t i = 0; i < size; ++i) {
            const size_t begin = i < k_radius ? 0 : i - k_radius, end = std::min(i + k_radius + 1, size);
            float sum = 0;
            for (size_t k = begin; k < end; ++k) sum += values[k * stride];
            to[line * next_line + i * stride] = sum / static_cast<float>(end - begin);
        }
    }
}

// Deviations in eighths of an octave, so that all scales can be tried on a table of how often each occurs.
constexpr int k_steps = 8, k_range = 60 * k_steps;

int bin_of(float deviation) {
    if (!(deviation > 0)) return -k_range;
    return std::clamp(static_cast<int>(std::floor(std::log2(deviation) * k_steps)), -k_range, k_range);
}

int level_of(int bin, int scale) {
    const int level = static_cast<int>(std::floor(static_cast<float>(bin + scale) / k_steps + 0.5f));
    return std::clamp(level, k_least_level, k_most_level);
}

}  // namespace

std::vector<int8_t> levels_for(std::span<const float> deviation) {
    std::array<uint32_t, 2 * k_range + 1> pixels{};
    for (const float x : deviation) ++pixels[bin_of(x) + k_range];
    const auto samples = [&](int scale) {
        double sum = 0;
        for (int bin = -k_range; bin <= k_range; ++bin) sum += std::ldexp(pixels[bin + k_range], level_of(bin, scale));
        return sum;
    };
    int scale = 2 * k_range;
    while (scale > -2 * k_range && samples(scale) > static_cast<double>(deviation.size())) --scale;
    std::vector<int8_t> levels(deviation.size());
    std::transform(deviation.begin(), deviation.end(), levels.begin(),
                   [&](float x) { return static_cast<int8_t>(level_of(bin_of(x), scale)); });
    return levels;
}

SampleRates SamplePlan::rates(uint32_t iteration, const int8_t* levels, const PixelMoments* moments) {
    if (!adaptive_) return {.index = iteration};
    if (iterations_ == 0) sequence_ = iteration;
    if (levels_.empty()) return {.sequence = sequence_, .index = iterations_};
    return {sequence_, iterations_, turn_, levels, moments};
}

uint64_t SamplePlan::finish_iteration() {
    const uint64_t samples = levels_.empty() ? window_.pixel_count()
                             : turn_ == 0    ? first_turn_
                                             : turns_[turn_ % std::size(turns_)];
    ++turn_;
    ++iterations_;
    due_ = adaptive_ && iterations_ >= k_first_block && std::has_single_bit(iterations_);
    return samples;
}

void SamplePlan::plan(std::span<const float> relative_variance) {
    const size_t width = window_.width, height = window_.height;
    std::vector<float> rows(relative_variance.size()), deviation(relative_variance.size());
    smooth(relative_variance, rows, height, width, width, 1);
    smooth(rows, deviation, width, 1, height, width);
    double sum = 0;
    for (float& x : deviation) sum += x = std::sqrt(x);
    const float least = k_least_share * static_cast<float>(sum / static_cast<double>(deviation.size()));
    for (float& x : deviation) x += least;
    levels_ = levels_for(deviation);
    turn_ = 0;
    due_ = false;
    count_samples();
}

void SamplePlan::count_samples() {
    first_turn_ = 0;
    std::fill(std::begin(turns_), std::end(turns_), 0);
    for (uint32_t pixel = 0; pixel < levels_.size(); ++pixel) {
        const int level = levels_[pixel];
        first_turn_ += 1u << std::max(level, 0);
        for (uint32_t turn = 0; turn < std::size(turns_); ++turn) {
            if (level >= 0 || is_drawn(level, turn + static_cast<uint32_t>(std::size(turns_)), pixel))
                turns_[turn] += 1u << std::max(level, 0);
        }
    }
}

}  // namespace vlp
