// Orthographic cameras: rays through the same lens point are parallel, and each pixel has a lens of its own.
#pragma once

#include "camera/film_plane.h"

namespace vlp {

VLP_HD inline Vec3 orthographic_direction(const Camera& camera, Vec2 lens) {
    return camera.aperture_radius > 0 ? normalize(Vec3{-lens.x, -lens.y, -camera.focus_distance}) : Vec3{0, 0, -1};
}

VLP_HD inline LensRay orthographic_ray(const Camera& camera, Vec2 film, Vec2 lens) {
    const Vec2 p = film_to_plane(camera, film) + lens;
    return {{p.x, p.y, 0}, orthographic_direction(camera, lens)};
}

VLP_HD inline Vec2 orthographic_film(const Camera& camera, Vec2 lens, Vec3 point) {
    const Vec3 d = orthographic_direction(camera, lens);
    const float along = point.z / d.z;
    return plane_to_film(camera, Vec2{point.x - along * d.x, point.y - along * d.y} - lens);
}

// Pixels a square metre that faces the rays.
VLP_HD inline float orthographic_pixels_per_area(const Camera& camera, float cosine) {
    return 1 / (pixel_area(camera) * cosine);
}

}  // namespace vlp
