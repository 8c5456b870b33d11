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

// A function that device code calls where the host's may have copies of it in place: its stack is taken while it runs, and
// the instruction caches hold one of it.
#if VLP_ON_DEVICE
#define VLP_CALLED_ON_DEVICE __noinline__
#else
#define VLP_CALLED_ON_DEVICE
#endif

// Before a loop: a device keeps one copy of its body, where many would fill the instruction caches.
#if VLP_ON_DEVICE
#define VLP_NO_UNROLL _Pragma("unroll 1")
#else
#define VLP_NO_UNROLL
#endif
