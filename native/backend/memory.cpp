// Adds up what back ends allocate.
#include "backend/memory.h"

#include "backend/backend.h"
#include "backend/wavefront_kernels.h"

namespace vlp {

MemoryByDevice plan_memory(const std::string& device, const Scene& scene, const PassSettings& pass) {
    MemoryByDevice memory;
    MemoryUse& host = memory["CPU"];
    host.scene = scene.bytes();
    host.film = film_bytes(scene.window(), pass) * (device == "HYBRID" ? 2 : 1);
    const bool gpu = device == "CUDA" || device == "HYBRID";
    if (gpu) add_gpu_memory(memory, scene, pass);
    if (gpu) memory["CUDA"].stacks = cuda_stack_bytes();
    if (!gpu || device == "HYBRID") add_cpu_memory(memory, scene.window(), pass);
    return memory;
}

void add_gpu_memory(MemoryByDevice& memory, const Scene& scene, const PassSettings& pass) {
    MemoryUse& gpu = memory["CUDA"];
    gpu.scene = scene.bytes(NodeForm::compressed, k_device_alignment);
    gpu.film += film_bytes(scene.window(), pass) + sample_plan_bytes(scene.window(), pass);
    if (pass.adaptive) {
        gpu.film += scene.window().pixel_count() * sizeof(float);
        memory["CPU"].film += scene.window().pixel_count() * (sizeof(float) + sizeof(int8_t));
    }
    gpu.work += sizeof(PassCounts);
    if (pass.traces_light()) {
        gpu.light_vertices += light_memory(pass);
        const size_t groups = SortRuns(pass.light_paths).table(k_vlp_groups);
        gpu.work += pass.light_paths * sizeof(uint8_t) + groups * sizeof(uint32_t) + scan_bytes(groups);
    }
    if (forced_eye_form() != EyeForm::paths) {
        const WavefrontSize size(pass, scene.window().pixel_count());
        gpu.work += size.bytes();
        memory["CPU"].work += size.bytes_on_host();
    }
    // The sums come to the host through memory that stays in its place.
    memory["CPU"].film += scene.window().pixel_count() * film_channels(pass) * sizeof(ExactSum);
    memory["CPU"].work += sizeof(PassCounts);
}

}  // namespace vlp
