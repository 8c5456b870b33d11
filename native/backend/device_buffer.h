// Memory on a GPU that says what it was for when it cannot be had.
#pragma once

#include <cuda_runtime.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace vlp {

inline void check_cuda(cudaError_t error, const std::string& what) {
    if (error != cudaSuccess) {
        throw std::runtime_error("device CUDA: " + what + ": " + cudaGetErrorString(error));
    }
}

template <typename T>
class DeviceBuffer {
public:
    DeviceBuffer() = default;
    DeviceBuffer(size_t count, const std::string& what) : count_(count) {
        if (count == 0) return;
        check_cuda(cudaMalloc(&data_, bytes()), "allocating " + std::to_string(bytes()) + " bytes for " + what);
    }
    DeviceBuffer(DeviceBuffer&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
    DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
        std::swap(data_, other.data_);
        std::swap(count_, other.count_);
        return *this;
    }
    ~DeviceBuffer() { cudaFree(data_); }

    T* data() const { return data_; }
    size_t size() const { return count_; }
    size_t bytes() const { return count_ * sizeof(T); }

private:
    T* data_ = nullptr;
    size_t count_ = 0;
};

}  // namespace vlp
