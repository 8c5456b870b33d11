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

namespace {

std::unique_ptr<Backend> make_backend(const std::string& device, const Scene& scene, const PassSettings& pass,
                                      unsigned threads) {
    if (device == "CUDA") return make_cuda_backend(scene, pass);
    if (device == "AUTO" || device == "CPU") return make_cpu_backend(scene, pass, threads);
    throw std::runtime_error("device " + device + " is not available in this version: choose AUTO, CPU or CUDA");
}

}  // namespace

Renderer::Renderer(std::shared_ptr<const Scene> scene, PassSettings pass, const std::string& device, unsigned threads,
                   uint32_t first_iteration)
    : scene_(std::move(scene)),
      pass_(for_scene(scene_->view(), pass)),
      film_(scene_->window(), pass_.splats),
      backend_(make_backend(device, *scene_, pass_, threads)),
      next_iteration_(first_iteration) {}

uint32_t Renderer::iterate(uint32_t count) {
    stop_ = false;
    uint32_t done = 0;
    while (done < count && !stop_ && std::chrono::steady_clock::now() < deadline_) {
        if (!backend_->run_iteration(next_iteration_, film_, stop_)) break;
        ++next_iteration_;
        ++done;
    }
    return done;
}

void Renderer::set_deadline(double seconds) {
    using Clock = std::chrono::steady_clock;
    deadline_ = seconds > 0
                    ? Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))
                    : Clock::time_point::max();
}

float Renderer::progress() const {
    const BackendCounters& c = backend_->counters;
    return static_cast<float>(c.work_done) / static_cast<float>(c.work_total);
}

}  // namespace vlp
