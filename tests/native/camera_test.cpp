// Cameras: rays and projections are inverses of each other, and splatting light onto the film equals tracing rays.
#include <gtest/gtest.h>

#include <string>

#include "camera/camera_build.h"
#include "camera/projection.h"
#include "goodness_of_fit.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_seed = 20240615;

struct NamedCamera {
    std::string name;
    Camera camera;
};

std::vector<NamedCamera> cameras() {
    CameraParameters p;
    const Frame f = make_frame(normalize(Vec3{0.2f, -0.9f, 0.4f}));
    const Vec3 columns[4] = {
        f.tangent * 2.0f, f.bitangent * -0.5f, f.normal * 3.0f, {1, 2, -3}};  // scaled and mirrored
    for (int j = 0; j < 4; ++j) {
        p.transform.m[0][j] = columns[j].x, p.transform.m[1][j] = columns[j].y, p.transform.m[2][j] = columns[j].z;
    }
    p.half_size = {0.9f, 0.5f};
    p.shift = {0.3f, -0.1f};
    p.width = 8, p.height = 5;
    p.clip_start = 0.5f, p.clip_end = 12;
    p.focus_distance = 3;
    std::vector<NamedCamera> cameras;
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        for (const float aperture : {0.0f, 0.4f}) {
            p.projection = projection;
            p.aperture_radius = aperture;
            const std::string kind = projection == Projection::perspective ? "perspective" : "orthographic";
            cameras.push_back({kind + (aperture > 0 ? " with a lens" : ""), make_camera(p).value()});
        }
        p.half_size = {2.5f, 1.5f};
    }
    return cameras;
}

// Orthographic ones whose near clip plane lies behind the lens.
std::vector<NamedCamera> cameras_that_look_back() {
    std::vector<NamedCamera> found;
    for (NamedCamera c : cameras()) {
        if (c.camera.projection == Projection::perspective) continue;
        c.camera.clip_start = -4;
        found.push_back(c);
    }
    return found;
}

float depth_of(const Camera& camera, Vec3 point) {
    return -camera_to_local(camera, point - camera.camera_to_world.column(3)).z;
}

TEST(CameraRays, TransformIsRigid) {
    for (const NamedCamera& c : cameras()) {
        const Vec3 x = c.camera.camera_to_world.column(0), y = c.camera.camera_to_world.column(1),
                   z = c.camera.camera_to_world.column(2);
        for (const Vec3 a : {x, y, z}) EXPECT_NEAR(length(a), 1, 1e-6);
        for (const float d : {dot(x, y), dot(y, z), dot(z, x)}) EXPECT_NEAR(d, 0, 1e-6);
        EXPECT_NEAR(dot(cross(x, y), z), -1, 1e-6);  // still mirrored
    }
}

// The film's corners and centre by hand.
TEST(CameraRays, LookWhereTheyShould) {
    CameraParameters p;
    p.half_size = {1, 0.5f};
    p.width = 4, p.height = 2;
    p.shift = {0.5f, 0};
    const Ray corner = sample_ray(make_camera(p).value(), {0, 0}, {0.3f, 0.4f});
    EXPECT_LT(length(corner.direction - normalize(Vec3{-0.5f, -0.5f, -1})), 1e-6f);
    EXPECT_EQ(corner.t_max, k_infinity);
    EXPECT_TRUE(corner.origin == Vec3{});
    const Ray top_right = sample_ray(make_camera(p).value(), {4, 2}, {});
    EXPECT_LT(length(top_right.direction - normalize(Vec3{1.5f, 0.5f, -1})), 1e-6f);
    p.projection = Projection::orthographic;
    const Ray parallel = sample_ray(make_camera(p).value(), {1, 2}, {});
    EXPECT_TRUE(parallel.direction == (Vec3{0, 0, -1}));
    EXPECT_TRUE(parallel.origin == (Vec3{0, 0.5f, 0}));
}

TEST(CameraRays, StayBetweenTheClipPlanesAndMeetInTheFocus) {
    Random random{k_seed};
    for (const NamedCamera& c : cameras()) {
        SCOPED_TRACE(c.name);
        const Vec2 film{3.3f, 1.7f};
        Vec3 focus;
        float radius2 = 0;
        for (int i = 0; i < 1000; ++i) {
            const Ray ray = sample_ray(c.camera, film, random.next_2d());
            EXPECT_NEAR(length(ray.direction), 1, 1e-6);
            EXPECT_NEAR(depth_of(c.camera, ray.origin), c.camera.clip_start, 1e-5);
            EXPECT_NEAR(depth_of(c.camera, ray.origin + ray.t_max * ray.direction), c.camera.clip_end, 2e-5);
            const float cosine = cosine_to_view(c.camera, ray.direction);
            const Vec3 at_focus =
                ray.origin + ray.direction * ((c.camera.focus_distance - c.camera.clip_start) / cosine);
            if (i == 0) focus = at_focus;
            EXPECT_LT(length(at_focus - focus), 1e-5f);
            const Vec3 lens = ray.origin - ray.direction * distance_from_lens(c.camera, ray);
            EXPECT_NEAR(depth_of(c.camera, lens), 0, 1e-5);
            const Ray middle = sample_ray(c.camera, film, {0.5f, 0.5f});
            const Vec3 lens_center = middle.origin - middle.direction * distance_from_lens(c.camera, middle);
            radius2 = max_of(radius2, length_squared(lens - lens_center));
        }
        EXPECT_NEAR(std::sqrt(radius2), c.camera.aperture_radius,
                    0.02 * static_cast<double>(c.camera.aperture_radius) + 1e-5);
    }
}

TEST(CameraRays, ProjectionInvertsThem) {
    Random random{k_seed};
    for (const NamedCamera& c : cameras()) {
        SCOPED_TRACE(c.name);
        for (int i = 0; i < 5000; ++i) {
            const Vec2 film{12 * random.next() - 2, 9 * random.next() - 2};
            const Vec2 lens = sample_lens(c.camera, random.next_2d());
            const Ray ray = camera_ray(c.camera, film, lens);
            const float t = 10 * random.next();
            const FilmProjection back = project(c.camera, lens, ray.origin + t * ray.direction);
            ASSERT_EQ(back.valid, t <= ray.t_max);
            if (!back.valid) continue;
            ASSERT_NEAR(back.film.x, film.x, 2e-4);
            ASSERT_NEAR(back.film.y, film.y, 2e-4);
            ASSERT_LT(length(back.direction - ray.direction), 2e-5f);
            const float from_lens = distance_from_lens(c.camera, ray);
            ASSERT_NEAR(back.distance, t + from_lens, 1e-4);
            ASSERT_LT(length(back.lens - (ray.origin - ray.direction * from_lens)), 1e-4f);
            ASSERT_NEAR(back.pixels_per_area / pixels_per_area(c.camera, ray.direction, t + from_lens), 1, 1e-3);
        }
        const Vec3 o = c.camera.camera_to_world.column(3), backward = c.camera.camera_to_world.column(2);
        EXPECT_FALSE(project(c.camera, {}, o).valid);
        EXPECT_FALSE(project(c.camera, {}, o + backward * 2.0f).valid);
        EXPECT_FALSE(project(c.camera, {}, o - backward * 0.49f).valid);
        EXPECT_TRUE(project(c.camera, {}, o - backward * 0.51f).valid);
        EXPECT_TRUE(project(c.camera, {}, o - backward * 11.9f).valid);
        EXPECT_FALSE(project(c.camera, {}, o - backward * 12.1f).valid);
    }
}

TEST(CameraRays, ProjectionInvertsThemBehindTheLens) {
    Random random{k_seed};
    for (const NamedCamera& c : cameras_that_look_back()) {
        SCOPED_TRACE(c.name);
        for (int i = 0; i < 2000; ++i) {
            const Vec2 film{12 * random.next() - 2, 9 * random.next() - 2},
                lens = sample_lens(c.camera, random.next_2d());
            const Ray ray = camera_ray(c.camera, film, lens);
            const float t = 10 * random.next();
            const FilmProjection back = project(c.camera, lens, ray.origin + t * ray.direction);
            ASSERT_TRUE(back.valid);
            ASSERT_NEAR(back.film.x, film.x, 2e-4);
            ASSERT_NEAR(back.film.y, film.y, 2e-4);
            ASSERT_LT(length(back.direction - ray.direction), 2e-5f);
            const float from_lens = distance_from_lens(c.camera, ray);
            ASSERT_NEAR(back.distance, t + from_lens, 1e-4);
            ASSERT_LT(length(back.lens - (ray.origin - ray.direction * from_lens)), 1e-4f);
        }
        const Vec3 o = c.camera.camera_to_world.column(3), backward = c.camera.camera_to_world.column(2);
        EXPECT_TRUE(project(c.camera, {}, o).valid);
        EXPECT_TRUE(project(c.camera, {}, o + backward * 3.9f).valid);
        EXPECT_FALSE(project(c.camera, {}, o + backward * 4.1f).valid);
    }
}

// A tilted plane that passes both clip planes shines with a radiance that varies; every pixel is measured by rays and
// by splats of points that are uniform on the plane. 160 comparisons of 5 standard errors: a false-alarm rate of 1e-4.
TEST(CameraRays, SplattingLightEqualsTracingRays) {
    Random random{k_seed};
    for (const NamedCamera& c : cameras()) {
        SCOPED_TRACE(c.name);
        const Affine& m = c.camera.camera_to_world;
        const Vec3 center = transform_point(m, {1, 0, -5});
        const Vec3 u = normalize(transform_vector(m, {0.3f, 0.2f, -1})), helper = transform_vector(m, {0, 1, 0.1f});
        const Vec3 v = normalize(helper - u * dot(helper, u)), normal = cross(u, v);
        constexpr float k_half = 8;
        const auto radiance = [](float x, float y) { return 1.5f + std::sin(x) * std::cos(2 * y); };
        const uint32_t width = c.camera.width, pixels = width * c.camera.height;
        std::vector<double> splat(pixels), splat2(pixels);
        constexpr int k_points = 1500000, k_rays = 40000;
        for (int i = 0; i < k_points; ++i) {
            const float x = k_half * (2 * random.next() - 1), y = k_half * (2 * random.next() - 1);
            const FilmProjection p = project(c.camera, sample_lens(c.camera, random.next_2d()), center + u * x + v * y);
            if (!p.valid || !(p.film.x >= 0 && p.film.y >= 0)) continue;
            const uint32_t px = static_cast<uint32_t>(p.film.x), py = static_cast<uint32_t>(p.film.y);
            if (px >= width || py >= c.camera.height) continue;
            const float w = radiance(x, y) * abs_dot(normal, p.direction) * p.pixels_per_area * square(2 * k_half);
            splat[py * width + px] += static_cast<double>(w);
            splat2[py * width + px] += static_cast<double>(w) * static_cast<double>(w);
        }
        int lit = 0;
        for (uint32_t i = 0; i < pixels; ++i) {
            double rays = 0, rays2 = 0;
            for (int k = 0; k < k_rays; ++k) {
                const Vec2 film = Vec2{static_cast<float>(i % width), static_cast<float>(i / width)} + random.next_2d();
                const Ray ray = sample_ray(c.camera, film, random.next_2d());
                const float t = dot(center - ray.origin, normal) / dot(ray.direction, normal);
                const Vec3 p = ray.origin + t * ray.direction - center;
                if (!(t > 0 && t < ray.t_max) || std::fabs(dot(p, u)) > k_half || std::fabs(dot(p, v)) > k_half)
                    continue;
                const double w = static_cast<double>(radiance(dot(p, u), dot(p, v)));
                rays += w, rays2 += w * w;
            }
            rays /= k_rays, rays2 /= k_rays;
            const double mean = splat[i] / k_points, mean2 = splat2[i] / k_points;
            const double variance = (rays2 - rays * rays) / k_rays + (mean2 - mean * mean) / k_points;
            EXPECT_NEAR(mean, rays, 5 * std::sqrt(variance) + 1e-4 * rays) << "pixel " << i << ", seed " << k_seed;
            lit += rays > 0.1;
        }
        EXPECT_GT(lit, static_cast<int>(pixels) / 4);
        EXPECT_LT(lit, static_cast<int>(pixels));
    }
}

TEST(CameraRays, SenselessCamerasAreRefused) {
    const CameraParameters good;
    EXPECT_TRUE(make_camera(good));
    const float nan = std::nanf("");
    const auto refused = [&](auto change) {
        CameraParameters p = good;
        change(p);
        return !make_camera(p);
    };
    EXPECT_TRUE(refused([](CameraParameters& p) { p.transform.m[0][0] = 0; }));
    EXPECT_TRUE(refused([](CameraParameters& p) { p.transform.m[0][1] = 1, p.transform.m[1][1] = 0; }));
    EXPECT_TRUE(refused([&](CameraParameters& p) { p.transform.m[1][3] = nan; }));
    EXPECT_TRUE(refused([](CameraParameters& p) { p.half_size.x = 0; }));
    EXPECT_TRUE(refused([&](CameraParameters& p) { p.half_size.y = nan; }));
    EXPECT_TRUE(refused([&](CameraParameters& p) { p.shift.x = nan; }));
    EXPECT_TRUE(refused([](CameraParameters& p) { p.clip_end = 0; }));
    EXPECT_TRUE(refused([](CameraParameters& p) { p.clip_start = -1; }));
    EXPECT_TRUE(refused([](CameraParameters& p) { p.aperture_radius = -1; }));
    EXPECT_TRUE(refused([](CameraParameters& p) { p.width = 0; }));
}

}  // namespace
}  // namespace vlp::test
