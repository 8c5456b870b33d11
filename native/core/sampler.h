// Owen-scrambled Sobol points (Burley 2020), padded in pairs of dimensions: random numbers of (seed, index, dimension).
#pragma once

#include "core/rng.h"
#include "core/vec.h"

namespace vlp {

VLP_HD inline uint32_t reverse_bits(uint32_t x) {
#if VLP_ON_DEVICE
    return __brev(x);
#else
    x = __builtin_bswap32(x);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
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

// The numbers of one path. Each draw takes the next pair of dimensions of a (0, 2)-sequence whose order is shuffled
// anew by (seed, dimension), so that any 2^k successive indices are stratified in each draw and draws are independent.
struct Sampler {
    uint32_t seed = 0;  // of the pixel or of the set of light paths
    uint32_t index = 0;  // of the path in its sequence, bit-reversed
    uint32_t dimension = 0;  // of the next draw

    VLP_HD uint32_t next_bits() {
        const uint32_t key = hash(seed, dimension++);
        const uint32_t shuffled = reverse_bits(scramble_reversed(index, key));
        return reverse_bits(scramble_reversed(shuffled, key * 0x9e3779b1u + 0x7f4a7c15u));
    }

    VLP_HD float next() { return unit_float(next_bits()); }

    VLP_HD Vec2 next_2d() {
        const uint32_t key = hash(seed, dimension++);
        const uint32_t shuffled = reverse_bits(scramble_reversed(index, key));
        const uint32_t x = reverse_bits(scramble_reversed(shuffled, key * 0x9e3779b1u + 0x7f4a7c15u));
        const uint32_t y =
            reverse_bits(scramble_reversed(sobol_second_reversed(shuffled), key * 0x85ebca77u + 0xc2b2ae3du));
        return {unit_float(x), unit_float(y)};
    }
};

VLP_HD inline Sampler make_sampler(uint32_t seed, uint32_t index) { return {seed, reverse_bits(index), 0}; }

}  // namespace vlp
