// The CUDA back end: memory, streams and launches of a GPU for GpuBackend.
#include <cub/device/device_scan.cuh>

#include "backend/gpu_backend.h"

namespace vlp {
namespace {

constexpr uint32_t k_block_size = 128;

void check_cuda(cudaError_t error, const std::string& what) {
    if (error == cudaSuccess) return;
    cudaGetLastError();  // or the next launch would be blamed
    const std::string message = "device CUDA: " + what + ": " + cudaGetErrorString(error);
    if (error == cudaErrorMemoryAllocation) throw OutOfDeviceMemory(message);
    throw std::runtime_error(message);
}

// As many blocks a processor as let a kernel keep what it works on in registers: those of the steps of a wavefront take less
// than whole passes.
template <typename Body>
constexpr uint32_t k_blocks = 4;
template <>
constexpr uint32_t k_blocks<LightPass> = 2;
template <>
constexpr uint32_t k_blocks<EyePass> = 2;
template <>
constexpr uint32_t k_blocks<GuidedEyePass> = 2;
template <>
constexpr uint32_t k_blocks<GatherLight> = 3;
template <>
constexpr uint32_t k_blocks<FindSurfaces> = 5;

template <typename Body>
__global__ void __launch_bounds__(k_block_size, k_blocks<Body>)
    run(const __grid_constant__ Body body, uint32_t begin, uint32_t end) {
    const uint32_t i = begin + blockIdx.x * blockDim.x + threadIdx.x;
    if (i < end) body(i);
}

// Of one kernel: the driver keeps stacks for all threads that the GPU has room for.
template <typename Body>
size_t stack_bytes_of() {
    cudaFuncAttributes kernel;
    int device = 0, processors = 0, threads = 0;
    check_cuda(cudaFuncGetAttributes(&kernel, run<Body>), "asking about a kernel");
    check_cuda(cudaGetDevice(&device), "asking for the GPU");
    check_cuda(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device), "asking about the GPU");
    check_cuda(cudaDeviceGetAttribute(&threads, cudaDevAttrMaxThreadsPerMultiProcessor, device),
               "asking about the GPU");
    return kernel.localSizeBytes * static_cast<size_t>(processors) * static_cast<size_t>(threads);
}

size_t most_stack_bytes() {
    return std::max({stack_bytes_of<LightPass>(), stack_bytes_of<EyePass>(), stack_bytes_of<GuidedEyePass>()});
}  // those of a wavefront are smaller

class CudaDevice {
public:
    static constexpr const char* k_name = "CUDA";

    class Event {
    public:
        explicit Event(CudaDevice&) {
            // Waiting leaves the processor to others, such as the CPU back end of HYBRID.
            check_cuda(cudaEventCreateWithFlags(&event, cudaEventBlockingSync | cudaEventDisableTiming),
                       "making an event");
        }
        Event(const Event&) = delete;
        Event& operator=(const Event&) = delete;
        ~Event() { cudaEventDestroy(event); }

        cudaEvent_t event = nullptr;
    };

    CudaDevice() {
        check_cuda(cudaStreamCreateWithFlags(&passes_, cudaStreamNonBlocking), "making a stream");
        check_cuda(cudaStreamCreateWithFlags(&copies_, cudaStreamNonBlocking), "making a stream");
    }
    CudaDevice(const CudaDevice&) = delete;
    CudaDevice& operator=(const CudaDevice&) = delete;
    ~CudaDevice() {
        cudaStreamDestroy(passes_);
        cudaStreamDestroy(copies_);
    }

    void* allocate(size_t bytes, bool on_host) {
        void* data = nullptr;
        const cudaError_t error = on_host ? cudaMallocHost(&data, bytes) : cudaMalloc(&data, bytes);
        if (error != cudaErrorMemoryAllocation) check_cuda(error, "allocating " + std::to_string(bytes) + " bytes");
        cudaGetLastError();
        return data;
    }
    void release(void* data, bool on_host) { on_host ? cudaFreeHost(data) : cudaFree(data); }

    // In the passes' stream, so that they come after it. It waits, as drivers may read pageable memory later than they return.
    void upload(void* to, const void* from, size_t bytes) {
        check_cuda(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, passes_), "uploading the scene");
        check_cuda(cudaStreamSynchronize(passes_), "uploading the scene");
    }
    void clear(void* to, size_t bytes) {
        if (bytes > 0) check_cuda(cudaMemsetAsync(to, 0, bytes, passes_), "clearing memory");
    }
    void download(Queue in, void* to, const void* from, size_t bytes) {
        check_cuda(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream(in)), "reading from the GPU");
    }
    template <typename Body>
    void launch(uint32_t begin, uint32_t end, const Body& body) {
        const uint32_t blocks = std::max(1u, (end - begin + k_block_size - 1) / k_block_size);
        run<<<blocks, k_block_size, 0, passes_>>>(body, begin, end);
        const cudaError_t error = cudaGetLastError();
        if (error == cudaErrorMemoryAllocation) {
            check_cuda(error, "allocating " + std::to_string(stack_bytes_) + " bytes for the stacks of the passes");
        }
        check_cuda(error, "starting a pass");
    }
    void scan(uint32_t* counts, uint32_t n, void* scratch, size_t scratch_bytes) {
        size_t needed = 0;
        cub::DeviceScan::ExclusiveSum(nullptr, needed, counts, counts, static_cast<int>(n), passes_);
        if (needed > scratch_bytes) throw std::runtime_error("device CUDA: a scan needs more memory than foreseen");
        check_cuda(cub::DeviceScan::ExclusiveSum(scratch, scratch_bytes, counts, counts, static_cast<int>(n), passes_),
                   "a scan");
    }

    void record(Event& event, Queue in) { check_cuda(cudaEventRecord(event.event, stream(in)), "the passes"); }
    void queue_wait(Queue in, Event& event) { check_cuda(cudaStreamWaitEvent(stream(in), event.event), "the passes"); }
    void wait(Event& event) { check_cuda(cudaEventSynchronize(event.event), "the passes"); }
    bool is_over(Event& event) {
        const cudaError_t state = cudaEventQuery(event.event);
        if (state != cudaErrorNotReady) check_cuda(state, "the passes");
        return state == cudaSuccess;
    }

    size_t stack_bytes() const { return stack_bytes_; }

private:
    cudaStream_t stream(Queue in) const { return in == Queue::passes ? passes_ : copies_; }

    const size_t stack_bytes_ = most_stack_bytes();  // a device that is lost tells nothing
    cudaStream_t passes_ = nullptr, copies_ = nullptr;
};

}  // namespace

std::unique_ptr<Backend> make_cuda_backend(const Scene& scene, const PassSettings& pass) {
    int count = 0;
    check_cuda(cudaGetDeviceCount(&count), "no usable GPU");
    if (count == 0) throw std::runtime_error("device CUDA: there is no GPU");
    return std::make_unique<GpuBackend<CudaDevice>>(scene, pass);
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

size_t cuda_stack_bytes() {
    try {
        return cuda_devices().empty() ? 0 : most_stack_bytes();
    } catch (const std::runtime_error&) {  // as where this build has no code for the GPU
        return 0;
    }
}

}  // namespace vlp
