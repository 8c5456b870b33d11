// Whether two pictures are the same: to the bit, or as far as a compiler lets them.
#pragma once

#include "film/exact_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace vlp::test {

struct Differences {
    size_t any = 0, far = 0;
};

inline Differences differences(std::span<const ExactSum> a, std::span<const ExactSum> b) {
    Differences d;
    EXPECT_EQ(a.size(), b.size());
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
        d.any += a[i].fraction != b[i].fraction || a[i].whole != b[i].whole;
        d.far += std::abs(a[i].value() - b[i].value()) > 1e-4 * std::abs(b[i].value()) + 1e-9;
    }
    return d;
}

inline void expect_same_bits(std::span<const ExactSum> a, std::span<const ExactSum> b) {
    EXPECT_EQ(differences(a, b).any, 0u) << "of " << a.size();
}

// Of the same functions, but compiled into others: where products are fused with sums, that is done in other places, and now
// and then a path turns off. Builds that do not fuse make the same bits.
inline void expect_same_by_other_code(std::span<const ExactSum> a, std::span<const ExactSum> b) {
#ifdef __FP_FAST_FMAF
    EXPECT_LE(differences(a, b).far, a.size() / 100) << "of " << a.size();
#else
    expect_same_bits(a, b);
#endif
}

}  // namespace vlp::test
