// Stands in for the CUDA back end in builds without it.
#include <stdexcept>

#include "backend/backend.h"

namespace vlp {

std::unique_ptr<Backend> make_cuda_backend(const Scene&, const PassSettings&) {
    throw std::runtime_error("device CUDA: this build of VLP-BPT has no CUDA back end");
}

std::vector<DeviceInfo> cuda_devices() { return {}; }
size_t cuda_stack_bytes() { return 0; }

}  // namespace vlp
