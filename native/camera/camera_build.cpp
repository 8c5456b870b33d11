// Cameras from Blender's parameters.
#include "camera/camera_build.h"

namespace vlp {

std::optional<Camera> make_camera(const CameraParameters& p) {
    constexpr float k_min_focus_distance =
        1e-5f;  // nearer than any lens focuses; 0 would leave rays without a direction
    const Vec3 x = p.transform.column(0), y = p.transform.column(1), z = p.transform.column(2),
               o = p.transform.column(3);
    if (!(length(x) > 0 && length(y) > 0 && length(z) > 0) || !is_finite(o)) return std::nullopt;
    const Vec3 backward = normalize(z);
    const Vec3 sideways = normalize(x) - backward * dot(normalize(x), backward);
    if (!(length(sideways) > 1e-4f)) return std::nullopt;
    const Vec3 right = normalize(sideways);
    const Vec3 third = cross(backward, right);
    const float turn = dot(third, normalize(y));
    if (!(std::fabs(turn) > 1e-4f)) return std::nullopt;
    const Vec3 up = turn < 0 ? -third : third;
    const bool sizes = p.half_size.x > 0 && p.half_size.y > 0 && is_finite(p.half_size.x) && is_finite(p.half_size.y);
    const bool behind = p.clip_start < 0 && p.projection == Projection::perspective;
    const bool clips = !behind && p.clip_end > p.clip_start && is_finite(p.clip_start);
    const bool lens = p.aperture_radius >= 0 && is_finite(p.aperture_radius) && is_finite(p.focus_distance);
    const bool shift = is_finite(p.shift.x) && is_finite(p.shift.y);
    if (!sizes || !clips || !lens || !shift || p.width == 0 || p.height == 0) return std::nullopt;

    Camera c;
    c.projection = p.projection;
    const Vec3 columns[4] = {right, up, backward, o};
    for (int j = 0; j < 4; ++j) {
        c.camera_to_world.m[0][j] = columns[j].x;
        c.camera_to_world.m[1][j] = columns[j].y;
        c.camera_to_world.m[2][j] = columns[j].z;
    }
    c.half_size = p.half_size;
    c.shift = p.shift;
    c.clip_start = p.clip_start;
    c.clip_end = p.clip_end;
    c.aperture_radius = p.aperture_radius;
    c.focus_distance = max_of(p.focus_distance, k_min_focus_distance);
    c.width = p.width;
    c.height = p.height;
    return c;
}

}  // namespace vlp
