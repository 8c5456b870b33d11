// Memory on a device that says what it was for when it cannot be had.
#pragma once

#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

namespace vlp {

struct OutOfDeviceMemory : std::runtime_error {
    using std::runtime_error::runtime_error;
};

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

// `count` numbers of the device's memory; `on_host`: of the machine's own, where the device can copy to while it computes. The
// device must outlive them.
template <typename T, typename Device>
class DeviceBuffer {
public:
    DeviceBuffer() = default;
    DeviceBuffer(Device& device, size_t count, const std::string& what, bool on_host = false)
        : device_(&device), count_(count), on_host_(on_host) {
        if (count == 0) return;
        const size_t limit = device_memory_limit(), taken = device_memory_taken();
        if (on_host || (taken <= limit && bytes() <= limit - taken))
            data_ = static_cast<T*>(device.allocate(bytes(), on_host));
        if (data_ == nullptr) {
            throw OutOfDeviceMemory(std::string("device ") + Device::k_name + ": allocating " +
                                    std::to_string(bytes()) + " bytes for " + what + ": out of memory");
        }
        if (!on_host) device_memory_taken() += bytes();
    }
    DeviceBuffer(DeviceBuffer&& other) noexcept { *this = std::move(other); }
    DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
        std::swap(device_, other.device_);
        std::swap(data_, other.data_);
        std::swap(count_, other.count_);
        std::swap(on_host_, other.on_host_);
        return *this;
    }
    ~DeviceBuffer() {
        if (data_ == nullptr) return;
        device_->release(data_, on_host_);
        if (!on_host_) device_memory_taken() -= bytes();
    }

    T* data() const { return data_; }
    size_t size() const { return count_; }
    size_t bytes() const { return count_ * sizeof(T); }

private:
    Device* device_ = nullptr;
    T* data_ = nullptr;
    size_t count_ = 0;
    bool on_host_ = false;
};

}  // namespace vlp
