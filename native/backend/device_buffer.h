// Memory on a GPU that says what it was for when it cannot be had.
#pragma once

#include <cuda_runtime.h>

#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

namespace vlp {

inline void check_cuda(cudaError_t error, const std::string& what) {
    if (error != cudaSuccess) {
        throw std::runtime_error("device CUDA: " + what + ": " + cudaGetErrorString(error));
    }
}

// Bytes that all buffers may take together: the environment variable VLP_BPT_GPU_MEMORY, for those who share a GPU and
// for tests; else as many as there are.
inline size_t device_memory_limit() {
    const char* const limit = std::getenv("VLP_BPT_GPU_MEMORY");
    return limit ? static_cast<size_t>(std::strtoull(limit, nullptr, 10)) : ~size_t{0};
}

inline std::atomic<size_t>& device_memory_taken() {
    static std::atomic<size_t> taken{0};
    return taken;
}

template <typename T>
class DeviceBuffer {
public:
    DeviceBuffer() = default;
    DeviceBuffer(size_t count, const std::string& what) : count_(count) {
        if (count == 0) return;
        const bool fits = device_memory_taken() + bytes() <= device_memory_limit();
        check_cuda(fits ? cudaMalloc(&data_, bytes()) : cudaErrorMemoryAllocation,
                   "allocating " + std::to_string(bytes()) + " bytes for " + what);
        device_memory_taken() += bytes();
    }
    DeviceBuffer(DeviceBuffer&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
    DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
        std::swap(data_, other.data_);
        std::swap(count_, other.count_);
        return *this;
    }
    ~DeviceBuffer() {
        if (data_ == nullptr) return;
        cudaFree(data_);
        device_memory_taken() -= bytes();
    }

    T* data() const { return data_; }
    size_t size() const { return count_; }
    size_t bytes() const { return count_ * sizeof(T); }

private:
    T* data_ = nullptr;
    size_t count_ = 0;
};

}  // namespace vlp
