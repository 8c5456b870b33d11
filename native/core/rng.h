// Integer hashes: random numbers that depend on their key alone.
#pragma once

#include <cstdint>

#include "core/device.h"

namespace vlp {

// A permutation of 32 bits with low bias (Wellons 2018, "lowbias32").
VLP_HD constexpr uint32_t hash(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

VLP_HD constexpr uint32_t hash(uint32_t a, uint32_t b) { return hash(a ^ hash(b + 0x9e3779b9u)); }
VLP_HD constexpr uint32_t hash(uint32_t a, uint32_t b, uint32_t c) { return hash(a, hash(b, c)); }

}  // namespace vlp
