// Edges of paths: walking to the next surface and seeing whether two points are joined, both through transparent ones.
#pragma once

#include "bvh/compressed_traverse.h"
#include "bvh/traverse.h"
#include "core/sampler.h"
#include "geometry/surface.h"
#include "scene/scene_view.h"

namespace vlp {

// Most transparent surfaces that one edge may cross; what lies behind more of them is dark.
inline constexpr uint32_t k_max_transparent = 128;

// The searches of the tree, of which every place that sends a ray shares one stack on a device. Devices have compressed
// nodes alone, and so does a host that stands in for one.
VLP_HD inline bool has_wide_nodes([[maybe_unused]] const SceneView& scene) {
    return !VLP_ON_DEVICE && scene.bvh.nodes != nullptr;
}
VLP_HD VLP_CALLED_ON_DEVICE inline Hit find_closest(const SceneView& scene, const Ray& ray, PrimitiveId skip) {
    if (has_wide_nodes(scene)) [[likely]]
        return closest_hit(scene, ray, skip);
    return closest_hit_compressed(scene, ray, skip);
}
VLP_HD VLP_CALLED_ON_DEVICE inline bool find_any(const SceneView& scene, const Ray& ray, PrimitiveId from,
                                                 PrimitiveId to) {
    if (has_wide_nodes(scene)) [[likely]]
        return any_hit(scene, ray, from, to);
    return any_hit_compressed(scene, ray, from, to);
}

// The start of a ray or one end of a connection: a point of a surface, or free in space (id none, normal zero).
struct Anchor {
    Vec3 position;
    Vec3 normal;  // geometric
    PrimitiveId id;
};

VLP_HD inline Anchor anchor_of(const SurfacePoint& p) {
    return {p.position, p.geometric_normal, {p.instance, p.primitive}};
}

// The origin of a ray that leaves `from` in `direction`.
VLP_HD inline Vec3 leave(const Anchor& from, Vec3 direction) {
    return offset_origin(from.position, face_toward(from.normal, direction));
}

// The way of a walk to its next vertex: the ray from where it has come to, and what was passed through.
struct Way {
    Ray ray;
    PrimitiveId skip;
    uint32_t passed = 0;  // surfaces
    Rgb throughput = rgb(1);
};

// What stands at the end of a stretch of the way: a surface that is not passed through, or not.
enum class Met : uint8_t { nothing, surface, passage };

// A walk that looks for no light on its way.
struct NoLights {
    VLP_HD void on_stretch(const Ray&, Rgb) const {}
    VLP_HD void on_surface(const SurfacePoint&, Rgb) const {}
};

// Takes a walk to the `hit` that find_closest found along its way, which becomes `surface`. Whether a partly transparent
// surface is passed is decided at random from `key`, so passing is no scattering: such a surface is no vertex of the path,
// and the way goes on behind it. `lights.on_stretch(ray, throughput)` is called for each free stretch of the way, whose
// t_max is where it ends, and `lights.on_surface` for each surface that is met, passed or not.
template <typename Lights>
VLP_HD VLP_FORCE_INLINE Met meet(const SceneView& scene, const Hit& hit, bool from_camera, uint32_t key,
                                 const Lights& lights, Way& way, SurfacePoint& surface) {
    Ray stretch = way.ray;
    if (hit.found()) stretch.t_max = hit.t;
    lights.on_stretch(stretch, way.throughput);
    if (!hit.found()) return Met::nothing;
    surface = surface_at(scene, way.ray, hit);
    if (!from_camera || (scene.instances[hit.instance].visibility & k_visible_to_camera)) {
        lights.on_surface(surface, way.throughput);
        const Material& material = scene.materials[surface.material];
        if (material.pass_through <= 0 || unit_float(hash(key, way.passed)) >= material.pass_through) {
            way.throughput *= 1.0f / (1.0f - material.pass_through);
            return Met::surface;
        }
        way.throughput *= material.transparency * (1.0f / material.pass_through);
    }
    way.ray.origin = leave(anchor_of(surface), way.ray.direction);
    way.ray.t_max -= hit.t;
    way.skip = {hit.instance, hit.primitive};
    if (++way.passed < k_max_transparent) return Met::passage;
    way.throughput = {};
    return Met::nothing;
}

// Follows a way to the next surface that is not passed through; false where there is none.
template <typename Lights>
VLP_HD VLP_FORCE_INLINE bool walk(const SceneView& scene, bool from_camera, uint32_t key, const Lights& lights,
                                  Way& way, SurfacePoint& surface) {
    for (;;) {
        const Hit hit = find_closest(scene, way.ray, way.skip);
        const Met met = meet(scene, hit, from_camera, key, lights, way, surface);
        if (met != Met::passage) return met == Met::surface;
    }
}

namespace detail {

// Of scenes where a surface may not block all of a ray.
VLP_HD inline Rgb transmittance_of_surfaces(const SceneView& scene, Ray ray, PrimitiveId from, PrimitiveId to,
                                            bool to_camera) {
    Rgb through = rgb(1);
    PrimitiveId skip = from;
    for (uint32_t i = 0; i < k_max_transparent; ++i) {
        const Hit hit = find_closest(scene, ray, skip);
        if (!hit.found() ||
            (hit.instance == to.instance && hit.primitive == to.primitive && hit.t > 0.999f * ray.t_max)) {
            return through;
        }
        const SurfacePoint surface = surface_at(scene, ray, hit);
        if (!to_camera || (scene.instances[hit.instance].visibility & k_visible_to_camera)) {
            through *= scene.materials[surface.material].transparency;
            if (is_black(through)) return through;
        }
        ray.origin = leave(anchor_of(surface), ray.direction);
        ray.t_max -= hit.t;
        skip = {hit.instance, hit.primitive};
    }
    return {};
}

}  // namespace detail

// What passes through transparent surfaces on the way along `ray`; black when something blocks it. A ray `to_camera` is
// not blocked by what the camera does not see.
VLP_HD inline Rgb transmittance(const SceneView& scene, const Ray& ray, PrimitiveId from, PrimitiveId to,
                                bool to_camera = false) {
    if (scene.has_transparency || (to_camera && scene.hides_from_camera))
        return detail::transmittance_of_surfaces(scene, ray, from, to, to_camera);
    return find_any(scene, ray, from, to) ? Rgb{} : rgb(1);
}

// Geometry of a connection of two points, and what of the light between them gets through.
struct Edge {
    Vec3 direction;  // unit, from the first to the second
    float dist_squared = 0;
};

VLP_HD inline Edge edge_between(Vec3 from, Vec3 to) {
    const Vec3 d = to - from;
    const float dist_squared = length_squared(d);
    return {d * (1.0f / std::sqrt(dist_squared)), dist_squared};
}

// The ray of a connection, between the surfaces of its ends, which do not block it.
struct ShadowRay {
    Ray ray;
    PrimitiveId from, to;
};

VLP_HD inline ShadowRay shadow_ray(const Anchor& from, const Anchor& to, Vec3 direction) {
    const Vec3 origin = leave(from, direction), target = leave(to, -direction);
    const Vec3 d = target - origin;
    const float distance = length(d);
    return {{origin, d * (1.0f / distance), distance}, from.id, to.id};
}
// To a light that is infinitely far away.
VLP_HD inline ShadowRay shadow_ray(const Anchor& from, Vec3 direction) {
    return {{leave(from, direction), direction}, from.id, {}};
}

VLP_HD inline Rgb transmittance(const SceneView& scene, const ShadowRay& shadow, bool to_camera = false) {
    return transmittance(scene, shadow.ray, shadow.from, shadow.to, to_camera);
}

}  // namespace vlp
