// The renderer: iterations over a film, until they are enough, the time is up or someone cancels.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "renderer/helper.h"
#include "renderer/iterations.h"

namespace vlp {

class Scene;

using MakeBackend = std::function<std::unique_ptr<Backend>(const Scene&, const PassSettings&)>;

// What renders: one device, and one that helps it.
struct Devices {
    std::unique_ptr<Backend> main, helper;  // helper: may be null
    MakeBackend spare;                      // instead of `main` if that fails and nobody helps; may be empty
    std::vector<std::string> notes;         // why they are not what was asked for
};

// Those of a setting `device`. Where there is no usable GPU, CUDA and HYBRID come down to the CPU, with a note. Where the GPU
// has no room for all light paths, `pass` gets fewer, with a note.
Devices make_devices(const std::string& device, const Scene& scene, PassSettings& pass, unsigned threads,
                     const MakeBackend& make_gpu = make_cuda_backend);

class Renderer {
public:
    // `pass` as for_scene gives it. Iterations count from `first`, which decides their random numbers: ranges rendered apart
    // add up to what one renderer makes of the whole, unless sampling is adaptive. A helper takes none from `end` on.
    Renderer(std::shared_ptr<const Scene> scene, const PassSettings& pass, Window window, Devices devices,
             uint32_t first, uint32_t end);

    // Runs up to `count` iterations; fewer when cancelled or past the deadline. Returns how many were completed. A helper may
    // go on with one of its own afterwards, until `rest` or the next call.
    uint32_t iterate(uint32_t count);
    // Makes the `iterate` that is running return within milliseconds, the iterations under way undone; from any thread.
    void cancel() { stop_ = true; }
    // From now; no iteration starts later. 0 or less: no deadline.
    void set_deadline(double seconds);
    // Throws away what a helper has under way. Returns how many iterations it had finished unnoticed.
    uint32_t rest();
    // Brings what a device has kept to itself into the film, for those who read it; not while `iterate` runs. Returns how
    // many more iterations there are then: below 0 where the device has failed, and some are lost and to be made again.
    int settle();
    // Begins anew, with another scene or the same after a change, and with other settings: devices keep what they need not
    // make again. Where one fails, as in `iterate`.
    void update(std::shared_ptr<const Scene> scene, const PassSettings& pass, uint32_t first, uint32_t end);

    float progress() const;  // of the iteration under way, 0 to 1
    uint32_t stored_vlps() const { return active_.load()->counters.stored_vlps; }
    EyeForm eye_form() const { return active_.load()->counters.eye_form; }
    uint64_t dropped() const;  // estimates that were not finite
    uint64_t eye_samples() const;  // of complete iterations
    const PassSettings& pass() const { return pass_; }
    const Scene& scene() const { return *scene_; }
    Film& film() { return film_; }
    const Film& film() const { return film_; }
    const Iterations& iterations() const { return iterations_; }
    uint64_t iteration_count() const { return total_; }  // in the film and still with devices
    void add_film_state(std::span<const ExactSum> sums, uint64_t iterations);
    MemoryByDevice memory() const;
    uint64_t uploaded_bytes() const;  // of scenes, to the devices, so far
    // What the user should hear about the devices: why one was left out.
    std::vector<std::string> notes() const;

private:
    bool collect_from_helper();
    int run_one();
    int finish_main();
    int give_back_lost();
    int go_on_without_main(const char* reason);
    uint64_t sum_of(std::atomic<uint64_t> BackendCounters::* counter) const;
    void note(const std::string& text);
    void update_total() { total_ = film_.iterations() + unsaved_.size(); }

    std::shared_ptr<const Scene> scene_;
    PassSettings pass_;
    Film film_;
    mutable std::mutex mutex_;  // of which devices there are, and of notes_, for those who ask while `iterate` runs
    std::unique_ptr<Backend> main_, instead_of_main_;  // the latter once the former has failed
    std::atomic<Backend*> active_;  // the one of these that renders
    std::unique_ptr<Helper> helper_;
    MakeBackend spare_;
    std::vector<std::string> notes_;
    Iterations iterations_;
    uint32_t end_;
    std::deque<uint32_t> unsaved_;  // iterations that are finished, but still with the main device
    std::atomic<uint64_t> total_{0};
    std::chrono::steady_clock::time_point collected_ = std::chrono::steady_clock::now();  // when it was last begun
    double took_ = 0;  // seconds of the last iteration, without the helper's
    std::atomic<bool> stop_{false};
    std::chrono::steady_clock::time_point deadline_ = std::chrono::steady_clock::time_point::max();
};

}  // namespace vlp
