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
    void print_name() const;
    SceneView view(const Bvh& bvh) const;
};

// 0: 63 thousand triangles, a bumpy ball in a box. 1: 970 thousand, 48 bumpy balls in it. 2: 783 spheres of six sizes, in
// empty space. 3: 10,000 placements of a ball of 2 thousand triangles, in a box. 4: 6,000 long thin boards at all angles,
// which boxes fit badly.
inline constexpr int k_scene_count = 5;
BenchScene make_scene(int which);

struct RaySet {
    const char* name;
    bool any;  // whether anything is hit, not what is hit first
    std::vector<Ray> rays;
};

// Rays as a renderer fires them: one a pixel of 1024 x 1024 in tiles, one diffuse bounce from each hit, and from each hit
// one to a lamp overhead and one connection to a hit of another pixel, drawn at random.
std::vector<RaySet> make_rays(const BenchScene& scene, const Bvh& bvh);

}  // namespace vlp::bench
