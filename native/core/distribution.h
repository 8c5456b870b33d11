// Discrete distributions by inversion, which keeps the stratification of the numbers that drive it.
#pragma once

#include "core/vec.h"

namespace vlp {

// Cumulative probabilities in units of 2^-32, so that an index is drawn exactly as often as `pdf` says: index i takes
// the numbers from below[i] up to below[i + 1] (2^32 for the last).
struct Distribution {
    const uint32_t* below = nullptr;
    uint32_t count = 0;
};

struct DiscreteSample {
    uint32_t index;
    float pdf;
};

VLP_HD inline float pdf(const Distribution& d, uint32_t index) {
    const uint32_t end = index + 1 < d.count ? d.below[index + 1] : 0u;  // 0 stands for 2^32
    const uint32_t width = end - d.below[index];
    return width == 0 && d.count == 1 ? 1.0f : static_cast<float>(width) * 0x1p-32f;
}

// `count` must not be 0.
VLP_HD inline DiscreteSample sample(const Distribution& d, uint32_t u) {
    uint32_t low = 0, high = d.count;
    while (high - low > 1) {
        const uint32_t middle = (low + high) / 2;
        (d.below[middle] <= u ? low : high) = middle;
    }
    return {low, pdf(d, low)};
}

// By a number in [0, 1); `rest` is where it lies between those of the index, in [0, 1).
VLP_HD inline DiscreteSample sample(const Distribution& d, float u, float& rest) {
    const uint32_t bits = static_cast<uint32_t>(u * 0x1p32f);
    const DiscreteSample s = sample(d, bits);
    rest = min_of(static_cast<float>(bits - d.below[s.index]) * 0x1p-32f / s.pdf, 1 - 0x1p-24f);
    return s;
}

}  // namespace vlp
