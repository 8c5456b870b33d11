// Independent random numbers for tests, apart from the renderer's own sequences.
#pragma once

#include "core/rng.h"
#include "core/warp.h"

namespace vlp::test {

// In [0, 1), of a seed: a counter through a hash.
struct Random {
    uint32_t seed = 0, counter = 0;

    uint32_t bits() { return hash(seed, counter++, 0x51ed270bu); }
    float next() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }
    Vec2 next_2d() {
        const float x = next();
        return {x, next()};
    }
    Vec3 direction() { return sample_sphere(next_2d()); }
};

}  // namespace vlp::test
