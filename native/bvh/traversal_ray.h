// What a ray precomputes for boxes, triangles and spheres.
#pragma once

#include "bvh/layout.h"
#include "core/ray.h"
#include "geometry/triangle.h"

namespace vlp {

// A plane x = b of a box is met at t = b * slope + offset. The entry's offset is rounded down and the exit's up, by more
// than their rounding errors, so that a box is never missed whose triangles the watertight test would hit (Ize 2013).
struct TraversalRay {
    Vec3 origin, direction;
    float slope[3], entry[3], exit[3];
    uint32_t near_row[3], far_row[3];  // rows of BvhNode::bounds
    ShearedRay sheared;
};

// The relative error of entry and exit times, as a factor on the exit.
inline constexpr float k_exit_factor = 1.0f + 0x1p-20f;

VLP_HD inline TraversalRay make_traversal_ray(Vec3 origin, Vec3 direction) {
    TraversalRay r;
    r.origin = origin, r.direction = direction;
    const float o[3] = {origin.x, origin.y, origin.z}, d[3] = {direction.x, direction.y, direction.z};
    // A component that is 0, or too small to invert, becomes so small a number that it moves nothing.
    const float least = 1e-18f * max_of(std::fabs(d[0]), max_of(std::fabs(d[1]), std::fabs(d[2])));
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const float safe = std::fabs(d[axis]) < least ? std::copysign(least, d[axis]) : d[axis];
        const float slope = 1.0f / safe, offset = -o[axis] * slope, error = std::fabs(offset) * 0x1p-22f;
        r.slope[axis] = slope, r.entry[axis] = offset - error, r.exit[axis] = offset + error;
        r.near_row[axis] = slope >= 0 ? axis : axis + 3;
        r.far_row[axis] = slope >= 0 ? axis + 3 : axis;
    }
    r.sheared = shear(origin, direction);
    return r;
}

// Finite, and with somewhere to go.
VLP_HD inline bool is_valid(const Ray& ray) {
    const float size = length_squared(ray.direction);
    return size > 0 && size < k_infinity && is_finite(ray.origin) && ray.t_max > 0;
}

}  // namespace vlp
