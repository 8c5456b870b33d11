// How many nodes and blocks a ray walks through: to set against its time. Compiled with VLP_COUNT_VISITS.
#include <cstdio>

#include "bench/ray_scenes.h"
#include "bvh/traverse.h"

int main() {
    using namespace vlp;
    using namespace vlp::bench;
    ThreadPool pool(1);
    for (int i = 0; i < k_scene_count; ++i) {
        const BenchScene scene = make_scene(i);
        scene.print_name();
        const Bvh bvh = build_bvh(scene.geometries, scene.instances, pool);
        const SceneView view = scene.view(bvh);
        for (const RaySet& set : make_rays(scene, bvh)) {
            visited_nodes = visited_blocks = 0;
            for (const Ray& ray : set.rays) {
                if (set.any) {
                    any_hit(view, ray, {}, {});
                } else {
                    closest_hit(view, ray, {});
                }
            }
            const auto rays = static_cast<double>(set.rays.size());
            const double nodes = static_cast<double>(visited_nodes) / rays;
            const double blocks = static_cast<double>(visited_blocks) / rays;
            std::printf("  %-10s %6.2f nodes %6.2f blocks %8.0f bytes a ray\n", set.name, nodes, blocks,
                        nodes * sizeof(BvhNode) + blocks * sizeof(TriangleBlock));
        }
    }
}
