// Perspective cameras: the ray of a film point leaves any point of the lens toward one point of the plane of focus.
#pragma once

#include "camera/film_plane.h"

namespace vlp {

VLP_HD inline LensRay perspective_ray(const Camera& camera, Vec2 film, Vec2 lens) {
    const Vec2 p = film_to_plane(camera, film);
    const float f = camera.aperture_radius > 0 ? camera.focus_distance : 1.0f;
    return {{lens.x, lens.y, 0}, normalize(Vec3{p.x * f - lens.x, p.y * f - lens.y, -f})};
}

// The film point whose ray from `lens` passes through `point`, which lies in front of the camera.
VLP_HD inline Vec2 perspective_film(const Camera& camera, Vec2 lens, Vec3 point) {
    const float inverse_depth = -1 / point.z;
    const Vec2 pinhole = (Vec2{point.x, point.y} - lens) * inverse_depth;
    return plane_to_film(camera, camera.aperture_radius > 0 ? pinhole + lens * (1 / camera.focus_distance) : pinhole);
}

// Pixels a steradian: the plane of focus F away shows pixel_area F² of itself to a pixel, at distance F / cosine,
// tilted.
VLP_HD inline float perspective_pixels_per_steradian(const Camera& camera, float cosine) {
    return 1 / (pixel_area(camera) * cosine * cosine * cosine);
}

}  // namespace vlp
