// Checks the arrays and packs them: directions in 32 bits, one value a vertex where all its corners agree.
#include "scene/geometry_build.h"

#include "geometry/octahedral.h"
#include "scene/input_checks.h"

namespace vlp {
namespace {

std::vector<uint16_t> narrow(std::span<const int32_t> slots) {
    std::vector<uint16_t> narrowed(slots.size());
    for (size_t i = 0; i < slots.size(); ++i) narrowed[i] = static_cast<uint16_t>(slots[i]);
    return narrowed;
}

bool equal(OctNormal a, OctNormal b) { return a.bits == b.bits; }
bool equal(Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; }

// Smooth meshes say the same at every corner of a vertex, and take a sixth of the room with one value for each. Fills
// `of_vertex` with these, or returns false where corners of a vertex differ or that would take more.
template <typename T>
bool by_vertex(std::span<const T> of_corner, std::span<const Triangle> triangles, size_t vertices,
               std::vector<T>& of_vertex) {
    if (of_corner.size() <= vertices) return false;
    std::vector<T> values(vertices);
    std::vector<bool> known(vertices);
    for (size_t i = 0; i < of_corner.size(); ++i) {
        const uint32_t v = triangles[i / 3].v[i % 3];
        if (known[v] && !equal(values[v], of_corner[i])) return false;
        values[v] = of_corner[i];
        known[v] = true;
    }
    of_vertex = std::move(values);
    return true;
}

}  // namespace

GeometryView Geometry::view(const Place& place) const {
    GeometryView v;
    v.kind = kind;
    v.primitive_count = static_cast<uint32_t>(kind == GeometryKind::mesh ? triangles.size() : spheres.size());
    const auto put = [&](const auto& array) { return placed(array, ScenePart::geometry, place); };
    v.positions = put(positions);
    v.triangles = put(triangles);
    v.corner_normals = put(corner_normals);
    v.uvs = put(uvs);
    v.normals_by_vertex = normals_by_vertex;
    v.uvs_by_vertex = uvs_by_vertex;
    v.spheres = put(spheres);
    v.material_slots = put(slots);
    return v;
}

Geometry make_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                   std::span<const Vec3> corner_normals, std::span<const Vec2> uvs, std::span<const int32_t> slots) {
    check_mesh(positions, triangles, corner_normals, uvs, slots);
    Geometry g;
    g.positions.assign(positions.begin(), positions.end());
    g.triangles.assign(triangles.begin(), triangles.end());
    std::vector<OctNormal> normals(corner_normals.size());
    for (size_t i = 0; i < normals.size(); ++i) {
        const float l = length(corner_normals[i]);
        normals[i] = encode(l > 0 ? corner_normals[i] / l : Vec3{0, 0, 1});
    }
    g.normals_by_vertex = by_vertex<OctNormal>(normals, triangles, positions.size(), g.corner_normals);
    if (!g.normals_by_vertex) g.corner_normals = std::move(normals);
    g.uvs_by_vertex = by_vertex<Vec2>(uvs, triangles, positions.size(), g.uvs);
    if (!g.uvs_by_vertex) g.uvs.assign(uvs.begin(), uvs.end());
    g.slots = narrow(slots);
    return g;
}

Geometry make_spheres(std::span<const Vec3> centers, std::span<const float> radii, std::span<const int32_t> slots) {
    check_spheres(centers, radii, slots);
    Geometry g;
    g.kind = GeometryKind::spheres;
    g.spheres.resize(centers.size());
    for (size_t i = 0; i < centers.size(); ++i) g.spheres[i] = {centers[i], radii[i]};
    g.slots = narrow(slots);
    return g;
}

}  // namespace vlp
