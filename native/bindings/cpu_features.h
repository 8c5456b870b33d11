// Asks the processor which instruction sets it runs; the baseline module exports this so that Python can choose a variant.
#pragma once

namespace vlp {

// True if this processor runs everything that the avx2 variant is compiled for (VLP_ISA_FLAGS_avx2 in CMakeLists.txt).
inline bool cpu_supports_avx2() {
#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
           __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("lzcnt") && __builtin_cpu_supports("f16c");
#else
    return false;
#endif
}

}  // namespace vlp
