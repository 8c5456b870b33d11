// From film positions in pixels to the plane that a camera looks through, and back.
#pragma once

#include "camera/camera.h"

namespace vlp {

// A ray in camera space: x right, y up, looking along -z.
struct LensRay {
    Vec3 origin, direction;
};

// Perspective: on the plane at distance 1; orthographic: metres.
VLP_HD inline Vec2 film_to_plane(const Camera& camera, Vec2 film) {
    return {(2 * film.x / static_cast<float>(camera.width) - 1) * camera.half_size.x + camera.shift.x,
            (2 * film.y / static_cast<float>(camera.height) - 1) * camera.half_size.y + camera.shift.y};
}

VLP_HD inline Vec2 plane_to_film(const Camera& camera, Vec2 plane) {
    return {((plane.x - camera.shift.x) / camera.half_size.x + 1) * 0.5f * static_cast<float>(camera.width),
            ((plane.y - camera.shift.y) / camera.half_size.y + 1) * 0.5f * static_cast<float>(camera.height)};
}

// Of that plane, one pixel.
VLP_HD inline float pixel_area(const Camera& camera) {
    return (2 * camera.half_size.x / static_cast<float>(camera.width)) *
           (2 * camera.half_size.y / static_cast<float>(camera.height));
}

}  // namespace vlp
