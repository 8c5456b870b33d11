// Rays, and origins that do not hit the surface they leave.
#pragma once

#include "core/bits.h"
#include "core/vec.h"

namespace vlp {

struct Ray {
    Vec3 origin;
    Vec3 direction;  // unit length in world space
    float t_max = k_infinity;
};

// Moves `p` off a surface along its geometric normal `n`, which points to the side the ray leaves on.
// Steps in units in the last place, so that it works at every scale (Wächter & Binder, Ray Tracing Gems, ch. 6).
VLP_HD inline Vec3 offset_origin(Vec3 p, Vec3 n) {
    constexpr float k_near_zero = 1.0f / 32.0f, k_small_step = 1.0f / 65536.0f, k_ulps = 256.0f;
    const auto step = [&](float x, float nx) {
        const int32_t ulps = static_cast<int32_t>(std::copysign(k_ulps, x) * nx);  // away from 0, whichever side
        const float moved = float_of(bits_of(x) + ulps);
        return std::fabs(x) < k_near_zero ? x + k_small_step * nx : moved;
    };
    return {step(p.x, n.x), step(p.y, n.y), step(p.z, n.z)};
}

}  // namespace vlp
