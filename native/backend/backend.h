// What a device has to do for the renderer: whole iterations of the two passes.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "backend/eye_form.h"
#include "backend/memory.h"
#include "film/film.h"
#include "integrator/pass.h"

namespace vlp {

// What an iteration did, and how far the one under way is; read from any thread.
struct BackendCounters {
    std::atomic<uint32_t> work_done{0}, work_total{1};  // pieces of the iteration under way
    std::atomic<uint32_t> stored_vlps{0};               // V of the last light pass
    std::atomic<uint64_t> dropped{0};                   // estimates that were not finite, left out
    std::atomic<uint64_t> eye_samples{0};               // of complete iterations
    std::atomic<uint64_t> uploaded{0};                  // bytes of scenes that were copied to the device
    std::atomic<EyeForm> eye_form{EyeForm::paths};      // of the last eye pass
};

class Backend {
public:
    virtual ~Backend() = default;
    // Runs the light pass and the eye pass of one iteration and adds them to the sums: those of `film`, or the device's own.
    // Returns false, with the sums untouched, once `stop` is set. A device may go on by itself with what was begun.
    virtual bool run_iteration(uint32_t iteration, Film& film, const std::atomic<bool>& stop) = 0;
    // Waits until iterations that have returned are done, and throws what ended them.
    virtual void finish() {}
    // How many iterations are in the sums that the device keeps to itself.
    virtual uint32_t kept() const { return 0; }
    // Begins to bring them to the host, while further iterations run.
    virtual void begin_collect() {}
    // Moves them, with their number, into `film`.
    virtual void collect(Film&) {}
    // Takes up what has changed since: of the scene that it was made for, or another one, and of the settings. Forgets what
    // it keeps. Throws as the making of a back end does, after which it cannot be used.
    virtual void update(const Scene& scene, const PassSettings& pass) = 0;
    // N where there is no room for as many light paths as the settings ask for.
    virtual uint32_t light_paths(const PassSettings& asked) const { return asked.light_paths; }
    // Adds what it has allocated.
    virtual void add_memory(MemoryByDevice& memory) const = 0;

    BackendCounters counters;
};

// The scene must outlive its back ends.
std::unique_ptr<Backend> make_cpu_backend(const Scene& scene, const PassSettings& pass, unsigned threads);
// Throws std::runtime_error, naming the reason, when there is no usable GPU, or OutOfDeviceMemory.
std::unique_ptr<Backend> make_cuda_backend(const Scene& scene, const PassSettings& pass);

struct DeviceInfo {
    std::string kind;  // "CPU" or "CUDA"
    std::string name;
    uint64_t memory = 0;  // bytes, 0 when unknown
};

// GPUs that can run the passes; empty without a driver or in a build without CUDA.
std::vector<DeviceInfo> cuda_devices();
// What the first GPU reserves for the stacks of as many threads as it runs at a time; 0 where none can tell.
size_t cuda_stack_bytes();

}  // namespace vlp
