// What a refit takes beside a build, how much it says that rays cost more, and how much they do; see README.md.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>

#include "bench/ray_scenes.h"
#include "bvh/refit.h"
#include "bvh/traverse.h"
#include "bvh/update.h"
#include "core/sampler.h"

namespace {

using namespace vlp;
using namespace vlp::bench;

double processor_seconds_of(const std::function<void()>& work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// Bounces and connections: the rays that renders spend most of their time on.
double rays_of(const SceneView& view, const std::vector<RaySet>& sets) {
    return processor_seconds_of([&] {
        double sum = 0;
        for (const RaySet& set : {sets[1], sets[3]}) {
            for (size_t i = 0; i < set.rays.size(); i += 4) {
                const Ray& ray = set.rays[i];
                sum += set.any ? any_hit(view, ray, {}, {}) : closest_hit(view, ray, {}).found();
            }
        }
        if (sum < 0) std::abort();  // keeps the work
    });
}

double random_number(uint32_t i, uint32_t k) { return 2 * static_cast<double>(unit_float(hash(i, k))) - 1; }

Vec3 random_offset(uint32_t i, float size) {
    const auto at = [&](uint32_t k) { return static_cast<float>(random_number(i, k)) * size; };
    return {at(50), at(51), at(52)};
}

struct Motion {
    const char* name;
    std::function<void(BenchScene&, float amount)> apply;
};

void map_positions(BenchScene& scene, const std::function<Vec3(Vec3, uint32_t mesh, uint32_t vertex)>& map) {
    for (uint32_t mesh = 0; mesh < scene.positions.size(); ++mesh) {
        uint32_t vertex = 0;
        for (Vec3& p : scene.positions[mesh]) p = map(p, mesh, vertex++);
    }
}

const Motion k_motions[] = {
    {"one mesh shifts",
     [](BenchScene& scene, float amount) {
         map_positions(scene, [=](Vec3 p, uint32_t mesh, uint32_t) { return mesh == 0 ? p + Vec3{amount, 0, 0} : p; });
     }},
    {"all twist",
     [](BenchScene& scene, float amount) {
         map_positions(scene, [=](Vec3 p, uint32_t, uint32_t) {
             const float c = std::cos(amount * p.z), s = std::sin(amount * p.z);
             return Vec3{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
         });
     }},
    {"meshes scatter",
     [](BenchScene& scene, float amount) {
         map_positions(scene, [=](Vec3 p, uint32_t mesh, uint32_t) { return p + random_offset(mesh, amount); });
     }},
    {"vertices jitter",
     [](BenchScene& scene, float amount) {
         map_positions(scene, [=](Vec3 p, uint32_t mesh, uint32_t vertex) {
             return p + random_offset(hash(mesh, vertex), 0.1f * amount);
         });
     }},
};

void measure(int which, const Motion& motion, float amount) {
    BenchScene scene = make_scene(which);
    ThreadPool pool(1);
    Bvh bvh, built;
    processor_seconds_of([&] { bvh = build_bvh(scene.geometries, scene.instances, pool); });
    motion.apply(scene, amount);
    const Moved moved{std::vector<uint8_t>(scene.geometries.size(), 1), std::vector<uint8_t>(scene.instances.size())};
    const LeafSource source{scene.geometries, scene.instances, nullptr};
    const auto update = [&] {
        update_bvh(bvh, scene.geometries, scene.instances, moved, pool, static_cast<double>(k_infinity));
    };
    const double first = processor_seconds_of(update), second = processor_seconds_of(update);
    const double build = processor_seconds_of([&] { built = build_bvh(scene.geometries, scene.instances, pool); });
    const double growth = refit(bvh, 0, source, {}, pool).cost / *bvh.built_costs[0];
    const std::vector<RaySet> rays = make_rays(scene, built);
    double best = 1e9, best_built = 1e9;
    for (int i = 0; i < 3; ++i) {
        best = min_of(best, rays_of(scene.view(bvh), rays));
        best_built = min_of(best_built, rays_of(scene.view(built), rays));
    }
    std::printf("  %-16s %6.2f  %8.4f %8.4f %8.4f  %6.1f  %6.2f  %6.2f\n", motion.name, static_cast<double>(amount),
                build, first, second, build / second, growth, best / best_built);
}

}  // namespace

// refit [scene]
int main(int argc, char** argv) {
    const int only = argc > 1 ? std::atoi(argv[1]) : -1;
    for (const int which : {0, 1, 4}) {
        if (only >= 0 && only != which) continue;
        make_scene(which).print_name();
        std::printf("  %-16s %6s  %8s %8s %8s  %6s  %6s  %6s\n", "motion", "amount", "build, s", "first", "later",
                    "ratio", "growth", "rays");
        for (const Motion& motion : k_motions) {
            for (const float amount : {0.0f, 0.03f, 0.1f, 0.3f, 1.0f}) {
                if (amount > 0 || &motion == k_motions) measure(which, motion, amount);
            }
        }
    }
}
