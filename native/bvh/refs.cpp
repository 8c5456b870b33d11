// Bounds of triangles and spheres, in their own space or in the world's.
#include "bvh/refs.h"

namespace vlp {

namespace {

constexpr uint32_t k_chunk = 16384;

}  // namespace

__attribute__((noinline)) Corners corners_of(const GeometryView& geometry, const InstanceView* placement,
                                             uint32_t primitive) {
    const Triangle& triangle = geometry.triangles[primitive];
    Corners corners;
    for (int i = 0; i < 3; ++i) {
        const Vec3 p = geometry.positions[triangle.v[i]];
        corners.v[i] = placement ? transform_point(placement->object_to_world, p) : p;
    }
    return corners;
}

__attribute__((noinline)) Sphere sphere_of(const GeometryView& geometry, const InstanceView* placement,
                                           uint32_t primitive) {
    const Sphere sphere = geometry.spheres[primitive];
    if (!placement) return sphere;
    const float scale = std::cbrt(std::fabs(determinant(placement->object_to_world)));
    return {transform_point(placement->object_to_world, sphere.center), sphere.radius * scale};
}

Box box_of(const Corners& c) {
    return {min_of(min_of(c.v[0], c.v[1]), c.v[2]), max_of(max_of(c.v[0], c.v[1]), c.v[2])};
}

__attribute__((noinline)) Box box_of(const Sphere& s) {
    // A quarter of a millionth wider: the sphere test rounds the centre's distance, not the box's sides.
    const float r = s.radius * (1.0f + 0x1p-22f);
    return {s.center - Vec3{r, r, r}, s.center + Vec3{r, r, r}};
}

bool can_flatten(const GeometryView& geometry, const InstanceView& placement) {
    if (geometry.kind == GeometryKind::mesh) return true;
    const Affine& map = placement.object_to_world;
    const Vec3 x = map.column(0), y = map.column(1), z = map.column(2);
    const float scale = (length_squared(x) + length_squared(y) + length_squared(z)) * (1.0f / 3.0f);
    const float tolerance = 2e-6f * scale;  // the rounding of a rotation matrix in single precision
    const float off[] = {dot(x, y),
                         dot(y, z),
                         dot(z, x),
                         length_squared(x) - scale,
                         length_squared(y) - scale,
                         length_squared(z) - scale};
    for (const float o : off) {
        if (!(std::fabs(o) <= tolerance)) return false;
    }
    return true;
}

void write_refs(std::span<const RefRun> runs, ThreadPool& pool, std::span<Ref> refs) {
    struct Chunk {
        const RefRun* run;
        uint32_t begin, end;
    };
    std::vector<Chunk> chunks;
    for (const RefRun& run : runs) {
        const uint32_t count = run.geometry->primitive_count;
        for (uint32_t begin = 0; begin < count; begin += k_chunk) {
            chunks.push_back({&run, begin, min_of(count, begin + k_chunk)});
        }
    }
    pool.run(static_cast<uint32_t>(chunks.size()), [&](uint32_t chunk) {
        const auto [run, begin, end] = chunks[chunk];
        const GeometryView& geometry = *run->geometry;
        for (uint32_t i = begin; i < end; ++i) {
            const Box box = geometry.kind == GeometryKind::mesh ? box_of(corners_of(geometry, run->placement, i))
                                                                : box_of(sphere_of(geometry, run->placement, i));
            refs[run->first + i] = {box.low, run->instance, box.high, i};
        }
    });
}

Box transform_box(const Affine& map, const Box& box) {
    Box result;
    const float* const low = &box.low.x;
    const float* const high = &box.high.x;
    float out_low[3], out_high[3];
    for (int i = 0; i < 3; ++i) {
        // Sums in double precision, and a step outwards for the rounding of the map's inverse that rays go through.
        double from = map.m[i][3], to = map.m[i][3], size = std::fabs(map.m[i][3]);
        for (int j = 0; j < 3; ++j) {
            const double a = static_cast<double>(map.m[i][j]) * low[j], b = static_cast<double>(map.m[i][j]) * high[j];
            from += min_of(a, b), to += max_of(a, b);
            size += max_of(std::fabs(a), std::fabs(b));
        }
        out_low[i] = static_cast<float>(from - size * 0x1p-21), out_high[i] = static_cast<float>(to + size * 0x1p-21);
    }
    result.low = {out_low[0], out_low[1], out_low[2]};
    result.high = {out_high[0], out_high[1], out_high[2]};
    return result;
}

}  // namespace vlp
