// The one place that asks which compiler reads the code: host or device.
#pragma once

#if defined(__CUDACC__)
#define VLP_HD __host__ __device__
#else
#define VLP_HD
#endif

#if defined(__CUDA_ARCH__)
#define VLP_ON_DEVICE 1
#else
#define VLP_ON_DEVICE 0
#endif

#if defined(_MSC_VER)
#define VLP_FORCE_INLINE __forceinline
#else
#define VLP_FORCE_INLINE inline __attribute__((always_inline))
#endif
