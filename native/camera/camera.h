// Cameras: rays into the scene from a point on the film and one on the lens.
#pragma once

#include "core/ray.h"
#include "core/transform.h"

namespace vlp {

// The same numbers as vlp_bpt.scene.Projection.
enum class Projection : uint8_t { perspective, orthographic };

struct Camera {
    Projection projection = Projection::perspective;
    Affine camera_to_world;      // rigid: right, up and backward are unit columns
    Vec2 half_size{0.36f, 0.36f};  // perspective: tangents of half the view; orthographic: metres
    Vec2 shift;                  // of the film's centre, in the unit of half_size
    float clip_start = 0, clip_end = k_infinity;  // along the view direction (m)
    float aperture_radius = 0, focus_distance = 1;
    uint32_t width = 1, height = 1;  // full resolution (pixels)
};

}  // namespace vlp
