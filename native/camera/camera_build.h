// Cameras from Blender's parameters (host only).
#pragma once

#include <optional>

#include "camera/camera.h"

namespace vlp {

// The fields of vlp_bpt.scene.Camera and the film's full resolution.
struct CameraParameters {
    Affine transform;
    Projection projection = Projection::perspective;
    Vec2 half_size{0.36f, 0.36f}, shift;
    float clip_start = 0, clip_end = k_infinity;
    float aperture_radius = 0, focus_distance = 1;
    uint32_t width = 1, height = 1;
};

// Scale is taken out of the transform, as Cycles does. Nothing if the transform is singular, the view or the film is
// empty, or a number isn't finite (clip_end may be infinite).
std::optional<Camera> make_camera(const CameraParameters& parameters);

}  // namespace vlp
