// The CUDA back end: the CPU's passes, one thread a path, from kernels of a few lines.
#include <algorithm>
#include <cub/device/device_scan.cuh>

#include "backend/backend.h"
#include "backend/device_buffer.h"
#include "integrator/guides.h"
#include "integrator/light_tracing.h"
#include "scene/scene.h"

namespace vlp {
namespace {

constexpr uint32_t k_block_size = 128;
// Bound how long a kernel runs before `stop` is looked at.
constexpr uint32_t k_pixels_per_launch = 1u << 18, k_paths_per_launch = 1u << 18;

uint32_t blocks_for(uint32_t threads) { return (threads + k_block_size - 1) / k_block_size; }

struct AtomicAdd {
    __device__ uint64_t operator()(uint64_t& word, uint64_t x) const {
        return atomicAdd(reinterpret_cast<unsigned long long*>(&word), static_cast<unsigned long long>(x));
    }
};

__global__ void light_pass(SceneView scene, PassSettings pass, uint32_t iteration, Window window, uint32_t first_path,
                           uint32_t end_path, LightVertex* slots, uint32_t* stored_in_path, ExactSum* splats,
                           ExactSum* point_splats, unsigned long long* dropped) {
    const uint32_t path = first_path + blockIdx.x * blockDim.x + threadIdx.x;
    if (path >= end_path) return;
    LightVertex* own = slots + static_cast<size_t>(path) * pass.light_path_length;
    SplatSink<AtomicAdd> sink{pass, window, splats, point_splats, {}};
    const LightPathCounts counts = trace_light_path(scene, pass, k_light_stream, iteration, path, own, sink);
    for (uint32_t i = counts.vertices; i < pass.light_path_length; ++i) own[i].packed = 0;
    stored_in_path[path] = counts.connectible;
    if (sink.dropped > 0) atomicAdd(dropped, static_cast<unsigned long long>(sink.dropped));
}

// Lists the slots that can be connected, in their order: `end_of_path` is the inclusive scan of stored_in_path.
__global__ void list_stored(PassSettings pass, const LightVertex* slots, const uint32_t* end_of_path,
                            uint32_t* stored) {
    const uint32_t path = blockIdx.x * blockDim.x + threadIdx.x;
    if (path >= pass.light_paths) return;
    uint32_t next = path == 0 ? 0 : end_of_path[path - 1];
    const uint32_t first = path * pass.light_path_length;
    for (uint32_t slot = first; slot < first + pass.light_path_length; ++slot) {
        if (slots[slot].connectible()) stored[next++] = slot;
    }
}

// `found` is the part of the sink that sums up the pixel.
template <typename Sink>
__device__ void trace_pixel(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                            uint32_t iteration, Window window, uint32_t pixel, Sink& sink, const PixelSink& found,
                            PixelSample* frame, unsigned long long* dropped) {
    const uint32_t x = window.x + pixel % window.width, y = window.y + pixel / window.width;
    const float alpha = trace_eye_path(scene, pass, cache, iteration, x, y, sink);
    if (found.dropped > 0) atomicAdd(dropped, static_cast<unsigned long long>(found.dropped));
    frame[pixel] = {{found.radiance.r, found.radiance.g, found.radiance.b, alpha}};
}

__global__ void eye_pass(SceneView scene, PassSettings pass, LightVertexCache cache, uint32_t iteration, Window window,
                         uint32_t first_pixel, uint32_t end_pixel, PixelSample* frame, unsigned long long* dropped) {
    const uint32_t pixel = first_pixel + blockIdx.x * blockDim.x + threadIdx.x;
    if (pixel >= end_pixel) return;
    PixelSink sink{pass};
    trace_pixel(scene, pass, cache, iteration, window, pixel, sink, sink, frame, dropped);
}

// A kernel of its own: without guides the eye pass has no code for them.
__global__ void guided_eye_pass(SceneView scene, PassSettings pass, LightVertexCache cache, uint32_t iteration,
                                Window window, uint32_t first_pixel, uint32_t end_pixel, PixelSample* frame,
                                unsigned long long* dropped, GuideSample* guides) {
    const uint32_t pixel = first_pixel + blockIdx.x * blockDim.x + threadIdx.x;
    if (pixel >= end_pixel) return;
    GuidedSink sink(pass, scene);
    trace_pixel(scene, pass, cache, iteration, window, pixel, sink, sink.pixel, frame, dropped);
    guides[pixel] = sink.guide();
}

class CudaBackend final : public Backend {
public:
    CudaBackend(const Scene& scene, const PassSettings& pass) : pass_(pass) {
        scene_ = scene.view_placed([this](const void* data, size_t bytes) -> const void* {
            DeviceBuffer<std::byte> buffer(bytes, "the scene");
            check_cuda(cudaMemcpy(buffer.data(), data, bytes, cudaMemcpyHostToDevice), "uploading the scene");
            bytes_ += bytes;
            scene_buffers_.push_back(std::move(buffer));
            return scene_buffers_.back().data();
        });
        dropped_ = DeviceBuffer<unsigned long long>(1, "a counter");
        frame_ = DeviceBuffer<PixelSample>(scene.window().pixel_count(), "the film");
        if (pass_.splats) splats_ = DeviceBuffer<ExactSum>(scene.window().pixel_count() * 3, "splats");
        if (pass_.splats && pass_.guides)
            point_splats_ = DeviceBuffer<ExactSum>(scene.window().pixel_count() * 3, "splats");
        if (pass_.guides) guides_ = DeviceBuffer<GuideSample>(scene.window().pixel_count(), "a denoiser's guides");
        bytes_ += frame_.bytes() + splats_.bytes() + point_splats_.bytes() + guides_.bytes();
        if (pass_.traces_light()) {
            const size_t capacity = static_cast<size_t>(pass_.light_paths) * pass_.light_path_length;
            slots_ = DeviceBuffer<LightVertex>(capacity, "light vertices");
            stored_ = DeviceBuffer<uint32_t>(capacity, "the list of virtual light points");
            end_of_path_ = DeviceBuffer<uint32_t>(pass_.light_paths, "counts of virtual light points");
            size_t scratch = 0;
            cub::DeviceScan::InclusiveSum(nullptr, scratch, end_of_path_.data(), end_of_path_.data(),
                                          static_cast<int>(pass_.light_paths));
            scratch_ = DeviceBuffer<std::byte>(scratch, "a scan");
            bytes_ += slots_.bytes() + stored_.bytes() + end_of_path_.bytes() + scratch_.bytes();
        }
    }

    bool run_iteration(uint32_t iteration, Film& film, const std::atomic<bool>& stop) override {
        const Window window = film.window();
        const uint32_t pixels = static_cast<uint32_t>(window.pixel_count());
        counters.work_done = 0;
        counters.work_total = pixels;
        check_cuda(cudaMemset(dropped_.data(), 0, dropped_.bytes()), "clearing a counter");
        const LightVertexCache cache = run_light_pass(iteration, window, stop);
        for (uint32_t first = 0; first < pixels; first += k_pixels_per_launch) {
            if (stop) return false;
            const uint32_t end = std::min(pixels, first + k_pixels_per_launch);
            if (pass_.guides) {
                guided_eye_pass<<<blocks_for(end - first), k_block_size>>>(scene_, pass_, cache, iteration, window,
                                                                           first, end, frame_.data(), dropped_.data(),
                                                                           guides_.data());
            } else {
                eye_pass<<<blocks_for(end - first), k_block_size>>>(scene_, pass_, cache, iteration, window, first, end,
                                                                    frame_.data(), dropped_.data());
            }
            check_cuda(cudaGetLastError(), "starting the eye pass");
            check_cuda(cudaDeviceSynchronize(), "the eye pass");
            counters.work_done = end;
        }
        if (stop) return false;
        unsigned long long dropped = 0;
        check_cuda(cudaMemcpy(&dropped, dropped_.data(), sizeof dropped, cudaMemcpyDeviceToHost), "reading a counter");
        check_cuda(cudaMemcpy(film.frame().data(), frame_.data(), frame_.bytes(), cudaMemcpyDeviceToHost),
                   "reading the film");
        check_cuda(cudaMemcpy(film.guide_frame().data(), guides_.data(), guides_.bytes(), cudaMemcpyDeviceToHost),
                   "reading a denoiser's guides");
        check_cuda(cudaMemcpy(film.splats().data(), splats_.data(), splats_.bytes(), cudaMemcpyDeviceToHost),
                   "reading the splats");
        check_cuda(
            cudaMemcpy(film.point_splats().data(), point_splats_.data(), point_splats_.bytes(), cudaMemcpyDeviceToHost),
            "reading the splats");
        counters.dropped.fetch_add(dropped, std::memory_order_relaxed);
        film.commit_rows(0, window.height);
        film.count_iteration();
        return true;
    }

    size_t bytes() const override { return bytes_; }

private:
    LightVertexCache run_light_pass(uint32_t iteration, Window window, const std::atomic<bool>& stop) {
        if (slots_.size() == 0) return {};
        const uint32_t paths = pass_.light_paths;
        check_cuda(cudaMemset(splats_.data(), 0, splats_.bytes()), "clearing the splats");
        check_cuda(cudaMemset(point_splats_.data(), 0, point_splats_.bytes()), "clearing the splats");
        for (uint32_t first = 0; first < paths; first += k_paths_per_launch) {
            if (stop) return {};
            const uint32_t end = std::min(paths, first + k_paths_per_launch);
            light_pass<<<blocks_for(end - first), k_block_size>>>(scene_, pass_, iteration, window, first, end,
                                                                  slots_.data(), end_of_path_.data(), splats_.data(),
                                                                  point_splats_.data(), dropped_.data());
            check_cuda(cudaGetLastError(), "starting the light pass");
            check_cuda(cudaDeviceSynchronize(), "the light pass");
        }
        if (!(pass_.kappa > 0)) return {};
        size_t scratch = scratch_.bytes();
        check_cuda(cub::DeviceScan::InclusiveSum(scratch_.data(), scratch, end_of_path_.data(), end_of_path_.data(),
                                                 static_cast<int>(paths)),
                   "counting virtual light points");
        list_stored<<<blocks_for(paths), k_block_size>>>(pass_, slots_.data(), end_of_path_.data(), stored_.data());
        uint32_t count = 0;
        check_cuda(cudaMemcpy(&count, end_of_path_.data() + paths - 1, sizeof count, cudaMemcpyDeviceToHost),
                   "the light pass");
        counters.stored_vlps = count;
        return {slots_.data(), stored_.data(), count};
    }

    PassSettings pass_;
    SceneView scene_;
    std::vector<DeviceBuffer<std::byte>> scene_buffers_;
    DeviceBuffer<LightVertex> slots_;
    DeviceBuffer<uint32_t> stored_, end_of_path_;
    DeviceBuffer<std::byte> scratch_;
    DeviceBuffer<PixelSample> frame_;
    DeviceBuffer<GuideSample> guides_;
    DeviceBuffer<ExactSum> splats_, point_splats_;
    DeviceBuffer<unsigned long long> dropped_;
    size_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<Backend> make_cuda_backend(const Scene& scene, const PassSettings& pass) {
    int count = 0;
    check_cuda(cudaGetDeviceCount(&count), "no usable GPU");
    if (count == 0) throw std::runtime_error("device CUDA: there is no GPU");
    // Waiting leaves the processor to others, such as the CPU back end of HYBRID.
    check_cuda(cudaSetDeviceFlags(cudaDeviceScheduleBlockingSync), "choosing how to wait");
    return std::make_unique<CudaBackend>(scene, pass);
}

std::vector<DeviceInfo> cuda_devices() {
    std::vector<DeviceInfo> devices;
    int count = 0;
    if (cudaGetDeviceCount(&count) != cudaSuccess) count = 0;
    for (int i = 0; i < count; ++i) {
        cudaDeviceProp properties;
        if (cudaGetDeviceProperties(&properties, i) != cudaSuccess) continue;
        devices.push_back({"CUDA", properties.name, properties.totalGlobalMem});
    }
    return devices;
}

}  // namespace vlp
