// Spheres in the tree: precision, both sides, skipping one of the two roots, instances.
#include <gtest/gtest.h>

#include <optional>

#include "geometry/surface.h"
#include "tests/native/bvh_oracle.h"

namespace vlp::test {
namespace {

TEST(BvhSpheres, AgreeWithDoublePrecision) {
    for (uint32_t seed = 1; seed <= 3; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> uniform(0, 1);
        RayScene scene;
        std::vector<Sphere> spheres;
        for (int i = 0; i < 200; ++i)
            spheres.push_back({random_point(random, 1), 0.2f * uniform(random) * uniform(random)});
        const uint32_t set = scene.add(spheres);
        scene.place(set);
        if (seed > 1) {
            std::vector<Sphere> many;
            for (int i = 0; i < 1500; ++i) many.push_back({random_point(random, 1), 0.05f * uniform(random)});
            const uint32_t shared = scene.add(many);
            for (int i = 0; i < 3; ++i) scene.place(shared, random_affine(random, 0.5f, 1));
            scene.place(scene.add(many), random_affine(random, 0.5f, 1));  // once, but no spheres in world space
        }
        scene.build();
        const BothForms view(scene);
        int found = 0;
        for (int i = 0; i < 2000; ++i) {
            const Ray ray{random_point(random, 2), random_direction(random)};
            const Hit hit = closest_hit(view, ray, {});
            const ExactHit grown = exact_closest(scene, ray, 1e-5), shrunk = exact_closest(scene, ray, -1e-5);
            SCOPED_TRACE(testing::Message() << "seed " << seed << ", ray " << i);
            if (shrunk.found()) {
                ASSERT_TRUE(hit.found());
            }
            if (hit.found()) {
                ASSERT_TRUE(grown.found());
                if (grown.primitive == shrunk.primitive && grown.instance == shrunk.instance) {
                    EXPECT_EQ(hit.primitive, grown.primitive);
                    EXPECT_EQ(hit.instance, grown.instance);
                    EXPECT_GE(hit.t, grown.t - 2e-5);
                    EXPECT_LE(hit.t, shrunk.t + 2e-5);
                }
                ++found;
            }
            EXPECT_EQ(any_hit(view, ray, {}, {}), hit.found());
        }
        EXPECT_GT(found, 100);
    }
}

TEST(BvhSpheres, TinyHugeAndFar) {
    struct Case {
        float radius, distance, tolerance;  // of t, relative to the radius and to rounding of the distance
    };
    for (const Case c :
         {Case{1e-6f, 1, 0}, Case{1e6f, 2e6f, 0}, Case{1, 1e6f, 0}, Case{1e-3f, 100, 0}, Case{1e5f, 1, 0}}) {
        std::mt19937 random(5);
        for (int i = 0; i < 200; ++i) {
            const Vec3 direction = random_direction(random);
            const Vec3 center = direction * (c.distance + c.radius);
            RayScene scene;
            scene.place(scene.add(std::vector<Sphere>{{center, c.radius}}));
            scene.build();
            const Ray ray{{0, 0, 0}, direction};
            const Hit hit = closest_hit(BothForms(scene), ray, {});
            ASSERT_TRUE(hit.found()) << c.radius;
            const double exact = exact_closest(scene, ray).t;
            EXPECT_NEAR(hit.t, exact, 4e-7 * (static_cast<double>(c.distance) + c.radius)) << c.radius;
            // The point is on the sphere to a few units in the last place of its coordinates.
            const SurfacePoint point = surface_at(scene.view(), ray, hit);
            const Double3 off = to_double(point.position) - to_double(center);
            const double rounding = 4e-7 * (static_cast<double>(length(center)) + c.radius);
            EXPECT_NEAR(std::sqrt(dot(off, off)), c.radius, rounding);
        }
    }
}

class OneSphere : public testing::Test {
protected:
    OneSphere() {
        scene_.place(scene_.add(std::vector<Sphere>{{{1, 2, 3}, 2}}));
        scene_.build();
        view_.emplace(scene_);
    }
    RayScene scene_;
    std::optional<BothForms> view_;
};

TEST_F(OneSphere, FromInsideTheFarSideIsHit) {
    const Hit hit = closest_hit(*view_, {{1, 2, 3}, {0, 1, 0}}, {});
    ASSERT_TRUE(hit.found());
    EXPECT_FLOAT_EQ(hit.t, 2);
    const SurfacePoint point = surface_at(view_->wide, {{1, 2, 3}, {0, 1, 0}}, hit);
    EXPECT_FLOAT_EQ(point.geometric_normal.y, 1) << "the outside, not the ray's side";
}

// Rays from the surface: inwards they cross the ball, outwards they hit nothing, however the origin is rounded or moved.
TEST_F(OneSphere, RaysThatLeaveIt) {
    std::mt19937 random(6);
    for (int i = 0; i < 20000; ++i) {
        const Vec3 n = random_direction(random), d = random_direction(random);
        const float cosine = dot(n, d);
        if (std::fabs(cosine) < 1e-4f) continue;
        Vec3 p = Vec3{1, 2, 3} + n * 2.0f;
        if (i % 2) p = offset_origin(p, face_toward(n, d));
        const Hit hit = closest_hit(*view_, {p, d}, {0, 0});
        ASSERT_EQ(hit.found(), cosine < 0) << cosine;
        ASSERT_EQ(any_hit(*view_, {p, d}, {0, 0}, {}), cosine < 0) << cosine;
        if (hit.found()) {
            // Moving the origin by 256 ulps along the normal moves the far side by that over the cosine.
            ASSERT_NEAR(hit.t, -4 * cosine, 4e-4f / std::fabs(cosine)) << cosine;
        }
    }
}

TEST_F(OneSphere, RaysThatGoToIt) {
    const PrimitiveId id{0, 0};
    // To the front: only the end itself is met.
    EXPECT_FALSE(any_hit(*view_, {{-4, 2, 3}, {1, 0, 0}, 3.0001f}, {}, id));
    EXPECT_FALSE(any_hit(*view_, {{-4, 2, 3}, {1, 0, 0}, 2.9999f}, {}, id));
    EXPECT_TRUE(any_hit(*view_, {{-4, 2, 3}, {1, 0, 0}, 3.0001f}, {}, {}));
    // To the back: the ball is in its own way.
    EXPECT_TRUE(any_hit(*view_, {{-4, 2, 3}, {1, 0, 0}, 7.0001f}, {}, id));
    EXPECT_TRUE(any_hit(*view_, {{-4, 2, 3}, {1, 0, 0}, 6.9999f}, {}, id));
    // From its inner side to its inner side.
    EXPECT_FALSE(any_hit(*view_, {{-1, 2, 3}, {1, 0, 0}, 4.0001f}, id, id));
    EXPECT_FALSE(any_hit(*view_, {{-1, 2, 3}, {1, 0, 0}, 3.9999f}, id, id));
}

TEST(BvhSpheres, OtherSpheresStillBlock) {
    RayScene scene;
    scene.place(scene.add(std::vector<Sphere>{{{0, 0, 0}, 1}, {{5, 0, 0}, 1}, {{10, 0, 0}, 1}}));
    scene.build();
    const BothForms view(scene);
    EXPECT_TRUE(any_hit(view, {{1, 0, 0}, {1, 0, 0}, 8}, {0, 0}, {0, 2}));
    EXPECT_FALSE(any_hit(view, {{1, 0, 0}, {1, 0, 0}, 3}, {0, 0}, {0, 1}));
    EXPECT_EQ(closest_hit(view, {{1, 0, 0}, {1, 0, 0}}, {0, 0}).primitive, 1u);
}

}  // namespace
}  // namespace vlp::test
