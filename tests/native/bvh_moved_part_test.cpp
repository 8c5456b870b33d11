// Parts of triangles that move: as small as they were, and together no less than the triangle.
#include "bvh/moved_part.h"

#include <gtest/gtest.h>

#include "tests/native/ray_scenes.h"

namespace vlp::test {
namespace {

constexpr float k_far = 1e3f;

bool contains(const Box& box, Vec3 p) { return min_of(box.low, p) == box.low && max_of(box.high, p) == box.high; }

Vec3 at(const Corners& c, float r, float t) { return c.v[0] * (1 - r) + c.v[1] * (r * (1 - t)) + c.v[2] * (r * t); }

TEST(BvhMovedPart, IsTheWholeTriangleWhereItIsNotCut) {
    const Corners from{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, to{{{3, 0, 0}, {4, 0, 1}, {3, 2, 0}}};
    const Box box = moved_part(from, {{0, 0, 0}, {1, 1, 0}}, to);
    EXPECT_EQ(box.low, (Vec3{3, 0, 0}));
    EXPECT_EQ(box.high, (Vec3{4, 2, 1}));
}

TEST(BvhMovedPart, GoesWithItsCorners) {
    const Corners from{{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    const Corners to{{{-10, 0, 5}, {10, 0, 5}, {0, 40, 5}}};
    const Box left = moved_part(from, {{-k_far, -k_far, -k_far}, {0, k_far, k_far}}, to);
    EXPECT_EQ(left.low, (Vec3{-10, 0, 5}));
    EXPECT_EQ(left.high.y, 40);
    EXPECT_EQ(left.high.z, 5);
    EXPECT_NEAR(left.high.x, 0, 1e-4f);
    EXPECT_GE(left.high.x, 10 * 0x1p-22f) << "wider than a ray's test rounds";
    const Box low = moved_part(from, {{-k_far, -k_far, -k_far}, {k_far, 0.5f, k_far}}, to);
    EXPECT_NEAR(low.high.y, 20, 1e-3f);
    EXPECT_EQ(low.high.x, 10);
}

TEST(BvhMovedPart, IsTheWholeTriangleWhereNothingIsLeft) {
    const Corners from{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    const Box box = moved_part(from, {{5, 5, 5}, {6, 6, 6}}, from);
    EXPECT_EQ(box.low, from.v[0]);
    EXPECT_EQ(box.high, (Vec3{1, 1, 0}));
}

// Two boxes on either side of a plane, through triangles of all shapes, flat ones and such without an area among them.
TEST(BvhMovedPart, TwoCoverTheTriangle) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (uint32_t i = 0; i < 20000; ++i) {
        Corners from, to;
        for (Vec3& v : from.v) v = random_point(random, 1);
        for (Vec3& v : to.v) v = random_point(random, 1);
        const auto axis = static_cast<uint32_t>(random() % 3), flat = (axis + 1) % 3;
        if (i % 4 == 1) {
            for (Vec3& v : from.v) (&v.x)[flat] = (&from.v[0].x)[flat];
        } else if (i % 4 == 2) {
            from.v[2] = from.v[0];
        } else if (i % 4 == 3) {
            for (Vec3& v : to.v) (&v.x)[flat] = (&to.v[0].x)[flat];
        }
        const Box whole = box_of(from);
        const float low = (&whole.low.x)[axis], high = (&whole.high.x)[axis];
        Box side[2] = {whole, whole};
        (&side[0].high.x)[axis] = (&side[1].low.x)[axis] = low + (high - low) * uniform(random);
        const Box moved[2] = {moved_part(from, side[0], to), moved_part(from, side[1], to)};
        for (int k = 0; k < 20; ++k) {
            const Vec3 p = at(to, std::sqrt(uniform(random)), k % 2 == 0 ? uniform(random) : 0.0f);
            if (!contains(box_of(to), p)) continue;  // rounded out of the triangle
            ASSERT_TRUE(contains(moved[0], p) || contains(moved[1], p)) << "triangle " << i;
        }
        for (const Vec3 p : to.v) ASSERT_TRUE(contains(moved[0], p) || contains(moved[1], p)) << "triangle " << i;
    }
}

}  // namespace
}  // namespace vlp::test
