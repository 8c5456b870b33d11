// Unit vectors in 32 bits: octahedral maps with 16 bits an axis (Cigolle et al. 2014).
#pragma once

#include "scene/scene_view.h"

namespace vlp {

namespace detail {

// Folds the lower half of the octahedron over the diagonals of the square, and back: the fold is its own inverse.
VLP_HD inline Vec2 fold(Vec2 p) {
    return {std::copysign(1.0f - std::fabs(p.y), p.x), std::copysign(1.0f - std::fabs(p.x), p.y)};
}

// [-1, 1] in 65535 steps, so that 0 and both ends are exact: axis-aligned normals survive.
VLP_HD inline uint32_t quantise(float x) {
    return static_cast<uint32_t>(std::floor(clamp(x, -1.0f, 1.0f) * 32767.0f + 0.5f) + 32767.0f);
}
VLP_HD inline float dequantise(uint32_t bits) { return (static_cast<float>(bits) - 32767.0f) * (1.0f / 32767.0f); }

}  // namespace detail

// `n` need not have unit length; the zero vector encodes +z.
VLP_HD inline OctNormal encode(Vec3 n) {
    const float sum = std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z);
    const float scale = sum > 0 ? 1.0f / sum : 0.0f;
    Vec2 p{n.x * scale, n.y * scale};
    if (n.z < 0) p = detail::fold(p);
    return {detail::quantise(p.x) | detail::quantise(p.y) << 16};
}

VLP_HD inline Vec3 decode(OctNormal n) {
    Vec2 p{detail::dequantise(n.bits & 0xffffu), detail::dequantise(n.bits >> 16)};
    const float z = 1.0f - std::fabs(p.x) - std::fabs(p.y);
    if (z < 0) p = detail::fold(p);
    return normalize({p.x, p.y, z});
}

}  // namespace vlp
