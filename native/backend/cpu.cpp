// Placeholder until the CPU back end arrives.
namespace vlp {
const char* cpu_backend_isa();
const char* cpu_backend_isa() { return VLP_ISA; }
} // namespace vlp
