// Rays per second and build times, beside Embree's where that library is; see README.md.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>

#include "bench/ray_scenes.h"
#include "bvh/traverse.h"
#if VLP_WITH_EMBREE
#include "bench/embree_rays.h"
#endif

namespace {

using namespace vlp;
using namespace vlp::bench;

constexpr uint32_t k_chunk = 4096;

double seconds_of(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of all threads together: what other processes take of the processors does not count.
double processor_seconds_of(const std::function<void()>& work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

struct Rate {
    double mrays = 0;
    double sum = 0;  // of what was found, to compare tracers and to keep the work
};

// The best of `repeats` runs: other processes only ever slow a run down.
Rate rate_of(const std::vector<Ray>& rays, ThreadPool& pool, int repeats,
             const std::function<double(const Ray*, const Ray*)>& trace) {
    const auto chunks = static_cast<uint32_t>((rays.size() + k_chunk - 1) / k_chunk);
    std::vector<double> sums(chunks);
    Rate rate;
    for (int i = 0; i < repeats; ++i) {
        const double seconds = processor_seconds_of([&] {
            pool.run(chunks, [&](uint32_t chunk) {
                const Ray* const first = rays.data() + size_t{chunk} * k_chunk;
                sums[chunk] = trace(first, min_of(first + k_chunk, rays.data() + rays.size()));
            });
        });
        rate.mrays = max_of(rate.mrays, static_cast<double>(rays.size()) * pool.size() / seconds * 1e-6);
    }
    for (const double s : sums) rate.sum += s;
    return rate;
}

template <typename Trace>
std::function<double(const Ray*, const Ray*)> over(const Trace& trace) {
    return [trace](const Ray* ray, const Ray* end) {
        double sum = 0;
        for (; ray != end; ++ray) sum += trace(*ray);
        return sum;
    };
}

double finite(float t) { return t < k_infinity ? static_cast<double>(t) : 0.0; }

// The best of several builds, in seconds.
template <typename Build>
double build_seconds(int repeats, const Build& build) {
    double best = 1e9;
    for (int i = 0; i < repeats; ++i) best = min_of(best, build());
    return best;
}

void measure(const BenchScene& scene, unsigned threads, int repeats) {
    Bvh bvh;
    ThreadPool pool(threads);
    const double build = build_seconds(
        repeats, [&] { return seconds_of([&] { bvh = build_bvh(scene.geometries, scene.instances, pool); }); });
    scene.print_name();
    std::printf("  build %.4f s, %.1f MB", build, static_cast<double>(bvh.bytes()) * 1e-6);
    const SceneView view = scene.view(bvh);
    const auto closest = over([&](const Ray& ray) { return finite(closest_hit(view, ray, {}).t); });
    const auto occluded = over([&](const Ray& ray) { return any_hit(view, ray, {}, {}) ? 1.0 : 0.0; });
#if VLP_WITH_EMBREE
    std::printf("; Embree %.4f s", build_seconds(repeats, [&] { return EmbreeScene(scene, threads).build_seconds(); }));
    const EmbreeScene embree(scene, threads);
    const auto embree_closest = over([&](const Ray& ray) { return finite(embree.closest(ray)); });
    const auto embree_occluded = over([&](const Ray& ray) { return embree.occluded(ray) ? 1.0 : 0.0; });
#endif
    std::printf("\n");
    for (const RaySet& set : make_rays(scene, bvh)) {
        const Rate ours = rate_of(set.rays, pool, repeats, set.any ? occluded : closest);
        std::printf("  %-10s %8.2f Mrays/s", set.name, ours.mrays);
#if VLP_WITH_EMBREE
        const Rate theirs = rate_of(set.rays, pool, repeats, set.any ? embree_occluded : embree_closest);
        std::printf("   Embree %8.2f   ratio %.2f   sums differ by %.1e", theirs.mrays, ours.mrays / theirs.mrays,
                    std::fabs(ours.sum - theirs.sum) / theirs.sum);
#endif
        std::printf("\n");
    }
}

}  // namespace

// rays [repeats] [threads] [scene]
int main(int argc, char** argv) {
    const int repeats = argc > 1 ? std::atoi(argv[1]) : 5;
    const auto threads = static_cast<unsigned>(argc > 2 ? std::atoi(argv[2]) : 1);
    const int only = argc > 3 ? std::atoi(argv[3]) : -1;
#if VLP_WITH_EMBREE
    std::printf("%u thread(s), Embree %s, single-ray API\n", threads, EmbreeScene::version().c_str());
#endif
    for (int i = 0; i < k_scene_count; ++i) {
        if (only < 0 || only == i) measure(make_scene(i), threads, repeats);
    }
}
