// Iterations, the pilot that fixes kappa, deadlines and cancellation.
#include "renderer/renderer.h"

#include <stdexcept>

#include "integrator/light_tracing.h"
#include "scene/scene.h"

namespace vlp {

float pilot_vlps_per_path(const SceneView& scene, const PassSettings& pass) {
    constexpr uint32_t k_pilot_paths = 4096;
    std::vector<LightVertex> slots(pass.light_path_length);
    uint32_t stored = 0;
    for (uint32_t path = 0; path < k_pilot_paths; ++path) {
        NoSplats none;
        stored += trace_light_path(scene, pass, k_pilot_stream, 0, path, slots.data(), none).connectible;
    }
    return static_cast<float>(stored) / static_cast<float>(k_pilot_paths);
}

PassSettings for_scene(const SceneView& scene, PassSettings pass) {
    const bool light_walks = pass.light_path_length > 0 && pass.light_paths > 0 && scene.light_count > 0;
    pass.splats &= light_walks;
    pass.kappa = 0;
    if (pass.vlp_connections > 0 && light_walks) {
        const float vlps_per_path = pilot_vlps_per_path(scene, pass);
        if (vlps_per_path > 0)
            pass.kappa = static_cast<float>(pass.vlp_connections * pass.vlp_candidates) / vlps_per_path;
    }
    return pass;
}

Devices make_devices(const std::string& device, const Scene& scene, const PassSettings& pass, unsigned threads) {
    Devices devices;
    if (device != "AUTO" && device != "CPU" && device != "CUDA" && device != "HYBRID") {
        throw std::runtime_error("device " + device + ": must be AUTO, CPU, CUDA or HYBRID");
    }
    if (device == "CUDA" || device == "HYBRID") {
        try {
            devices.main = make_cuda_backend(scene, pass);
        } catch (const std::runtime_error& error) {
            devices.notes.push_back(std::string(error.what()) + "; rendering on the CPU");
        }
    }
    const auto cpu = [&scene, pass, threads] { return make_cpu_backend(scene, pass, threads); };
    if (!devices.main) {
        devices.main = cpu();
    } else if (device == "HYBRID") {
        devices.helper = cpu();
    } else {
        devices.spare = cpu;
    }
    return devices;
}

Renderer::Renderer(std::shared_ptr<const Scene> scene, const PassSettings& pass, Window window, Devices devices,
                   uint32_t first, uint32_t end)
    : scene_(std::move(scene)),
      pass_(pass),
      film_(window, pass.splats, pass.guides),
      main_(std::move(devices.main)),
      active_(main_.get()),
      helper_(devices.helper ? std::make_unique<Helper>(std::move(devices.helper), film_) : nullptr),
      spare_(std::move(devices.spare)),
      notes_(std::move(devices.notes)),
      iterations_(first),
      end_(end) {}

uint32_t Renderer::iterate(uint32_t count) {
    stop_ = false;
    uint32_t done = 0;
    while (done < count && !stop_ && std::chrono::steady_clock::now() < deadline_) {
        if (collect_from_helper() || run_one()) ++done;
    }
    return stop_ ? done + rest() : done;
}

bool Renderer::collect_from_helper() {
    if (!helper_) return false;
    const std::optional<uint32_t> finished = helper_->collect(film_);
    if (finished) iterations_.finish(*finished);
    return finished.has_value();
}

// An iteration by the main device, while the helper, if any, is kept at work. Whether one was completed.
bool Renderer::run_one() {
    if (helper_ && helper_->idle()) {
        if (const auto next = iterations_.take(end_)) helper_->start(*next);
    }
    std::optional<uint32_t> own = iterations_.take(helper_ ? end_ : k_none);
    if (!own && helper_ && !helper_->idle()) {
        // The last one is the helper's: whoever is sooner done with it.
        if (helper_->seconds_left() <= took_) {
            helper_->wait(stop_);
            return false;
        }
        if (rest() > 0) return true;
        own = iterations_.take(end_);
    }
    if (!own) own = iterations_.take(k_none);
    if (!own) return false;

    const auto start = std::chrono::steady_clock::now();
    bool done = false;
    try {
        done = active_.load()->run_iteration(*own, film_, stop_);
    } catch (const std::runtime_error& error) {
        iterations_.give_back(*own);
        if (!helper_ && !spare_) throw;
        done = rest() > 0;
        go_on_without_main(error.what());
        return done;
    }
    if (done) {
        iterations_.finish(*own);
        took_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    } else {
        iterations_.give_back(*own);
    }
    return done;
}

// Nothing is lost: the film holds complete iterations.
void Renderer::go_on_without_main(const char* reason) {
    std::unique_ptr<Backend> cpu = helper_ ? nullptr : spare_();
    const std::lock_guard lock(mutex_);
    if (helper_) cpu = helper_->release();
    instead_of_main_ = std::move(cpu);
    active_ = instead_of_main_.get();
    helper_.reset();
    spare_ = nullptr;
    notes_.push_back(std::string(reason) + "; going on with the CPU");
}

uint32_t Renderer::rest() {
    if (!helper_) return 0;
    helper_->halt();
    const uint32_t collected = collect_from_helper() ? 1 : 0;
    if (const auto undone = helper_->abandon()) iterations_.give_back(*undone);
    return collected;
}

void Renderer::set_deadline(double seconds) {
    using Clock = std::chrono::steady_clock;
    deadline_ = seconds > 0
                    ? Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))
                    : Clock::time_point::max();
}

std::vector<std::string> Renderer::notes() const {
    const std::lock_guard lock(mutex_);
    return notes_;
}

uint64_t Renderer::dropped() const {
    const std::lock_guard lock(mutex_);
    uint64_t sum = main_->counters.dropped;
    if (instead_of_main_) sum += instead_of_main_->counters.dropped;
    return helper_ ? sum + helper_->backend().counters.dropped : sum;
}

size_t Renderer::backend_bytes() const {
    const std::lock_guard lock(mutex_);
    return active_.load()->bytes() + (helper_ ? helper_->backend().bytes() : 0);
}

float Renderer::progress() const {
    const BackendCounters& c = active_.load()->counters;
    return static_cast<float>(c.work_done) / static_cast<float>(c.work_total);
}

}  // namespace vlp
