// Whether the processor's vector instructions can be used here.
#pragma once

#include "core/device.h"

#if defined(__AVX2__) && !VLP_ON_DEVICE
#define VLP_AVX2 1
#include <immintrin.h>
#else
#define VLP_AVX2 0
#endif
