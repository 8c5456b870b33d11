// An orthonormal basis around a normal (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
#pragma once

#include "core/vec.h"

namespace vlp {

struct Frame {
    Vec3 tangent, bitangent, normal;

    VLP_HD Vec3 to_local(Vec3 w) const { return {dot(w, tangent), dot(w, bitangent), dot(w, normal)}; }
    VLP_HD Vec3 to_world(Vec3 w) const { return tangent * w.x + bitangent * w.y + normal * w.z; }
};

VLP_HD inline Frame make_frame(Vec3 normal) {
    // The frame jumps where this changes: not at 0, or rounding would tell those of one upright wall apart.
    const float sign = normal.z < -0.25f ? -1.0f : 1.0f;
    const float a = -1.0f / (sign + normal.z);
    const float b = normal.x * normal.y * a;
    return {{1.0f + sign * normal.x * normal.x * a, sign * b, -sign * normal.x},
            {b, sign + normal.y * normal.y * a, -normal.y},
            normal};
}

}  // namespace vlp
