// Placeholder until the core's bindings arrive: what the Python package needs to choose an instruction set.
#include "bindings/cpu_features.h"

#include <nanobind/nanobind.h>

namespace vlp {
int cuda_device_count(); // backend/cuda.cu or backend/cuda_absent.cpp
}

NB_MODULE(VLP_MODULE_NAME, m) {
    m.attr("__version__") = VLP_VERSION;
    m.attr("isa") = VLP_ISA;
    m.def("cpu_supports_avx2", &vlp::cpu_supports_avx2);
    m.def("cuda_device_count", &vlp::cuda_device_count);
}
