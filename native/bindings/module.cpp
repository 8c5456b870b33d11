// The extension module of one instruction set.
#include "bindings/bindings.h"
#include "bindings/cpu_features.h"

NB_MODULE(VLP_MODULE_NAME, m) {
    m.attr("__version__") = VLP_VERSION;
    m.attr("isa") = VLP_ISA;
    m.def("cpu_supports_avx2", &vlp::cpu_supports_avx2);
    vlp::bind_scene(m);
    vlp::bind_renderer(m);
}
