// Camera rays from points on film and lens, and the way back from a point of the scene to the film.
//
// One number joins the two: `pixels_per_area`, the film area (pixels²) whose rays from one lens point pass through a
// square metre at the scene point that faces them. An eye path through a film density h (per pixel², the filter's)
// reaches a surface with density h pixels_per_area |cos| per m². A light path's vertex with throughput beta and
// scattering f adds beta f |cos| pixels_per_area h to the pixel: the camera's importance and the geometry term in one.
#pragma once

#include "camera/orthographic.h"
#include "camera/perspective.h"
#include "core/warp.h"

namespace vlp {

VLP_HD inline Vec3 camera_to_local(const Camera& camera, Vec3 direction) {
    const Affine& m = camera.camera_to_world;
    return {dot(direction, m.column(0)), dot(direction, m.column(1)), dot(direction, m.column(2))};
}

VLP_HD inline float cosine_to_view(const Camera& camera, Vec3 direction) {
    return -dot(direction, camera.camera_to_world.column(2));
}

// A point of the lens (m); the same one for every film position.
VLP_HD inline Vec2 sample_lens(const Camera& camera, Vec2 u) {
    return camera.aperture_radius > 0 ? camera.aperture_radius * sample_disc(u) : Vec2{};
}

// From the near clip plane to the far one. `film` in pixels, (0, 0) at the bottom left corner.
VLP_HD inline Ray camera_ray(const Camera& camera, Vec2 film, Vec2 lens) {
    const LensRay local = camera.projection == Projection::perspective ? perspective_ray(camera, film, lens)
                                                                       : orthographic_ray(camera, film, lens);
    const float per_depth = -1 / local.direction.z;
    const Vec3 origin = local.origin + local.direction * (camera.clip_start * per_depth);
    return {transform_point(camera.camera_to_world, origin),
            normalize(transform_vector(camera.camera_to_world, local.direction)),
            (camera.clip_end - camera.clip_start) * per_depth};
}

VLP_HD inline Ray sample_ray(const Camera& camera, Vec2 film, Vec2 u_lens) {
    return camera_ray(camera, film, sample_lens(camera, u_lens));
}

// How far before a camera ray's origin the lens lies.
VLP_HD inline float distance_from_lens(const Camera& camera, const Ray& ray) {
    return camera.clip_start / cosine_to_view(camera, ray.direction);
}

// See the top. `distance` from the lens to the point.
VLP_HD inline float pixels_per_area(const Camera& camera, Vec3 direction, float distance) {
    const float cosine = cosine_to_view(camera, direction);
    return camera.projection == Projection::perspective
               ? perspective_pixels_per_steradian(camera, cosine) / square(distance)
               : orthographic_pixels_per_area(camera, cosine);
}

struct FilmProjection {
    bool valid = false;  // between the clip planes; `film` may lie outside the picture
    Vec2 film;  // pixels
    Vec3 lens;  // the lens point in the scene
    Vec3 direction;  // from it to the point
    float distance = 0;  // negative behind the lens of an orthographic camera
    float pixels_per_area = 0;
};

VLP_HD inline FilmProjection project(const Camera& camera, Vec2 lens, Vec3 point) {
    const Vec3 p = camera_to_local(camera, point - camera.camera_to_world.column(3));
    FilmProjection r;
    const bool perspective = camera.projection == Projection::perspective;
    const bool in_view = -p.z >= camera.clip_start && -p.z <= camera.clip_end && (!perspective || -p.z > 0);
    if (!in_view) return r;
    Vec3 from{lens.x, lens.y, 0}, direction;
    if (perspective) {
        r.film = perspective_film(camera, lens, p);
        r.distance = length(p - from);
        direction = (p - from) / r.distance;
    } else {  // rays may begin behind the lens
        r.film = orthographic_film(camera, lens, p);
        direction = orthographic_direction(camera, lens);
        r.distance = p.z / direction.z;
        from = p - direction * r.distance;
    }
    r.lens = transform_point(camera.camera_to_world, from);
    r.direction = transform_vector(camera.camera_to_world, direction);
    r.pixels_per_area = pixels_per_area(camera, r.direction, r.distance);
    r.valid = is_finite(r.pixels_per_area) && is_finite(r.film.x) && is_finite(r.film.y);
    return r;
}

}  // namespace vlp
