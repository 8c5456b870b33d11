// What the builder sorts: bounds of primitives and instances, and which geometries become part of the world's tree.
#pragma once

#include <span>
#include <vector>

#include "core/parallel.h"
#include "core/raw_vector.h"
#include "scene/scene_view.h"

namespace vlp {

struct Box {
    Vec3 low{k_infinity, k_infinity, k_infinity};
    Vec3 high{-k_infinity, -k_infinity, -k_infinity};

    void include(Vec3 p) { low = min_of(low, p), high = max_of(high, p); }
    void include(const Box& b) { low = min_of(low, b.low), high = max_of(high, b.high); }
    float half_area() const {
        const Vec3 e = high - low;
        return e.x >= 0 ? e.x * (e.y + e.z) + e.y * e.z : 0;
    }
};

struct Ref {
    Vec3 low;
    uint32_t instance;   // k_none in the tree of a geometry
    Vec3 high;
    uint32_t primitive;  // k_none: the whole instance

    Box box() const { return {low, high}; }
};

struct Corners {
    Vec3 v[3];
};

// The corners of a triangle in the space of its tree: the world's for `placement`, the object's for null. Both the bounds
// and the leaves take them from this one function, so that they agree to the last bit.
Corners corners_of(const GeometryView& geometry, const InstanceView* placement, uint32_t primitive);
Sphere sphere_of(const GeometryView& geometry, const InstanceView* placement, uint32_t primitive);

// Of a whole primitive; from these functions alone, for the same reason.
Box box_of(const Corners& corners);
Box box_of(const Sphere& sphere);

// Whether the instance's primitives can stand in the world's tree: spheres must stay spheres.
bool can_flatten(const GeometryView& geometry, const InstanceView& placement);

// The primitives of a geometry, whose refs stand one behind the other.
struct RefRun {
    const GeometryView* geometry;
    const InstanceView* placement;  // null: in the space of the object
    uint32_t instance;              // k_none for a tree of the geometry's own
    uint32_t first;                 // where its refs begin
};

// Writes the refs of every primitive.
void write_refs(std::span<const RefRun> runs, ThreadPool& pool, std::span<Ref> refs);

// Bounds of a box after an affine map.
Box transform_box(const Affine& map, const Box& box);

}  // namespace vlp
