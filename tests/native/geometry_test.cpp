// Encoded normals, and the surface at a hit.
#include <gtest/gtest.h>

#include "core/frame.h"
#include "geometry/surface.h"
#include "scene/scene.h"
#include "tests/native/bvh_oracle.h"

namespace vlp::test {
namespace {

void expect_near(Vec3 a, Vec3 b, float tolerance) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Frame, IsOrthonormalAndTheSameForAllNormalsOfAnUprightWall) {
    std::mt19937 random(3);
    for (int i = 0; i < 10000; ++i) {
        const Vec3 n = random_direction(random);
        const Frame frame = make_frame(n);
        EXPECT_NEAR(length(frame.tangent), 1, 1e-6f);
        EXPECT_NEAR(length(frame.bitangent), 1, 1e-6f);
        EXPECT_NEAR(dot(frame.tangent, frame.bitangent), 0, 1e-6f);
        expect_near(cross(frame.tangent, frame.bitangent), n, 1e-6f);

        const Vec3 upright = normalize({n.x, n.y, 0});
        const Frame above = make_frame(upright + Vec3{0, 0, 1e-8f}), below = make_frame(upright - Vec3{0, 0, 1e-8f});
        expect_near(above.tangent, below.tangent, 1e-6f);
        expect_near(above.bitangent, below.bitangent, 1e-6f);
    }
}

TEST(Octahedral, RoundTrip) {
    std::mt19937 random(1);
    float worst = 0;
    for (int i = 0; i < 200000; ++i) {
        const Vec3 n = random_direction(random), back = decode(encode(n));
        EXPECT_NEAR(length(back), 1, 3e-7f);
        worst = max_of(worst, length(n - back));
    }
    EXPECT_LT(worst, 7e-5f);  // half a step of 2 / 65534, stretched by at most 3 on the sphere
    EXPECT_GT(worst, 1e-5f);
}

TEST(Octahedral, AxesAndSeamsAreExact) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const float sign : {-1.0f, 1.0f}) {
            Vec3 n;
            (&n.x)[axis] = sign;
            expect_near(decode(encode(n)), n, 0);
            expect_near(decode(encode(n * 1e-20f)), n, 0);
        }
    }
    for (const Vec3 n : {Vec3{1, 1, 0}, Vec3{-1, 0, 1}, Vec3{0, -1, -1}, Vec3{-1, 1, -1e-9f}}) {
        expect_near(decode(encode(n)), normalize(n), 7e-5f);
    }
    expect_near(decode(encode({0, 0, 0})), {0, 0, 1}, 0);
}

// A mesh of one triangle with corner normals and texture coordinates.
struct Shaded {
    Mesh mesh;
    std::vector<OctNormal> normals;
    std::vector<Vec2> uvs{{0, 0}, {1, 0}, {0, 1}};
    RayScene scene;

    explicit Shaded(const Affine& placement, const std::vector<Vec3>& corner_normals) {
        mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
        for (const Vec3 n : corner_normals) normals.push_back(encode(n));
        scene.add(mesh);
        if (!normals.empty()) scene.geometries[0].corner_normals = normals.data();
        scene.geometries[0].uvs = uvs.data();
        scene.place(0, placement);
        scene.build();
    }
    SurfacePoint at(Vec3 object_origin, Vec3 object_direction) {
        const Affine& m = scene.instances[0].object_to_world;
        const Ray ray{transform_point(m, object_origin), normalize(transform_vector(m, object_direction))};
        const Hit hit = closest_hit(scene.view(), ray, {});
        EXPECT_TRUE(hit.found());
        return surface_at(scene.view(), ray, hit);
    }
};

TEST(Surface, NormalsStayOutsideWhereverTheRayComesFrom) {
    for (const float side : {-1.0f, 1.0f}) {
        Shaded flat({}, {});
        const SurfacePoint point = flat.at({0.25f, 0.5f, side}, {0, 0, -side});
        expect_near(point.geometric_normal, {0, 0, 1}, 0);
        expect_near(point.shading_normal, {0, 0, 1}, 0);
        expect_near(point.position, {0.25f, 0.5f, 0}, 1e-7f);
        EXPECT_FLOAT_EQ(point.uv.x, 0.25f);
        EXPECT_FLOAT_EQ(point.uv.y, 0.5f);
    }
}

TEST(Surface, MirroredInstancesKeepTheirOutside) {
    Affine mirror;
    mirror.m[0][0] = -2, mirror.m[2][2] = 3, mirror.m[0][3] = 5;
    Shaded flat(mirror, {});
    EXPECT_TRUE(flat.scene.instances[0].mirrored);
    expect_near(flat.at({0.25f, 0.25f, 1}, {0, 0, -1}).geometric_normal, {0, 0, 1}, 0);
    mirror.m[2][2] = -3;  // the outside of the object is below now
    Shaded below(mirror, {});
    EXPECT_FALSE(below.scene.instances[0].mirrored);
    expect_near(below.at({0.25f, 0.25f, 1}, {0, 0, -1}).geometric_normal, {0, 0, -1}, 0);
}

TEST(Surface, NormalsGoByTheInverseTranspose) {
    std::mt19937 random(3);
    for (int i = 0; i < 100; ++i) {
        const Affine placement = random_affine(random, 1, 2);
        const Vec3 n = normalize(Vec3{0, 0, 1} + random_point(random, 0.3f));
        Shaded smooth(placement, {n, n, n});
        const SurfacePoint point = smooth.at({0.3f, 0.3f, 1}, {0, 0, -1});
        const Vec3 x = transform_vector(placement, {1, 0, 0}), y = transform_vector(placement, {0, 1, 0});
        EXPECT_NEAR(dot(point.geometric_normal, normalize(x)), 0, 2e-6f);
        EXPECT_NEAR(dot(point.geometric_normal, normalize(y)), 0, 2e-6f);
        EXPECT_GT(dot(point.geometric_normal, transform_vector(placement, {0, 0, 1})), 0) << "outside stays outside";
        EXPECT_NEAR(length(point.shading_normal), 1, 1e-6f);
        EXPECT_GE(dot(point.shading_normal, point.geometric_normal), 0);
        // A vector in the smooth surface's plane before the map is in it after the map.
        const Vec3 t = cross(n, {1, 0, 0});
        EXPECT_NEAR(dot(point.shading_normal, normalize(transform_vector(placement, t))), 0, 2e-4f);
    }
}

TEST(Surface, ShadingNormalsAreInterpolated) {
    Shaded smooth({}, {normalize({-1, 0, 2}), normalize({1, 0, 2}), normalize({-1, 0, 2})});
    const SurfacePoint point = smooth.at({0.5f, 0, 1}, {0, 0, -1});
    expect_near(point.shading_normal, {0, 0, 1}, 1e-4f);
    expect_near(smooth.at({0, 0.5f, 1}, {0, 0, -1}).shading_normal, normalize({-1, 0, 2}), 1e-4f);
}

TEST(Surface, ShadingNormalsAreTurnedToTheGeometricSide) {
    const Vec3 under = normalize({1, 0, -0.1f});
    Shaded bent({}, {under, under, under});
    const SurfacePoint point = bent.at({0.25f, 0.25f, 1}, {0, 0, -1});
    expect_near(point.shading_normal, normalize({1, 0, 0.1f}), 1e-4f);
    Shaded turned({}, {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}});
    expect_near(turned.at({0.25f, 0.25f, 1}, {0, 0, -1}).shading_normal, {0, 0, 1}, 1e-6f);
}

TEST(Surface, TinyTrianglesHaveNormals) {
    for (const float size : {1e-25f, 1e-12f, 1e15f}) {
        RayScene scene;
        Mesh mesh;
        mesh.add({0, 0, 0}, {size, 0, 0}, {0, 2 * size, 0});
        scene.place(scene.add(mesh));
        scene.build();
        expect_near(surface_of(scene.view(), 0, 0, 0.2f, 0.3f).geometric_normal, {0, 0, 1}, 0);
    }
}

TEST(Surface, PositionsAreOnTheTriangle) {
    std::mt19937 random(4);
    RayScene scene;
    Mesh mesh;
    for (int i = 0; i < 200; ++i) mesh.add(random_point(random, 1), random_point(random, 1), random_point(random, 1));
    scene.place(scene.add(mesh));
    scene.build();
    int found = 0;
    for (int i = 0; i < 2000; ++i) {
        const Ray ray{random_point(random, 1000), {}};
        const Ray aimed{ray.origin, normalize(random_point(random, 0.5f) - ray.origin)};
        const Hit hit = closest_hit(scene.view(), aimed, {});
        if (!hit.found()) continue;
        ++found;
        const SurfacePoint point = surface_at(scene.view(), aimed, hit);
        const Triangle& triangle = mesh.triangles[hit.primitive];
        const Double3 a = to_double(mesh.positions[triangle.v[0]]);
        const Double3 n =
            cross(to_double(mesh.positions[triangle.v[1]]) - a, to_double(mesh.positions[triangle.v[2]]) - a);
        // Within a few units in the last place of the coordinates, although the ray's origin is a thousand away.
        EXPECT_LT(std::fabs(dot(to_double(point.position) - a, n)) / std::sqrt(dot(n, n)), 5e-7);
        EXPECT_LT(length(point.position - (aimed.origin + aimed.direction * hit.t)), 2e-3f);
    }
    EXPECT_GT(found, 500);
}

TEST(Surface, Ellipsoids) {
    std::mt19937 random(5);
    for (int i = 0; i < 50; ++i) {
        const Affine placement = random_affine(random, 1, 2);
        const Sphere sphere{{0.5f, -0.25f, 1}, 0.75f};
        RayScene scene;
        scene.place(scene.add(std::vector<Sphere>{sphere}), placement);
        scene.build();
        for (int j = 0; j < 50; ++j) {
            const Vec3 n = random_direction(random);
            const Vec3 target = transform_point(placement, sphere.center + n * sphere.radius);
            const Vec3 center = transform_point(placement, sphere.center);
            const Ray ray{center, normalize(target - center)};
            const Hit hit = closest_hit(scene.view(), ray, {});
            ASSERT_TRUE(hit.found());
            const SurfacePoint point = surface_at(scene.view(), ray, hit);
            expect_near(point.position, target, 1e-5f);
            const Vec3 normal = normalize(transform_normal(scene.instances[0].world_to_object, n));
            expect_near(point.geometric_normal, normal, 1e-4f);
            // Perpendicular to what the map makes of the sphere's tangents.
            const Vec3 tangent = transform_vector(placement, cross(n, random_direction(random)));
            EXPECT_NEAR(dot(point.geometric_normal, normalize(tangent)), 0, 1e-4f);
        }
    }
}

TEST(Surface, MaterialSlots) {
    RayScene scene;
    Mesh mesh;
    for (int i = 0; i < 3; ++i)
        mesh.add({0, 0, static_cast<float>(i)}, {1, 0, static_cast<float>(i)}, {0, 1, static_cast<float>(i)});
    scene.place(scene.add(mesh));
    const std::vector<uint16_t> slots{1, 0, 9};
    const std::vector<uint32_t> materials{70, 71, 72, 73};
    scene.geometries[0].material_slots = slots.data();
    scene.instances[0].first_material = 1, scene.instances[0].slot_count = 3;
    scene.build();
    SceneView view = scene.view();
    view.material_of_slot = materials.data();
    EXPECT_EQ(surface_of(view, 0, 0, 0.2f, 0.2f).material, 72u);
    EXPECT_EQ(surface_of(view, 0, 1, 0.2f, 0.2f).material, 71u);
    EXPECT_EQ(surface_of(view, 0, 2, 0.2f, 0.2f).material, 73u) << "slots beyond the last use the last";
}

// Attributes that are the same at every corner of a vertex are kept once a vertex, and give the same surface.
TEST(Surface, AttributesByVertexOrByCorner) {
    std::mt19937 random(9);
    std::vector<Vec3> positions, normals;
    std::vector<Vec2> uvs;
    for (int i = 0; i < 12; ++i) {
        positions.push_back(random_point(random, 1));
        normals.push_back(random_direction(random));
        uvs.push_back({random_point(random, 2).x, random_point(random, 2).y});
    }
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i < 10; ++i) triangles.push_back({{i, i + 1, i + 2}});
    std::vector<Vec3> of_corner_normals;
    std::vector<Vec2> of_corner_uvs;
    for (const Triangle& t : triangles) {
        for (const uint32_t v : t.v) of_corner_normals.push_back(normals[v]), of_corner_uvs.push_back(uvs[v]);
    }
    const auto scene_of = [&] {
        auto scene = std::make_unique<Scene>();
        scene->add_material({}, {});
        scene->add_mesh(positions, triangles, of_corner_normals, of_corner_uvs, {});
        scene->add_instance(0, {}, std::vector<int32_t>{0}, 1);
        scene->build(1);
        return scene;
    };
    const auto by_vertex = scene_of();
    triangles.push_back({{0, 1, 2}});  // whose corners differ from those before
    for (int i = 0; i < 3; ++i) of_corner_normals.push_back({0, 0, 1}), of_corner_uvs.push_back({5, 5});
    const auto by_corner = scene_of();
    EXPECT_TRUE(by_vertex->view().geometries[0].normals_by_vertex && by_vertex->view().geometries[0].uvs_by_vertex);
    EXPECT_FALSE(by_corner->view().geometries[0].normals_by_vertex || by_corner->view().geometries[0].uvs_by_vertex);
    EXPECT_EQ(by_vertex->bytes()[ScenePart::geometry], sizeof(GeometryView) + 10 * 12 + 12 * (12 + 4 + 8));
    EXPECT_EQ(by_corner->bytes()[ScenePart::geometry], sizeof(GeometryView) + 12 * 12 + 11 * (12 + 3 * (4 + 8)));
    for (uint32_t i = 0; i < 10; ++i) {
        const SurfacePoint a = surface_of(by_vertex->view(), 0, i, 0.25f, 0.5f),
                           b = surface_of(by_corner->view(), 0, i, 0.25f, 0.5f);
        expect_near(a.shading_normal, b.shading_normal, 0);
        EXPECT_EQ(a.uv.x, b.uv.x);
        EXPECT_EQ(a.uv.y, b.uv.y);
        EXPECT_NEAR(a.uv.x, 0.25f * (uvs[i].x + uvs[i + 1].x) + 0.5f * uvs[i + 2].x, 1e-6f);
    }
}

}  // namespace
}  // namespace vlp::test
