// What a ray precomputes for boxes, triangles and spheres.
#pragma once

#include "bvh/layout.h"
#include "core/ray.h"
#include "geometry/triangle.h"

namespace vlp {

// A plane x = b of a box is entered at t = b * slope + entry and left at b * slope + exit. The entry is rounded down and
// the exit up, by more than the rounding errors of slope and offset, and boxes are wider by more than what b adds to them
// (k_box_margin): no box is missed whose triangles the watertight test would hit (Ize 2013).
struct TraversalRay {
    Vec3 origin, direction;
    float slope[3], entry[3], exit[3];
    uint32_t near_row[3], far_row[3];  // rows of BvhNode::bounds
    ShearedRay sheared;
};

VLP_HD VLP_FORCE_INLINE TraversalRay make_traversal_ray(Vec3 origin, Vec3 direction) {
    constexpr float k_offset_error = 0x1p-21f;
    constexpr float k_max_offset = 0x1p126f;  // keeps times numbers
    TraversalRay r;
    r.origin = origin, r.direction = direction;
    const float o[3] = {origin.x, origin.y, origin.z}, d[3] = {direction.x, direction.y, direction.z};
    // A component that is 0, or too small to invert, becomes so small a number that it moves nothing.
    const float least = 1e-18f * max_of(std::fabs(d[0]), max_of(std::fabs(d[1]), std::fabs(d[2])));
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const float safe = std::fabs(d[axis]) < least ? std::copysign(least, d[axis]) : d[axis];
        const float slope = 1.0f / safe, offset = max_of(min_of(-o[axis] * slope, k_max_offset), -k_max_offset);
        const float error = std::fabs(offset) * k_offset_error;
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
