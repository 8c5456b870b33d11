// The weights once more, the slow obvious way, to test the quick ones by: all densities of a full path, in double (host only).
#pragma once

#include <vector>

#include "bsdf/bsdf.h"
#include "integrator/light_density.h"
#include "integrator/pass.h"

namespace vlp::reference {

struct PathVertex {
    SurfacePoint surface;  // the lens has a position alone, the light also its emission normal
    bool specular = false;  // scatters by a delta distribution
    Vec3 to_light{}, to_eye{};  // unit, to x_{i-1} and x_{i+1}
};

// x_0 ... x_{n-1} from the light to the lens.
struct Path {
    uint32_t light = k_none;
    Vec3 to_infinity{};  // from x_1 to the light, where it is infinite; x_0 has no position then
    std::vector<PathVertex> x;

    uint32_t size() const { return static_cast<uint32_t>(x.size()); }
};

struct Vec3d {
    double x, y, z;
};
inline Vec3d between(Vec3 from, Vec3 to) {
    return {double{to.x} - from.x, double{to.y} - from.y, double{to.z} - from.z};
}
inline double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3d wide(Vec3 v) { return {v.x, v.y, v.z}; }
inline Vec3 unit(Vec3d v) {
    const double s = 1 / std::sqrt(dot(v, v));
    return {static_cast<float>(v.x * s), static_cast<float>(v.y * s), static_cast<float>(v.z * s)};
}

// The directions, from the points. Both ends of an edge must differ.
inline void set_directions(const SceneView& scene, Path& path) {
    const bool infinite = is_infinite(scene.lights[path.light]);
    for (uint32_t i = 0; i + 1 < path.size(); ++i) {
        PathVertex &a = path.x[i], &b = path.x[i + 1];
        b.to_light = i == 0 && infinite ? path.to_infinity : unit(between(b.surface.position, a.surface.position));
        a.to_eye = -b.to_light;
    }
}

// A density per solid angle at `from` as one per area at `to`.
inline double per_area(double pdf_solid_angle, Vec3 from, Vec3 to, Vec3 normal_at_to) {
    const Vec3d edge = between(from, to);
    const double dist_squared = dot(edge, edge);
    return pdf_solid_angle * std::fabs(dot(edge, wide(normal_at_to))) / (std::sqrt(dist_squared) * dist_squared);
}

// Densities with which the two walks scatter at a vertex. Specular: masses of the same delta distribution, per solid angle
// of the direction to the light.
struct Scattering {
    double to_light = 0, to_eye = 0;
};

inline double fresnel(double cos_i, double eta) {
    const double sin2_t = (1 - cos_i * cos_i) / (eta * eta);
    if (sin2_t >= 1) return 1;
    const double cos_t = std::sqrt(1 - sin2_t);
    const double s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t), p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return (s * s + p * p) / 2;
}

// The material must have one specular lobe, of a reflection or of untinted glass.
inline Scattering scatter(const SceneView& scene, const PathVertex& v) {
    const Bsdf bsdf = make_bsdf(scene, v.surface);
    if (!v.specular) {
        const LobeValue value = evaluate(bsdf, v.to_eye, v.to_light);
        return {value.pdf_light, value.pdf_eye};
    }
    uint32_t chosen = 0;
    while (!is_specular(bsdf.lobes[chosen])) ++chosen;
    const Lobe& lobe = bsdf.lobes[chosen];
    if (lobe.kind == LobeKind::reflection) return {lobe.selection, lobe.selection};
    const Vec3d normal = wide(v.surface.shading_normal);
    const double cos_eye = dot(wide(v.to_eye), normal), cos_light = dot(wide(v.to_light), normal);
    const double eta =
        cos_eye > 0 ? lobe.eta : 1 / double{lobe.eta};  // behind the surface over before it, from the eye
    const double reflect = lobe.kind == LobeKind::dielectric ? fresnel(std::fabs(cos_eye), eta) : 0;
    if (cos_eye * cos_light > 0) return {lobe.selection * reflect, lobe.selection * reflect};
    // eta_eye^2 cos_eye d(eye) = eta_light^2 cos_light d(light)
    const double d_light_over_d_eye = std::fabs(cos_eye) / (eta * eta * std::fabs(cos_light));
    const double mass = lobe.selection * (1 - reflect);
    return {mass, mass * d_light_over_d_eye};
}

// How many square pixels of the film a square metre of the surface at z_1 covers, seen from the path's lens point: the
// Jacobian of (right, up) / depth, or of the parallel projection, along two tangents of the surface.
inline double film_density(const Camera& camera, const PathVertex& z_1) {
    const auto local = [&](Vec3d v) {
        const Affine& m = camera.camera_to_world;
        return Vec3d{dot(v, wide(m.column(0))), dot(v, wide(m.column(1))), -dot(v, wide(m.column(2)))};
    };
    const Vec3d p = local(between(camera.camera_to_world.column(3), z_1.surface.position));
    const Vec3d ray = local(wide(z_1.to_eye));
    const double right = ray.x / ray.z, up = ray.y / ray.z;  // of the ray, per metre of depth
    const double depth = camera.projection == Projection::perspective ? p.z : 1;
    const Vec3d n = wide(z_1.surface.geometric_normal);
    const Vec3d aside = std::fabs(n.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    const double n_aside = dot(n, aside);
    const Vec3d a{aside.x - n_aside * n.x, aside.y - n_aside * n.y, aside.z - n_aside * n.z};
    const Vec3d b{n.y * a.z - n.z * a.y, n.z * a.x - n.x * a.z, n.x * a.y - n.y * a.x};
    const Vec3d ta = local(a), tb = local(b);
    const double determinant = (ta.x - right * ta.z) * (tb.y - up * tb.z) - (tb.x - right * tb.z) * (ta.y - up * ta.z);
    const double per_plane =
        camera.width / (2.0 * double{camera.half_size.x}) * camera.height / (2.0 * double{camera.half_size.y});
    return std::fabs(determinant) / (dot(a, a) * depth * depth) * per_plane;
}

// Densities of every strategy k = 0 ... n - 1, times its count, half of that for hits; 0 for those that cannot make the path.
inline std::vector<double> strategy_densities(const SceneView& scene, const PassSettings& pass, const Path& path) {
    const uint32_t n = path.size();
    const Light& light = scene.lights[path.light];
    const bool infinite = is_infinite(light);
    const PathVertex &x_0 = path.x[0], &x_1 = path.x[1];
    const Vec3 position_0 = x_0.surface.position, normal_0 = x_0.surface.geometric_normal;
    const Vec3 position_1 = x_1.surface.position, normal_1 = x_1.surface.geometric_normal;

    std::vector<Scattering> scattering(n);
    for (uint32_t i = 1; i + 1 < n; ++i) scattering[i] = scatter(scene, path.x[i]);

    // Of each vertex in the light walk and in the eye walk; the lens is chosen alike in every strategy.
    std::vector<double> by_light(n, 1), by_eye(n, 1);
    const double choice = pdf_choose_source(scene, path.light);
    const EmissionPdf emission = pdf_emission(scene, light, infinite ? position_1 : position_0, normal_0, x_0.to_eye);
    if (infinite) {  // x_0 is a direction, and x_1 is where a ray through the disc around the scene meets a surface
        by_light[0] = choice * emission.direction;
        by_light[1] = emission.position * std::fabs(dot(wide(x_0.to_eye), wide(normal_1)));
    } else {
        by_light[0] = choice * emission.position;
        by_light[1] = per_area(emission.direction, position_0, position_1, normal_1);
    }
    for (uint32_t i = 2; i + 1 < n; ++i) {
        const SurfacePoint &from = path.x[i - 1].surface, &to = path.x[i].surface;
        by_light[i] = per_area(scattering[i - 1].to_eye, from.position, to.position, to.geometric_normal);
    }
    for (uint32_t i = 0; i + 2 < n; ++i) {
        const SurfacePoint &from = path.x[i + 1].surface, &to = path.x[i].surface;
        by_eye[i] = scattering[i + 1].to_light;
        if (i > 0 || !infinite) by_eye[i] = per_area(by_eye[i], from.position, to.position, to.geometric_normal);
    }
    by_eye[n - 2] = n > 2 ? film_density(scene.camera, path.x[n - 2]) : 1;
    double next_event = pdf_choose_light(scene, x_1.surface, path.light);
    if (is_on_light(light, x_1.surface)) {
        next_event = 0;
    } else if (!is_delta(light)) {
        next_event *= pdf_next_event(scene, light, position_1, position_0, normal_0, x_1.to_light);
        if (!infinite) next_event = per_area(next_event, position_1, position_0, normal_0);
    }

    std::vector<double> densities(n, 0);
    for (uint32_t k = 0; k < n; ++k) {
        if (k > pass.light_path_length + 1 || n - k > pass.eye_path_length + 1) continue;  // the window
        if (k == 0 && is_delta(light)) continue;  // no ray hits it
        if (n == 2 && k > 0) continue;  // hits alone show lights directly
        if ((k == 0 && !pass.hits) || (k == n - 1 && !pass.splats)) continue;
        if (k == 2 && n == 3 && pass.light_samples > 0) continue;  // direct light is left to next event
        if (k == 1 && x_1.specular) continue;
        if (k >= 2 && (path.x[k - 1].specular || path.x[k].specular)) continue;
        double density = k == 0   ? 0.5
                         : k == 1 ? double(pass.light_samples)
                                  : double{pass.kappa} * pass.connections_at(n - k);
        if (k > 0 && k == n - 1) density = double(pass.splat_paths());
        for (uint32_t i = 0; i < n; ++i) density *= i >= k ? by_eye[i] : k == 1 ? next_event : by_light[i];
        densities[k] = density;
    }
    return densities;
}

// The weights of all strategies, 0 for those that cannot make the path.
inline std::vector<double> weights(const SceneView& scene, const PassSettings& pass, const Path& path) {
    std::vector<double> w = strategy_densities(scene, pass, path);
    double sum = 0;
    for (double& p : w) {
        if (pass.weighting == Weighting::uniform) p = p > 0 ? 1 : 0;
        if (pass.weighting == Weighting::power) p *= p;
        sum += p;
    }
    for (double& p : w) p /= sum;
    return w;
}

}  // namespace vlp::reference
