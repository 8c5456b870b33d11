// Owen-scrambled Sobol points (Burley 2020), padded in pairs of dimensions: random numbers of (seed, index, dimension).
#pragma once

#include "core/rng.h"
#include "core/vec.h"

namespace vlp {

VLP_HD inline uint32_t reverse_bits(uint32_t x) {
#if VLP_ON_DEVICE
    return __brev(x);
#else
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
#if defined(__SSE2__) && !defined(__SSSE3__)
    // These vectors can't shuffle bytes: an order that compilers don't take for a byte swap, or loops stay scalar.
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    return (x >> 16) | (x << 16);
#else
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    return __builtin_bswap32(x);
#endif
#endif
}

// Owen's nested uniform scramble of a bit-reversed number: every bit is flipped by a hash of the bits below it
// (Laine & Karras 2011, with the constants that Vegdahl found in 2021).
VLP_HD constexpr uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The second Sobol dimension of `index`, bit-reversed: Pascal's triangle modulo 2 times the bits, one butterfly a level.
VLP_HD constexpr uint32_t sobol_second_reversed(uint32_t index) {
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    index ^= (index >> 16) & 0x0000ffffu;
    return index;
}

// In [0, 1): the upper 24 bits, so that the largest is 1 - 2^-24.
VLP_HD constexpr float unit_float(uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

// One draw: two numbers, as bits.
struct SamplePair {
    uint32_t x, y;
};

// Each draw takes the next pair of dimensions of a (0, 2)-sequence whose order is shuffled anew by (seed, dimension), so
// that any 2^k successive indices are stratified in each draw and draws are independent. `index` is bit-reversed.
VLP_HD inline SamplePair sample_pair(uint32_t seed, uint32_t index, uint32_t dimension) {
    const uint32_t key = hash(seed, dimension);
    const uint32_t shuffled = reverse_bits(scramble_reversed(index, key));
    return {reverse_bits(scramble_reversed(shuffled, key * 0x9e3779b1u + 0x7f4a7c15u)),
            reverse_bits(scramble_reversed(sobol_second_reversed(shuffled), key * 0x85ebca77u + 0xc2b2ae3du))};
}

// The numbers of one path. A host computes the draws of a block of dimensions at once, in the lanes of its vectors, when
// one of them is asked for: most of what a step of a walk draws lies in one block.
struct Sampler {
    static constexpr uint32_t k_block = 8;

    uint32_t seed = 0;  // of the pixel or of the set of light paths
    uint32_t index = 0;  // of the path in its sequence, bit-reversed
    uint32_t dimension = 0;  // of the next draw

    VLP_HD uint32_t next_bits() { return next_pair().x; }
    VLP_HD float next() { return unit_float(next_bits()); }
    VLP_HD Vec2 next_2d() {
        const SamplePair pair = next_pair();
        return {unit_float(pair.x), unit_float(pair.y)};
    }
    VLP_HD SamplePair next_pair() {
        const uint32_t d = dimension++;
        if constexpr (VLP_ON_DEVICE) return sample_pair(seed, index, d);
        if (d / k_block != block_) compute_block(d / k_block);
        return {x_[d % k_block], y_[d % k_block]};
    }

private:
    VLP_HD void compute_block(uint32_t block) {
        block_ = block;
        for (uint32_t i = 0; i < k_block; ++i) {
            const SamplePair pair = sample_pair(seed, index, block * k_block + i);
            x_[i] = pair.x, y_[i] = pair.y;
        }
    }

    uint32_t block_ = k_none;  // whose draws are in x_ and y_
    uint32_t x_[k_block], y_[k_block];
};

VLP_HD inline Sampler make_sampler(uint32_t seed, uint32_t index) {
    Sampler sampler;
    sampler.seed = seed;
    sampler.index = reverse_bits(index);
    return sampler;
}

}  // namespace vlp
