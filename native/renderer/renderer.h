// The renderer: iterations over a film, until they are enough, the time is up or someone cancels.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>

#include "backend/backend.h"

namespace vlp {

class Scene;

class Renderer {
public:
    // `pass.kappa` is set here, from a pilot light pass over the scene. Iterations count from `first_iteration`, which
    // decides their random numbers: ranges rendered apart add up to what one renderer makes of the whole.
    Renderer(std::shared_ptr<const Scene> scene, PassSettings pass, const std::string& device, unsigned threads,
             uint32_t first_iteration);

    // Runs up to `count` iterations; fewer when cancelled or past the deadline. Returns how many were completed.
    uint32_t iterate(uint32_t count);
    // Makes the `iterate` that is running return within milliseconds, the iteration under way undone; from any thread.
    void cancel() { stop_ = true; }
    // From now; no iteration starts later. 0 or less: no deadline.
    void set_deadline(double seconds);

    float progress() const;  // of the iteration under way, 0 to 1
    const BackendCounters& counters() const { return backend_->counters; }
    const PassSettings& pass() const { return pass_; }
    const Scene& scene() const { return *scene_; }
    Film& film() { return film_; }
    const Film& film() const { return film_; }
    size_t backend_bytes() const { return backend_->bytes(); }

private:
    std::shared_ptr<const Scene> scene_;
    PassSettings pass_;
    Film film_;
    std::unique_ptr<Backend> backend_;
    uint32_t next_iteration_;
    std::atomic<bool> stop_{false};
    std::chrono::steady_clock::time_point deadline_ = std::chrono::steady_clock::time_point::max();
};

// The settings with what the scene makes of them: kappa, from a pilot light pass, and splats only where there are light paths.
PassSettings for_scene(const SceneView& scene, PassSettings pass);

// How many VLPs a light path stores on average, by paths of a stream of their own: the same on every machine.
float pilot_vlps_per_path(const SceneView& scene, const PassSettings& pass);

}  // namespace vlp
