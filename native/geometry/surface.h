// The surface at a hit: position, normals, texture coordinates and material.
#pragma once

#include "bvh/bvh_view.h"
#include "core/ray.h"
#include "geometry/octahedral.h"
#include "scene/scene_view.h"

namespace vlp {

// Normals are unit vectors in world space on the outside of the surface, wherever the ray comes from. Outside is where
// the counter-clockwise side of an object-space triangle is; mirroring an instance keeps it, as in Cycles.
struct SurfacePoint {
    Vec3 position;
    Vec3 geometric_normal;
    Vec3 shading_normal;
    Vec2 uv;
    uint32_t material = 0;
    uint32_t instance = 0;
    uint32_t primitive = 0;
};

VLP_HD inline uint32_t material_of(const SceneView& scene, const InstanceView& instance, uint32_t primitive) {
    const uint16_t* const slots = scene.geometries[instance.geometry].material_slots;
    const uint32_t slot = slots ? slots[primitive] : 0u;
    return scene.material_of_slot[instance.first_material + min_of(slot, instance.slot_count - 1)];
}

namespace detail {

// A unit vector; `fallback` for the zero vector. Scales first: squares of very small numbers vanish.
VLP_HD inline Vec3 normalize_or(Vec3 v, Vec3 fallback) {
    const float size = max_of(std::fabs(v.x), max_of(std::fabs(v.y), std::fabs(v.z)));
    return size > 0 && size < k_infinity ? normalize(v * (1.0f / max_of(size, 1e-37f))) : fallback;
}

// The perpendicular of two edges, unit length. Where their product might vanish or overflow, each edge is scaled first.
VLP_HD inline Vec3 perpendicular(Vec3 a, Vec3 b, Vec3 fallback) {
    const Vec3 product = cross(a, b);
    const float size = length_squared(product);
    if (size > 1e-30f && size < 1e30f) return product * (1.0f / std::sqrt(size));
    return normalize_or(cross(normalize_or(a, {}), normalize_or(b, {})), fallback);
}

// What the corners of a triangle have, weighed by w, u and v: vertex attributes or ones of corners.
template <typename Value>
VLP_HD inline auto at_corners(const Triangle& triangle, uint32_t primitive, bool by_vertex, float w, float u, float v,
                              const Value& value) {
    const size_t first = 3 * static_cast<size_t>(primitive);
    const auto at = [&](uint32_t corner) { return value(by_vertex ? triangle.v[corner] : first + corner); };
    return at(0) * w + at(1) * u + at(2) * v;
}

VLP_HD inline void set_triangle(const GeometryView& geometry, const InstanceView& instance, float u, float v,
                                Vec3 fallback_normal, SurfacePoint& point) {
    const Triangle& triangle = geometry.triangles[point.primitive];
    const Affine& to_world = instance.object_to_world;
    const float w = 1.0f - u - v;
    const Vec3 a = transform_point(to_world, geometry.positions[triangle.v[0]]);
    const Vec3 b = transform_point(to_world, geometry.positions[triangle.v[1]]);
    const Vec3 c = transform_point(to_world, geometry.positions[triangle.v[2]]);
    point.position = a * w + b * u + c * v;
    const Vec3 front = perpendicular(b - a, c - a, fallback_normal);
    point.geometric_normal = instance.mirrored ? -front : front;
    point.shading_normal = point.geometric_normal;
    if (geometry.corner_normals) {
        const Vec3 n = at_corners(triangle, point.primitive, geometry.normals_by_vertex, w, u, v,
                                  [&](size_t i) { return decode(geometry.corner_normals[i]); });
        const Vec3 shading = normalize_or(transform_normal(instance.world_to_object, n), point.geometric_normal);
        // Mirrored at the tangent plane when it is under it, which leaves a normal in the plane where it is.
        const float height = dot(shading, point.geometric_normal);
        point.shading_normal = height < 0 ? shading - point.geometric_normal * (2 * height) : shading;
    }
    if (geometry.uvs) {
        point.uv = at_corners(triangle, point.primitive, geometry.uvs_by_vertex, w, u, v,
                              [&](size_t i) { return geometry.uvs[i]; });
    }
}

}  // namespace detail

// The point of a triangle with weight u on its second vertex and v on its third.
VLP_HD inline SurfacePoint surface_of(const SceneView& scene, uint32_t instance, uint32_t primitive, float u, float v) {
    const InstanceView& placement = scene.instances[instance];
    SurfacePoint point;
    point.material = material_of(scene, placement, primitive);
    point.instance = instance, point.primitive = primitive;
    detail::set_triangle(scene.geometries[placement.geometry], placement, u, v, {0, 0, 1}, point);
    return point;
}

// `hit` must have been found along `ray`.
VLP_HD inline SurfacePoint surface_at(const SceneView& scene, const Ray& ray, const Hit& hit) {
    const InstanceView& placement = scene.instances[hit.instance];
    const GeometryView& geometry = scene.geometries[placement.geometry];
    SurfacePoint point;
    point.material = material_of(scene, placement, hit.primitive);
    point.instance = hit.instance, point.primitive = hit.primitive;
    if (geometry.kind == GeometryKind::mesh) {
        detail::set_triangle(geometry, placement, hit.u, hit.v, -ray.direction, point);
        return point;
    }
    // Along the ray, then onto the sphere, in its own space: an instance may make it an ellipsoid.
    const Sphere& sphere = geometry.spheres[hit.primitive];
    const Vec3 along = transform_point(placement.world_to_object, ray.origin + ray.direction * hit.t) - sphere.center;
    const Vec3 outward = detail::normalize_or(along, {0, 0, 1});
    point.position = transform_point(placement.object_to_world, sphere.center + outward * sphere.radius);
    point.geometric_normal = detail::normalize_or(transform_normal(placement.world_to_object, outward), -ray.direction);
    point.shading_normal = point.geometric_normal;
    return point;
}

}  // namespace vlp
