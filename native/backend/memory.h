// What a render takes on its devices, by what it is for: told before, and allocated by the same figures.
#pragma once

#include <map>
#include <string>

#include "film/film.h"
#include "film/sample_rates.h"
#include "integrator/pass.h"
#include "scene/scene.h"

namespace vlp {

// Bytes.
struct MemoryUse {
    ByPart<size_t> scene;
    size_t light_vertices = 0;  // with the list of those that can be connected
    size_t film = 0;
    size_t work = 0;    // counts, tiles, what a scan needs
    size_t stacks = 0;  // of the threads of the passes, which a GPU reserves when it starts the first

    size_t total() const {
        size_t sum = light_vertices + film + work + stacks;
        for (const size_t bytes : scene.of) sum += bytes;
        return sum;
    }
};

using MemoryByDevice = std::map<std::string, MemoryUse>;  // "CPU": the machine's own memory; "CUDA"

// What a Renderer with this setting `device` will take; `pass` as for_scene gives it. The stacks are left out where there is
// no GPU to ask.
MemoryByDevice plan_memory(const std::string& device, const Scene& scene, const PassSettings& pass);

// Parts of it: each adds what a back end allocates.
void add_cpu_memory(MemoryByDevice& memory, Window window, const PassSettings& pass);
void add_gpu_memory(MemoryByDevice& memory, const Scene& scene, const PassSettings& pass);

// The room for light vertices: N paths of L.
inline size_t light_vertex_capacity(const PassSettings& pass) {
    return static_cast<size_t>(pass.light_paths) * pass.light_path_length;
}
// And for what connections choose from: V is no more than that, and M - 1 blanks.
inline size_t candidate_capacity(const PassSettings& pass) {
    return light_vertex_capacity(pass) + pass.vlp_candidates - 1;
}
inline size_t light_memory(const PassSettings& pass) {
    return light_vertex_capacity(pass) * sizeof(LightVertex) + candidate_capacity(pass) * sizeof(VlpCandidate);
}
inline size_t film_channels(const PassSettings& pass) { return pass.guides ? Film::k_guided_channels : 4; }
inline size_t film_bytes(Window window, const PassSettings& pass) {
    const size_t samples = sizeof(PixelSample) + (pass.guides ? sizeof(GuideSample) : 0);
    const size_t splats = pass.splats ? (pass.guides ? 6 : 3) : 0;
    return window.pixel_count() * (samples + (splats + film_channels(pass)) * sizeof(ExactSum));
}

// What adaptive sampling keeps: moments and levels of the pixels.
inline size_t sample_plan_bytes(Window window, const PassSettings& pass) {
    return pass.adaptive ? window.pixel_count() * (sizeof(PixelMoments) + sizeof(int8_t)) : 0;
}

// Arrays of a scene begin at cache lines of a device.
inline constexpr size_t k_device_alignment = 64;

// What a scan over so many counts may take, which depends on the GPU: far more than the states of its blocks, each of which
// has hundreds of counts.
inline size_t scan_bytes(size_t counts) { return counts > 0 ? 16384 + counts / 8 : 0; }

}  // namespace vlp
