// Light from infinity sent through portals: half of what is drawn goes through one of them, the other half anywhere.
//
// A light path's ray of given direction has its position from the disc of the whole scene or from one as wide as a portal; next
// event of the environment takes its direction from the picture or from the cone that a portal is seen in. Densities are
// those of the mixture, so that nothing is left out and the weights are exact.
#pragma once

#include "core/frame.h"
#include "core/warp.h"
#include "light/light_data.h"

namespace vlp {

inline constexpr float k_portal_share = 0.5f;

// The portal that `u` chooses, or k_none: none of them. `u` becomes what is left of it, in [0, 1).
VLP_HD inline uint32_t choose_portal(const Portals& portals, float& u) {
    constexpr float k_below_one = 1 - 0x1p-24f;
    if (u >= k_portal_share) {
        u = min_of((u - k_portal_share) / (1 - k_portal_share), k_below_one);
        return k_none;
    }
    u /= k_portal_share;
    uint32_t i = 0;
    for (; i + 1 < portals.count && u >= portals.share[i]; ++i) u -= portals.share[i];
    u = min_of(u / portals.share[i], k_below_one);
    return i;
}

// The ends of infinite lights' paths: a disc as wide as the scene that touches its sphere from behind.
VLP_HD inline Vec3 sample_scene_disc(Vec3 center, float radius, Vec3 direction, Vec2 u) {
    constexpr float k_beyond = 1.01f;  // so that rounding cannot put the disc inside the sphere
    const Vec2 d = radius * sample_disc(u);
    const Frame frame = make_frame(direction);
    return center + frame.tangent * d.x + frame.bitangent * d.y - direction * (k_beyond * radius);
}

VLP_HD inline float pdf_scene_disc(float radius) { return k_inv_pi / square(radius); }

// The same disc, where half of its points lie before a portal.
VLP_HD inline Vec3 sample_scene_disc(const Portals& portals, Vec3 center, float radius, Vec3 direction, Vec2 u) {
    if (portals.count == 0) return sample_scene_disc(center, radius, direction, u);
    const uint32_t i = choose_portal(portals, u.x);
    if (i == k_none) return sample_scene_disc(center, radius, direction, u);
    const Vec3 p = sample_scene_disc(portals.center[i], portals.radius[i], direction, u);
    const Vec3 on_plane = sample_scene_disc(center, radius, direction, {0.5f, 0.5f});
    return p - direction * dot(p - on_plane, direction);
}

// `point`: any of the ray.
VLP_HD inline float pdf_scene_disc(const Portals& portals, float radius, Vec3 point, Vec3 direction) {
    const float anywhere = pdf_scene_disc(radius);
    if (portals.count == 0) return anywhere;
    float through = 0;
    for (uint32_t i = 0; i < portals.count; ++i) {
        const float off_axis = length_squared(cross(point - portals.center[i], direction));
        if (off_axis <= square(portals.radius[i])) through += portals.share[i] * pdf_scene_disc(portals.radius[i]);
    }
    return (1 - k_portal_share) * anywhere + k_portal_share * through;
}

// Portal i as a receiver sees it: the square of the sine of half its angle. 1: it counts as all around, as a receiver within it
// sees it, and one so far that single precision does not tell its directions apart.
VLP_HD inline float portal_sin_squared(const Portals& portals, uint32_t i, Vec3 to_center) {
    constexpr float k_least = 1e-6f;
    const float sin_squared = square(portals.radius[i]) / length_squared(to_center);
    return sin_squared > k_least && sin_squared < 1 ? sin_squared : 1.0f;
}

// A direction from `receiver` to portal i; false where that is all around.
VLP_HD inline bool sample_through_portal(const Portals& portals, uint32_t i, Vec3 receiver, Vec2 u, Vec3& direction) {
    const Vec3 to = portals.center[i] - receiver;
    const float sin_squared = portal_sin_squared(portals, i, to);
    if (sin_squared == 1) return false;
    direction = make_frame(normalize(to)).to_world(sample_cone(u, one_minus_cos_of(sin_squared)));
    return true;
}

// Density per solid angle of what next event draws, `anywhere` being that of the environment itself.
VLP_HD inline float pdf_through_portals(const Portals& portals, float anywhere, Vec3 receiver, Vec3 direction) {
    float through = 0;
    for (uint32_t i = 0; i < portals.count; ++i) {
        const Vec3 to = portals.center[i] - receiver;
        const float sin_squared = portal_sin_squared(portals, i, to);
        if (sin_squared == 1) {
            through += portals.share[i] * anywhere;
        } else if (dot(to, direction) > 0 && length_squared(cross(to, direction)) <= square(portals.radius[i])) {
            through += portals.share[i] * pdf_cone(one_minus_cos_of(sin_squared));
        }
    }
    return (1 - k_portal_share) * anywhere + k_portal_share * through;
}

}  // namespace vlp
