// Independent random numbers for tests, apart from the renderer's own sequences.
#pragma once

#include "core/rng.h"
#include "core/vec.h"

namespace vlp::test {

// In [0, 1), of a seed: a counter through a hash.
struct Random {
    uint32_t seed = 0, counter = 0;

    float next() { return static_cast<float>(hash(seed, counter++, 0x51ed270bu) >> 8) * 0x1p-24f; }
    Vec2 next_2d() {
        const float x = next();
        return {x, next()};
    }
};

}  // namespace vlp::test
