// What the tests of the GPU back end share: settings, a scene, the CPU's sums, and renders with the host as the GPU.
#pragma once

#include "host_device.h"
#include "renderer/pilot.h"
#include "renderer/renderer.h"
#include "same_sums.h"
#include "transport_scenes.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace vlp::test {

struct NamedPass {
    const char* name;
    PassSettings pass;

    friend void PrintTo(const NamedPass& p, std::ostream* out) { *out << p.name; }
};

inline PassSettings balanced(uint32_t light_paths = 500) {
    PassSettings pass;
    pass.light_path_length = 12, pass.eye_path_length = 16, pass.light_paths = light_paths;
    pass.splats = pass.roulette = true;
    return pass;
}

inline std::vector<NamedPass> passes() {
    PassSettings paper;
    paper.light_paths = 576, paper.weighting = Weighting::uniform;
    PassSettings splats_alone = balanced();
    splats_alone.vlp_connections = 0;
    PassSettings path_tracing = splats_alone;
    path_tracing.splats = false;
    PassSettings many = balanced();
    many.light_path_length = many.eye_path_length = k_max_walk;
    many.vlp_connections = 2, many.first_times = 3, many.vlp_candidates = 3, many.light_samples = 0;
    PassSettings rounds = balanced(300);
    rounds.light_rounds = 3;
    PassSettings guided = balanced(), guided_alone = path_tracing;
    guided.guides = guided_alone.guides = true;
    return {{"paper", paper},
            {"guided", guided},
            {"guided_path_tracing", guided_alone},
            {"balanced", balanced()},
            {"rounds", rounds},
            {"splats_alone", splats_alone},
            {"path_tracing", path_tracing},
            {"many", many}};
}

inline std::shared_ptr<Scene> room(uint32_t pixels = 24) { return crowded_room(every_light().back().add, pixels); }

// The sums of iterations [0, count) by the CPU.
inline std::vector<ExactSum> cpu_sums(const Scene& scene, const PassSettings& pass, uint32_t count) {
    const auto cpu = make_cpu_backend(scene, pass, 1);
    Film film(scene.window(), pass.splats, pass.guides);
    const std::atomic<bool> go_on{false};
    for (uint32_t i = 0; i < count; ++i) EXPECT_TRUE(cpu->run_iteration(i, film, go_on));
    return {film.sums().begin(), film.sums().end()};
}

// Pictures of a wavefront are the CPU back end's.
inline void expect_same_sums(std::span<const ExactSum> a, std::span<const ExactSum> b) {
    if (forced_eye_form() == EyeForm::paths) {
        expect_same_bits(a, b);
    } else {
        expect_same_by_other_code(a, b);
    }
}

// Limits what all devices together may take, while it lives.
struct MemoryLimit {
    explicit MemoryLimit(size_t bytes) { setenv("VLP_BPT_GPU_MEMORY", std::to_string(bytes).c_str(), 1); }
    ~MemoryLimit() { unsetenv("VLP_BPT_GPU_MEMORY"); }
    MemoryLimit(const MemoryLimit&) = delete;
    MemoryLimit& operator=(const MemoryLimit&) = delete;
};

// The form of eye passes, while it lives; "" where the back end chooses.
struct FormOfEyePasses {
    explicit FormOfEyePasses(const char* name) { setenv("VLP_BPT_GPU_EYE_PASS", name, 1); }
    ~FormOfEyePasses() { unsetenv("VLP_BPT_GPU_EYE_PASS"); }
    FormOfEyePasses(const FormOfEyePasses&) = delete;
    FormOfEyePasses& operator=(const FormOfEyePasses&) = delete;
};
inline constexpr const char* k_forms[] = {"paths", "wavefront", ""};

// With the GPU of this process being the host.
struct GpuRender {
    explicit GpuRender(std::shared_ptr<Scene> scene, const PassSettings& asked, const std::string& device = "CUDA")
        : pass(for_scene(scene->view(), asked)) {
        const MakeBackend make_gpu = [this](const Scene& of, const PassSettings& with) {
            return std::make_unique<HostBackend>(of, with, machine);
        };
        Devices devices = make_devices(device, *scene, pass, 1, make_gpu);
        renderer = std::make_unique<Renderer>(scene, pass, scene->window(), std::move(devices), 0, 1000);
    }

    HostMachine machine;
    PassSettings pass;
    std::unique_ptr<Renderer> renderer;
};

}  // namespace vlp::test
