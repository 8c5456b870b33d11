// What a device has to do for the renderer: whole iterations of the two passes.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "film/film.h"
#include "integrator/pass.h"

namespace vlp {

class Scene;

// What an iteration did, and how far the one under way is; read from any thread.
struct BackendCounters {
    std::atomic<uint32_t> work_done{0}, work_total{1};  // pieces of the iteration under way
    std::atomic<uint32_t> stored_vlps{0};               // V of the last light pass
    std::atomic<uint64_t> dropped{0};                   // estimates that were not finite, left out
};

class Backend {
public:
    virtual ~Backend() = default;
    // Runs the light pass and the eye pass of one iteration into film.frame() and commits it. Returns false, with the sums
    // untouched, once `stop` is set.
    virtual bool run_iteration(uint32_t iteration, Film& film, const std::atomic<bool>& stop) = 0;
    virtual size_t bytes() const = 0;

    BackendCounters counters;
};

// The scene must outlive its back ends.
std::unique_ptr<Backend> make_cpu_backend(const Scene& scene, const PassSettings& pass, unsigned threads);
// Throws std::runtime_error, naming the reason, when there is no usable GPU or it has too little memory.
std::unique_ptr<Backend> make_cuda_backend(const Scene& scene, const PassSettings& pass);

struct DeviceInfo {
    std::string kind;  // "CPU" or "CUDA"
    std::string name;
    uint64_t memory = 0;  // bytes, 0 when unknown
};

// GPUs that can run the passes; empty without a driver or in a build without CUDA.
std::vector<DeviceInfo> cuda_devices();

}  // namespace vlp
