// The slow obvious way, in double precision: every primitive against the ray, without a tree.
#pragma once

#include <cmath>
#include <limits>

#include "tests/native/both_forms.h"

namespace vlp::test {

struct Double3 {
    double x, y, z;
};
inline Double3 to_double(Vec3 v) { return {v.x, v.y, v.z}; }
inline Double3 operator-(Double3 a, Double3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Double3 operator+(Double3 a, Double3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Double3 operator*(Double3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(Double3 a, Double3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Double3 cross(Double3 a, Double3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Double3 transform(const Affine& a, Double3 p, double w) {
    const auto row = [&](int i) { return a.m[i][0] * p.x + a.m[i][1] * p.y + a.m[i][2] * p.z + a.m[i][3] * w; };
    return {row(0), row(1), row(2)};
}

// Where a ray meets a primitive, and how far the point is from the primitive's border or the ray from grazing it, as a
// fraction of its size: when `margin` is small, single precision may decide otherwise.
struct ExactHit {
    double t = std::numeric_limits<double>::infinity();
    double u = 0, v = 0, margin = 0;
    uint32_t instance = k_none, primitive = k_none;
    bool found() const { return instance != k_none; }
};

inline bool exact_triangle(Double3 o, Double3 d, Double3 a, Double3 b, Double3 c, double slack, ExactHit& hit) {
    const Double3 e1 = b - a, e2 = c - a, p = cross(d, e2);
    const double det = dot(e1, p);
    if (det == 0) return false;
    const Double3 s = o - a, q = cross(s, e1);
    const double u = dot(s, p) / det, v = dot(d, q) / det;
    hit.t = dot(e2, q) / det, hit.u = u, hit.v = v;
    hit.margin = std::min(u, std::min(v, 1 - u - v));
    return hit.margin >= -slack;
}

// Roots in ascending order, by the sphere's equation in object space.
inline bool exact_sphere(Double3 o, Double3 d, Double3 center, double radius, double (&roots)[2], double& margin) {
    const Double3 f = o - center;
    const double a = dot(d, d), b = -dot(f, d), nearest = dot(f + d * (b / a), f + d * (b / a));
    margin = 1 - std::sqrt(nearest) / radius;
    if (margin < 0) return false;
    const double h = std::sqrt((radius * radius - nearest) / a);
    roots[0] = b / a - h, roots[1] = b / a + h;
    return true;
}

// Calls visit(hit) for every meeting of the ray's line with a primitive, grown by `slack` (a fraction of its size).
template <typename Visit>
void for_each_exact_hit(const RayScene& scene, const Ray& ray, double slack, const Visit& visit) {
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const InstanceView& instance = scene.instances[i];
        const GeometryView& geometry = scene.geometries[instance.geometry];
        const Double3 o = to_double(ray.origin), d = to_double(ray.direction);
        for (uint32_t j = 0; j < geometry.primitive_count; ++j) {
            ExactHit hit;
            hit.instance = i, hit.primitive = j;
            if (geometry.kind == GeometryKind::mesh) {
                Double3 corner[3];
                for (int k = 0; k < 3; ++k) {
                    corner[k] = transform(instance.object_to_world,
                                          to_double(geometry.positions[geometry.triangles[j].v[k]]), 1);
                }
                if (exact_triangle(o, d, corner[0], corner[1], corner[2], slack, hit)) visit(hit);
                continue;
            }
            // The inverse in double precision, by Cramer's rule.
            const Affine& m = instance.object_to_world;
            const Double3 r0{m.m[0][0], m.m[0][1], m.m[0][2]}, r1{m.m[1][0], m.m[1][1], m.m[1][2]},
                r2{m.m[2][0], m.m[2][1], m.m[2][2]};
            const Double3 c0 = cross(r1, r2), c1 = cross(r2, r0), c2 = cross(r0, r1);
            const double s = 1 / dot(r0, c0);
            const auto solve = [&](Double3 p) { return (c0 * p.x + c1 * p.y + c2 * p.z) * s; };
            const Double3 origin = solve(o - Double3{m.m[0][3], m.m[1][3], m.m[2][3]}), direction = solve(d);
            const Sphere& sphere = geometry.spheres[j];
            double roots[2];
            if (!exact_sphere(origin, direction, to_double(sphere.center), sphere.radius * (1 + slack), roots,
                              hit.margin)) {
                continue;
            }
            for (const double t : roots) {
                hit.t = t;
                visit(hit);
            }
        }
    }
}

inline ExactHit exact_closest(const RayScene& scene, const Ray& ray, double slack = 0) {
    ExactHit best;
    for_each_exact_hit(scene, ray, slack, [&](const ExactHit& hit) {
        if (hit.t > 0 && hit.t < ray.t_max && hit.t < best.t) best = hit;
    });
    return best;
}

}  // namespace vlp::test
