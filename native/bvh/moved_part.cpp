// The part is a polygon in barycentric coordinates, which stay what they are when the corners move.
#include "bvh/moved_part.h"

#include <array>

namespace vlp {

namespace {

using Barycentric = std::array<double, 3>;

// A triangle that six planes may have cut.
struct Polygon {
    std::array<Barycentric, 9> corner{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    uint32_t size = 3;

    void add(const Barycentric& b) { corner[size++] = b; }
};

double coordinate(const Corners& triangle, uint32_t axis, const Barycentric& b) {
    double x = 0;
    for (uint32_t k = 0; k < 3; ++k) x += b[k] * static_cast<double>((&triangle.v[k].x)[axis]);
    return x;
}

Vec3 sizes_of(const Corners& triangle) {
    const auto size = [](Vec3 v) { return Vec3{std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; };
    return max_of(max_of(size(triangle.v[0]), size(triangle.v[1])), size(triangle.v[2]));
}

// The part where sign * coordinate <= limit.
Polygon cut(const Polygon& polygon, const Corners& triangle, uint32_t axis, double sign, double limit) {
    Polygon part;
    part.size = 0;
    for (uint32_t i = 0; i < polygon.size; ++i) {
        const Barycentric &a = polygon.corner[i], &b = polygon.corner[(i + 1) % polygon.size];
        const double from = limit - sign * coordinate(triangle, axis, a);
        const double to = limit - sign * coordinate(triangle, axis, b);
        if (from >= 0) part.add(a);
        if ((from >= 0) == (to >= 0)) continue;
        const double t = from / (from - to);
        part.add({a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t});
    }
    return part;
}

bool contains(const Box& outer, const Box& inner) {
    return min_of(outer.low, inner.low) == outer.low && max_of(outer.high, inner.high) == outer.high;
}

}  // namespace

Box moved_part(const Corners& from, const Box& box, const Corners& to) {
    const Box whole = box_of(to);
    if (contains(box, box_of(from))) return whole;
    // More than rounding in double precision moves a corner across a plane.
    const Vec3 slack = sizes_of(from) * 0x1p-40f;
    Polygon polygon;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const auto of = [axis](Vec3 v) { return static_cast<double>((&v.x)[axis]); };
        polygon = cut(polygon, from, axis, -1, of(slack) - of(box.low));
        polygon = cut(polygon, from, axis, 1, of(slack) + of(box.high));
    }
    if (polygon.size == 0) return whole;
    // As where a build cuts triangles: the ray's test rounds in single precision.
    const Vec3 margin = sizes_of(to) * 0x1p-21f;
    Box part;
    for (uint32_t i = 0; i < polygon.size; ++i) {
        const auto at = [&](uint32_t axis) { return static_cast<float>(coordinate(to, axis, polygon.corner[i])); };
        const Vec3 p{at(0), at(1), at(2)};
        part.include(p - margin), part.include(p + margin);
    }
    return {max_of(part.low, whole.low), min_of(part.high, whole.high)};
}

}  // namespace vlp
