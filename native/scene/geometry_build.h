// A mesh or a set of spheres as a scene keeps it (host only).
#pragma once

#include <span>
#include <vector>

#include "scene/scene_parts.h"
#include "scene/scene_view.h"

namespace vlp {

struct Geometry {
    GeometryKind kind = GeometryKind::mesh;
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    std::vector<OctNormal> corner_normals;
    std::vector<Vec2> uvs;
    bool normals_by_vertex = false, uvs_by_vertex = false;
    std::vector<Sphere> spheres;
    std::vector<uint16_t> slots;

    GeometryView view(const Place& place) const;
};

// Throw std::invalid_argument naming the value at fault. `corner_normals` (3 a triangle), `uvs` (3 a triangle) and `slots`
// may be empty.
Geometry make_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                   std::span<const Vec3> corner_normals, std::span<const Vec2> uvs, std::span<const int32_t> slots);
Geometry make_spheres(std::span<const Vec3> centers, std::span<const float> radii, std::span<const int32_t> slots);

}  // namespace vlp
