// How many nodes and blocks a ray walks through: to set against its time. Compiled with VLP_COUNT_VISITS.
#include <cstdio>

#include "bench/ray_scenes.h"
#include "bvh/compressed_traverse.h"
#include "bvh/traverse.h"

namespace {

using namespace vlp;

// Visits of all rays by a search of one form of the tree.
template <typename Search>
void print(const char* form, size_t node_bytes, const bench::RaySet& set, const Search& search) {
    visited_nodes = visited_blocks = 0;
    for (const Ray& ray : set.rays) search(ray);
    const auto rays = static_cast<double>(set.rays.size());
    const double nodes = static_cast<double>(visited_nodes) / rays, blocks = static_cast<double>(visited_blocks) / rays;
    std::printf("  %-10s %-10s %6.2f nodes %6.2f blocks %8.0f bytes a ray\n", set.name, form, nodes, blocks,
                nodes * static_cast<double>(node_bytes) + blocks * sizeof(TriangleBlock));
}

}  // namespace

int main() {
    using namespace vlp::bench;
    ThreadPool pool(1);
    for (int i = 0; i < k_scene_count; ++i) {
        const BenchScene scene = make_scene(i);
        scene.print_name();
        const Bvh bvh = build_bvh(scene.geometries, scene.instances, pool);
        const SceneView view = scene.view(bvh);
        const std::vector<CompressedNode> nodes = compress(bvh.nodes, pool);
        SceneView on_device = view;
        on_device.bvh.nodes = nullptr, on_device.bvh.compressed = nodes.data();
        for (const RaySet& set : make_rays(scene, bvh)) {
            print("wide", sizeof(BvhNode), set,
                  [&](const Ray& ray) { set.any ? any_hit(view, ray, {}, {}) : closest_hit(view, ray, {}).found(); });
            print("compressed", sizeof(CompressedNode), set, [&](const Ray& ray) {
                set.any ? any_hit_compressed(on_device, ray, {}, {})
                        : closest_hit_compressed(on_device, ray, {}).found();
            });
        }
    }
}
