// Ray-sphere intersection with one square root, precise for small, large and distant spheres.
#pragma once

#include "core/vec.h"

namespace vlp {

struct SphereRoots {
    float near_t, far_t;
    bool found;
};

// Haines et al., Ray Tracing Gems (2019), ch. 7: the discriminant from the distance of centre and line, which does not
// cancel, and the smaller root through the product of the roots. `direction` need not have unit length.
VLP_HD inline SphereRoots intersect_sphere(Vec3 origin, Vec3 direction, Vec3 center, float radius) {
    const Vec3 f = origin - center;
    const float a = dot(direction, direction);
    const float half_b = -dot(f, direction);
    const float discriminant = square(radius) - length_squared(f + direction * (half_b / a));
    if (!(discriminant >= 0)) return {0, 0, false};
    const float q = half_b + std::copysign(std::sqrt(a * discriminant), half_b);
    const float t0 = q != 0 ? (length_squared(f) - square(radius)) / q : 0.0f, t1 = q / a;
    return {min_of(t0, t1), max_of(t0, t1), true};
}

// The first root in (0, t_max), or infinity. `from`: the ray starts on this sphere, so the root nearest to 0 is the start
// itself; `to`: the ray ends on it, so the root nearest to t_max is the end. The other root still counts: a ray may cross
// a glass ball, and a ball may hide its own back.
VLP_HD inline float first_root(const SphereRoots& roots, float t_max, bool from, bool to) {
    bool use_near = roots.near_t > 0 && roots.near_t < t_max;
    bool use_far = roots.far_t > 0 && roots.far_t < t_max;
    if (from) (std::fabs(roots.near_t) <= std::fabs(roots.far_t) ? use_near : use_far) = false;
    if (to) (std::fabs(roots.near_t - t_max) <= std::fabs(roots.far_t - t_max) ? use_near : use_far) = false;
    return use_near ? roots.near_t : use_far ? roots.far_t : k_infinity;
}

}  // namespace vlp
