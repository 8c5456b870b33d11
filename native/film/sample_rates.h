// Adaptive sampling: how many samples an iteration takes in a pixel, more where it is noisier, without bias.
//
// Iterations fall into blocks, in which a pixel has a rate of 2^level samples an iteration. At level 0 and above it takes so
// many, and the iteration adds their mean. Below, it takes one sample in 2^-level iterations, and those in between add that
// one again. The rates come from the samples of earlier blocks alone. So how much a sample counts is settled before it is
// drawn, and what a pixel's samples count adds up to the number of iterations: the mean is unbiased at any time.
#pragma once

#include <span>
#include <vector>

#include "core/rng.h"
#include "core/vec.h"
#include "film/pixel_sample.h"
#include "film/window.h"

namespace vlp {

inline constexpr int k_least_level = -3, k_most_level = 4;

// Sums over the iterations that took samples in a pixel, of n samples with mean y: how noisy the eye walks are there.
struct PixelMoments {
    uint32_t count = 0;  // iterations
    uint32_t samples = 0;  // sum of n
    float first = 0;  // sum of n y
    float second = 0;  // sum of n y^2

    VLP_HD void add(const PixelSample& mean, uint32_t n) {
        const float y = min_of((mean.rgba[0] + mean.rgba[1] + mean.rgba[2]) * (1.0f / 3.0f), 1e9f);
        const float weight = static_cast<float>(n);
        count += 1, samples += n, first += weight * y, second += weight * y * y;
    }
    // The variance of one sample over (mean + 0.1)^2: errors count by what they are to the pixel, black ones aside.
    VLP_HD float relative_variance() const {
        if (count < 2) return 0;
        const float mean = first / static_cast<float>(samples), others = static_cast<float>(count - 1);
        return max_of(second - first * mean, 0.0f) / (others * square(mean + 0.1f));
    }
};

// An iteration's place among those of its device, and what is known of the pixels; no levels: one sample in each.
struct SampleRates {
    uint32_t sequence = 0;  // of random numbers
    uint32_t index = 0;  // in it, of the one sample where there are no levels
    uint32_t turn = 0;  // iterations of the block before this one
    const int8_t* levels = nullptr;
    const PixelMoments* moments = nullptr;  // where there are levels
};

// What one iteration does in a pixel. 0 samples: what the pixel added last is added again.
struct PixelTurn {
    uint32_t samples = 1;
    uint32_t sequence = 0, first_index = 0;  // their random numbers: so many successive points of this sequence
};

// Whether a pixel of this level below 0 takes its sample in this turn of a block: at different times in different pixels, so
// that all iterations take alike, but all of them first.
VLP_HD inline bool is_drawn(int level, uint32_t turn, uint32_t pixel) {
    return turn == 0 || ((turn + hash(pixel)) & ((1u << -level) - 1)) == 0;
}

VLP_HD inline PixelTurn turn_of(const SampleRates& rates, uint32_t pixel) {
    if (rates.levels == nullptr) return {1, rates.sequence, rates.index};
    const int level = rates.levels[pixel];
    if (level < 0 && !is_drawn(level, rates.turn, pixel)) return {0, 0, 0};
    return {1u << max_of(level, 0), rates.sequence, rates.moments[pixel].samples};
}

// The blocks of a render on one device (host only). Blocks end after 4, 8, 16 ... iterations; the first has no levels. Where
// sampling is not adaptive it never ends, and iteration i takes number i of each pixel's sequence. Else a device takes all
// numbers of a sequence of its own: devices that share the iterations would take some of one sequence twice.
class SamplePlan {
public:
    SamplePlan() = default;
    SamplePlan(Window window, bool adaptive) : window_(window), adaptive_(adaptive) {}

    // The place of the iteration that comes next. `levels` and `moments`: where it will find the plan's and the pixels'.
    SampleRates rates(uint32_t iteration, const int8_t* levels, const PixelMoments* moments);
    // The iteration is complete. Returns the samples that it took.
    uint64_t finish_iteration();
    // A block has ended: `plan` has to be called before the next iteration.
    bool due() const { return due_; }
    // Chooses levels by the pixels' relative variances, one sample a pixel and iteration on average.
    void plan(std::span<const float> relative_variance);
    std::span<const int8_t> levels() const { return levels_; }

private:
    void count_samples();

    Window window_;
    bool adaptive_ = false;
    std::vector<int8_t> levels_;  // none before the first plan
    uint32_t iterations_ = 0, sequence_ = 0, turn_ = 0;
    bool due_ = false;
    uint64_t first_turn_ = 0,
             turns_[1 << -k_least_level] = {};  // samples of the first turn, and of others by their remainder
};

// The cheapest levels for these deviations of one sample, one sample a pixel on average: as many samples as deviate, by
// Neyman's rule, within the bounds of levels. The levels below 0 may all fall on one turn: no iteration takes more than
// k_most_samples_a_pixel on average.
inline constexpr uint32_t k_most_samples_a_pixel = 2;
std::vector<int8_t> levels_for(std::span<const float> deviation);

}  // namespace vlp
