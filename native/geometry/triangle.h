// Watertight ray-triangle intersection (Woop, Benthin & Wald 2013): no ray slips through a shared edge or vertex.
#pragma once

#include "core/vec.h"

namespace vlp {

// A product that is rounded before it is used: an edge function must be the exact negative of its neighbour's, which a
// fused multiply-add would break by rounding only one of its two products.
VLP_HD VLP_FORCE_INLINE float rounded_product(float a, float b) {
#if VLP_ON_DEVICE
    return __fmul_rn(a, b);
#else
    float product = a * b;
#if defined(__x86_64__)
    asm("" : "+x"(product));
#elif defined(__aarch64__)
    asm("" : "+w"(product));
#endif
    return product;
#endif
}

// A ray in the space where it runs along +z: axis `k[2]` is its longest, the others are sheared.
struct ShearedRay {
    float origin[3];  // along the axes k
    uint32_t k[3];
    float shear_x, shear_y, scale_z;
};

// A device would put what it indexes into memory, a processor's selections may be branches.
VLP_HD inline float along(Vec3 v, uint32_t axis) {
#if VLP_ON_DEVICE
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
#else
    return (&v.x)[axis];
#endif
}

VLP_HD VLP_FORCE_INLINE ShearedRay shear(Vec3 origin, Vec3 direction) {
    ShearedRay r{};
    const float ax = std::fabs(direction.x), ay = std::fabs(direction.y), az = std::fabs(direction.z);
    const uint32_t longest = ax > ay ? (ax > az ? 0u : 2u) : (ay > az ? 1u : 2u);
    r.k[2] = longest;
    r.k[0] = longest == 2 ? 0 : longest + 1;
    r.k[1] = r.k[0] == 2 ? 0 : r.k[0] + 1;
    for (uint32_t i = 0; i < 3; ++i) r.origin[i] = along(origin, r.k[i]);
    r.scale_z = 1.0f / along(direction, longest);
    r.shear_x = along(direction, r.k[0]) * r.scale_z;
    r.shear_y = along(direction, r.k[1]) * r.scale_z;
    return r;
}

struct TriangleHit {
    float t, u, v;  // u and v weigh the second and the third vertex
    bool found;
};

namespace detail {

template <typename Real>
VLP_HD inline TriangleHit solve(Real u, Real v, Real w, Real az, Real bz, Real cz, float scale_z, float t_max) {
    const Real det = u + v + w;
    const Real inverse = 1 / det;
    const Real wa = u * inverse, wb = v * inverse, wc = w * inverse;  // before z: their products with it could overflow
    const float t = static_cast<float>(wa * az + wb * bz + wc * cz) * scale_z;
    const bool found = det != 0 && t > 0 && t < t_max;
    return {t, static_cast<float>(wb), static_cast<float>(wc), found};
}

}  // namespace detail

// The same test in double precision, where the products of the edge functions are exact. For triangles whose three edge
// functions all round to zero: slivers seen edge-on, and triangles so small that the products underflow.
VLP_HD inline TriangleHit intersect_exactly(float ax, float ay, float az, float bx, float by, float bz, float cx,
                                            float cy, float cz, float scale_z, float t_max) {
    const double u = static_cast<double>(cx) * by - static_cast<double>(cy) * bx;
    const double v = static_cast<double>(ax) * cy - static_cast<double>(ay) * cx;
    const double w = static_cast<double>(bx) * ay - static_cast<double>(by) * ax;
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return {0, 0, 0, false};
    return detail::solve<double>(u, v, w, az, bz, cz, scale_z, t_max);
}

// Vertices along the ray's axes k; finds t in (0, t_max). Both sides are hit.
VLP_HD inline TriangleHit intersect(const ShearedRay& ray, Vec3 a, Vec3 b, Vec3 c, float t_max) {
    const float az = a.z - ray.origin[2], bz = b.z - ray.origin[2], cz = c.z - ray.origin[2];
    const float ax = (a.x - ray.origin[0]) - rounded_product(ray.shear_x, az);
    const float ay = (a.y - ray.origin[1]) - rounded_product(ray.shear_y, az);
    const float bx = (b.x - ray.origin[0]) - rounded_product(ray.shear_x, bz);
    const float by = (b.y - ray.origin[1]) - rounded_product(ray.shear_y, bz);
    const float cx = (c.x - ray.origin[0]) - rounded_product(ray.shear_x, cz);
    const float cy = (c.y - ray.origin[1]) - rounded_product(ray.shear_y, cz);
    const float u = rounded_product(cx, by) - rounded_product(cy, bx);
    const float v = rounded_product(ax, cy) - rounded_product(ay, cx);
    const float w = rounded_product(bx, ay) - rounded_product(by, ax);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return {0, 0, 0, false};
    if (u == 0 && v == 0 && w == 0) {
        return intersect_exactly(ax, ay, az, bx, by, bz, cx, cy, cz, ray.scale_z, t_max);
    }
    return detail::solve<float>(u, v, w, az, bz, cz, ray.scale_z, t_max);
}

}  // namespace vlp
