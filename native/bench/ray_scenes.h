// Scenes and rays for the ray benchmark: made by rule, the same in every run.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "bvh/build.h"

namespace vlp::bench {

struct BenchScene {
    std::string name;
    std::deque<std::vector<Vec3>> positions;
    std::deque<std::vector<Triangle>> triangles;
    std::vector<Sphere> spheres;
    std::vector<GeometryView> geometries;
    std::vector<InstanceView> instances;
    Vec3 eye, target;
    std::vector<uint32_t> material_of_slot{0};

    size_t primitive_count() const;
    SceneView view(const Bvh& bvh) const;
};

BenchScene make_ball_in_room();     // 63 thousand triangles: a bumpy ball in a box
BenchScene make_cluttered_room();   // 983 thousand: 48 bumpy balls in a box
BenchScene make_sierpinski();       // 783 spheres of six sizes, in empty space

// Rays as a renderer fires them: one a pixel of 1024 x 1024 in tiles, one diffuse bounce from each hit, and from each hit
// one connection to a hit of another pixel, drawn at random.
struct RaySets {
    std::vector<Ray> camera, bounce, shadow;
};
RaySets make_rays(const BenchScene& scene, const Bvh& bvh);

}  // namespace vlp::bench
