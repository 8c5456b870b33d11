// Rays per second of a GPU through wide and through compressed nodes, what they read, and how much of the bandwidth of its
// memory that is; see README.md. Compiled with VLP_COUNT_VISITS, by which the host counts.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/ray_scenes.h"
#include "bvh/compressed_traverse.h"
#include "bvh/traverse.h"

namespace vlp {

// What a thread does with a ray; 1 or the distance of what it hits, 0: nothing.
struct WideClosest {
    VLP_HD static float trace(const SceneView& scene, const Ray& ray) {
        const Hit hit = closest_hit(scene, ray, {});
        return hit.found() ? hit.t : 0;
    }
};
struct CompressedClosest {
    VLP_HD static float trace(const SceneView& scene, const Ray& ray) {
        const Hit hit = closest_hit_compressed(scene, ray, {});
        return hit.found() ? hit.t : 0;
    }
};
struct WideAny {
    VLP_HD static float trace(const SceneView& scene, const Ray& ray) { return any_hit(scene, ray, {}, {}) ? 1 : 0; }
};
struct CompressedAny {
    VLP_HD static float trace(const SceneView& scene, const Ray& ray) {
        return any_hit_compressed(scene, ray, {}, {}) ? 1 : 0;
    }
};

namespace bench {
namespace {

constexpr uint32_t k_block_size = 128;
constexpr int k_repeats = 20;
constexpr uint32_t k_counted = 1u << 16;  // rays that the host counts
constexpr size_t k_rays_to_one_that_differs = 100'000;  // at least: rounding decides at the edges of surfaces

void check(cudaError_t error) {
    if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

template <typename Search>
__global__ void __launch_bounds__(k_block_size)
    trace_rays(const __grid_constant__ SceneView scene, const Ray* rays, uint32_t count, float* found) {
    const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i < count) found[i] = Search::trace(scene, rays[i]);
}

__global__ void copy_rows(const float4* from, float4* to, size_t count) {
    for (size_t i = blockIdx.x * size_t{blockDim.x} + threadIdx.x; i < count; i += size_t{gridDim.x} * blockDim.x) {
        to[i] = from[i];
    }
}

template <typename T>
class OnDevice {
public:
    explicit OnDevice(size_t count) : count_(count) {
        check(cudaMalloc(&data_, std::max<size_t>(count, 1) * sizeof(T)));
    }
    explicit OnDevice(std::span<const T> v) : OnDevice(v.size()) {
        check(cudaMemcpy(data_, v.data(), v.size() * sizeof(T), cudaMemcpyHostToDevice));
    }
    OnDevice(const OnDevice&) = delete;
    OnDevice& operator=(const OnDevice&) = delete;
    ~OnDevice() { cudaFree(data_); }

    T* data() const { return data_; }
    std::vector<T> read() const {
        std::vector<T> v(count_);
        check(cudaMemcpy(v.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost));
        return v;
    }

private:
    T* data_ = nullptr;
    size_t count_;
};

// Of the fastest of several launches, after one to warm up.
template <typename Launch>
double seconds_of(const Launch& launch) {
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin));
    check(cudaEventCreate(&end));
    float best = k_infinity;
    for (int i = 0; i <= k_repeats; ++i) {
        check(cudaEventRecord(begin));
        launch();
        check(cudaGetLastError());
        check(cudaEventRecord(end));
        check(cudaEventSynchronize(end));
        float milliseconds = 0;
        check(cudaEventElapsedTime(&milliseconds, begin, end));
        if (i > 0) best = std::min(best, milliseconds);
    }
    cudaEventDestroy(begin), cudaEventDestroy(end);
    return 1e-3 * static_cast<double>(best);
}

// Bytes a second, read and written.
double copy_bandwidth() {
    constexpr size_t k_rows = size_t{1} << 26;  // of 16 bytes: a gigabyte
    const OnDevice<float4> from(k_rows), to(k_rows);
    check(cudaMemset(from.data(), 0, k_rows * sizeof(float4)));
    const double seconds = seconds_of([&] { copy_rows<<<8192, 256>>>(from.data(), to.data(), k_rows); });
    return 2.0 * k_rows * sizeof(float4) / seconds;
}

// The least that a search does with what it visits, in operations on single precision numbers, a product and a sum in one. For
// each of a node's eight children: where the ray meets six planes, the last entry and the first exit of them, a comparison.
// For a triangle: three vertices in the ray's space (9 differences, 6 shears), twice three products for the edges, their sum,
// and the distance (3).
constexpr double k_node_operations = 8 * (6 + 6 + 1), k_triangle_operations = 9 + 6 + 6 + 2 + 3;

// Such operations that the GPU can begin in a second.
double operations_per_second() {
    int device = 0, processors = 0, kilohertz = 0, major = 0, minor = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
    check(cudaDeviceGetAttribute(&kilohertz, cudaDevAttrClockRate, device));
    check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
    const int lanes = major < 8 || (major == 8 && minor == 0) ? 64 : 128;  // a processor, by the CUDA programming guide
    return 1e3 * kilohertz * processors * lanes;
}

// On average; those that a block lacks are not looked at.
double triangles_in_a_block(std::span<const TriangleBlock> blocks) {
    size_t triangles = 0;
    for (const TriangleBlock& block : blocks) {
        for (const uint32_t primitive : block.primitive) triangles += primitive != k_none;
    }
    return static_cast<double>(triangles) / static_cast<double>(blocks.size());
}

struct Form {
    const char* name;
    size_t node_bytes;
    SceneView here, there;  // on the host and on the device
};

struct Measured {
    double rays_per_second, bytes_per_ray, operations_per_ray;
    std::vector<float> found;
};

template <typename Search>
Measured measure(const Form& form, const std::vector<Ray>& rays, double triangles_in_a_block) {
    const OnDevice<Ray> rays_there(rays);
    const OnDevice<float> found(rays.size());
    const auto count = static_cast<uint32_t>(rays.size());
    const double seconds = seconds_of([&] {
        trace_rays<Search><<<(count + k_block_size - 1) / k_block_size, k_block_size>>>(form.there, rays_there.data(),
                                                                                        count, found.data());
    });
    visited_nodes = visited_blocks = 0;
    const uint32_t step = std::max(1u, count / k_counted);
    double counted = 0;
    for (uint32_t i = 0; i < count; i += step, ++counted) Search::trace(form.here, rays[i]);
    const double tree = static_cast<double>(visited_nodes) * static_cast<double>(form.node_bytes) +
                        static_cast<double>(visited_blocks) * sizeof(TriangleBlock);
    const double operations = static_cast<double>(visited_nodes) * k_node_operations +
                              static_cast<double>(visited_blocks) * triangles_in_a_block * k_triangle_operations;
    return {count / seconds, tree / counted + sizeof(Ray) + sizeof(float), operations / counted, found.read()};
}

// How many differ by more than rounding, which decides between triangles that share an edge.
size_t differing(const std::vector<float>& a, const std::vector<float>& b) {
    size_t count = 0;
    for (size_t i = 0; i < a.size(); ++i) count += !(std::fabs(a[i] - b[i]) <= 1e-5f * std::fabs(a[i]));
    return count;
}

int run(const char* out) {
    check(cudaFree(nullptr));  // is there a GPU?
    ThreadPool pool;
    const BenchScene scene = make_scene(1);
    const Bvh bvh = build_bvh(scene.geometries, scene.instances, pool);
    const std::vector<CompressedNode> compressed = compress(bvh.nodes, pool);
    const OnDevice<BvhNode> nodes_there(bvh.nodes);
    const OnDevice<CompressedNode> compressed_there(compressed);
    const OnDevice<TriangleBlock> triangles(bvh.triangle_blocks);
    const OnDevice<SphereBlock> spheres(bvh.sphere_blocks);
    const OnDevice<uint32_t> roots(bvh.instance_roots);
    const OnDevice<InstanceView> instances(scene.instances);

    Form wide{"wide", sizeof(BvhNode), scene.view(bvh), {}};
    wide.there.instances = instances.data();
    wide.there.bvh = {nodes_there.data(), triangles.data(), spheres.data(), roots.data(), bvh.root};
    Form packed{"compressed", sizeof(CompressedNode), wide.here, wide.there};
    packed.here.bvh.nodes = packed.there.bvh.nodes = nullptr;
    packed.here.bvh.compressed = compressed.data(), packed.there.bvh.compressed = compressed_there.data();

    std::vector<RaySet> sets = make_rays(scene, bvh);
    RaySet scattered = sets[1];  // bounces: neighbouring threads have nothing in common
    scattered.name = "scattered bounce";
    std::shuffle(scattered.rays.begin(), scattered.rays.end(), std::mt19937(1));
    sets.insert(sets.begin() + 2, std::move(scattered));

    const double filled = triangles_in_a_block(bvh.triangle_blocks);
    const double bandwidth = copy_bandwidth(), arithmetic = operations_per_second();
    std::FILE* const file = std::fopen(out, "w");
    if (!file) throw std::runtime_error(std::string("cannot write ") + out);
    std::fprintf(file,
                 "{\"scene\": \"%s\", \"primitives\": %zu, \"copy_bytes_per_second\": %.4g, \"operations_per_second\": "
                 "%.4g, \"rays\": [",
                 scene.name.c_str(), scene.primitive_count(), bandwidth, arithmetic);
    std::printf("\n%s, %zu primitives; memory copies at %.0f GB/s, %.1f T operations/s\n\n", scene.name.c_str(),
                scene.primitive_count(), bandwidth * 1e-9, arithmetic * 1e-12);
    std::printf(
        "| rays | nodes | M rays/s | bytes a ray | GB/s | ns a ray | floor by bytes | floor by operations "
        "|\n|---|---|---|---|---|---|---|---|\n");
    const char* separator = "";
    size_t wrong = 0, searched = 0;
    for (const RaySet& set : sets) {
        const Measured of_wide =
            set.any ? measure<WideAny>(wide, set.rays, filled) : measure<WideClosest>(wide, set.rays, filled);
        const Measured of_packed = set.any ? measure<CompressedAny>(packed, set.rays, filled)
                                           : measure<CompressedClosest>(packed, set.rays, filled);
        wrong += differing(of_wide.found, of_packed.found);
        searched += set.rays.size();
        for (const auto& [form, m] : {std::pair{&wide, &of_wide}, std::pair{&packed, &of_packed}}) {
            const double by_bytes = m->bytes_per_ray / bandwidth, by_operations = m->operations_per_ray / arithmetic;
            std::printf("| %s | %s | %.0f | %.0f | %.0f | %.3f | %.3f | %.3f |\n", set.name, form->name,
                        m->rays_per_second * 1e-6, m->bytes_per_ray, m->rays_per_second * m->bytes_per_ray * 1e-9,
                        1e9 / m->rays_per_second, 1e9 * by_bytes, 1e9 * by_operations);
            std::fprintf(file,
                         "%s\n {\"rays\": \"%s\", \"nodes\": \"%s\", \"rays_per_second\": %.4g, "
                         "\"bytes_per_ray\": %.1f, \"operations_per_ray\": %.1f, \"floor_seconds_by_bytes\": %.4g, "
                         "\"floor_seconds_by_operations\": %.4g}",
                         separator, set.name, form->name, m->rays_per_second, m->bytes_per_ray, m->operations_per_ray,
                         by_bytes, by_operations);
            separator = ",";
        }
    }
    std::fprintf(file, "],\n \"differing\": %zu}\n", wrong);
    std::fclose(file);
    if (wrong > 0) std::fprintf(stderr, "gpu_rays: %zu rays found something else through compressed nodes\n", wrong);
    return wrong > searched / k_rays_to_one_that_differs ? 1 : 0;
}

}  // namespace
}  // namespace bench
}  // namespace vlp

// gpu_rays OUT.json
int main(int argc, char** argv) {
    try {
        return vlp::bench::run(argc > 1 ? argv[1] : "gpu_rays.json");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "gpu_rays: %s\n", error.what());
        return 1;
    }
}
