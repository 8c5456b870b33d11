// A point of a surface, as shading sees it.
#pragma once

#include "core/vec.h"

namespace vlp {

struct SurfacePoint {
    Vec3 position;
    Vec3 geometric_normal, shading_normal;  // unit, outside
    Vec2 uv;
    uint32_t material = 0, instance = 0, primitive = 0;
};

}  // namespace vlp
