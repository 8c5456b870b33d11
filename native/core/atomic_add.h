// Adding to a number that others add to at the same time, on the host and on a device.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/device.h"

namespace vlp {

// Gives the number as it was.
struct AtomicAdd {
    VLP_HD uint64_t operator()(uint64_t& word, uint64_t x) const {
#if VLP_ON_DEVICE
        return atomicAdd(reinterpret_cast<unsigned long long*>(&word), static_cast<unsigned long long>(x));
#else
        return std::atomic_ref(word).fetch_add(x, std::memory_order_relaxed);
#endif
    }
};

}  // namespace vlp
