// Numbers as their bits.
#pragma once

#include <cstdint>

#include "core/device.h"

namespace vlp {

VLP_HD inline int32_t bits_of(float x) {
    int32_t i;
    __builtin_memcpy(&i, &x, sizeof i);
    return i;
}
VLP_HD inline float float_of(int32_t i) {
    float x;
    __builtin_memcpy(&x, &i, sizeof x);
    return x;
}

}  // namespace vlp
