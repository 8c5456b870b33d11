// Sums that neither the order of what is added nor the number of those who add changes by a bit.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/device.h"

namespace vlp {

// A sum of floats in 128-bit fixed point with 64 bits after the point: exact for values of 2^-40 and more (smaller ones
// lose what is below 2^-64), whatever the order, up to 2^63 in all, where it stays.
struct ExactSum {
    uint64_t fraction = 0;  // in units of 2^-64
    int64_t whole = 0;

    // Neither may be negative.
    VLP_HD void add(const ExactSum& other) {
        constexpr int64_t k_most = INT64_MAX;
        fraction += other.fraction;
        const int64_t carry = fraction < other.fraction ? 1 : 0;
        if (whole > k_most - other.whole - carry) {
            *this = {~uint64_t{0}, k_most};
        } else {
            whole += other.whole + carry;
        }
    }
    VLP_HD void add(float value);
    double value() const { return static_cast<double>(whole) + static_cast<double>(fraction) * 0x1p-64; }
};

// `value` must be finite and not negative; what is above `most`, 2^62 or less, counts as `most`.
VLP_HD inline ExactSum exact(float value, float most = 0x1p62f) {
    if (!(value < most)) value = most;
    const double whole = std::floor(static_cast<double>(value));
    return {static_cast<uint64_t>((static_cast<double>(value) - whole) * 0x1p64), static_cast<int64_t>(whole)};
}

VLP_HD inline void ExactSum::add(float value) { add(exact(value)); }

// Adds to a sum that others add to at the same time. `fetch_add(uint64_t& word, uint64_t x)` is atomic and gives the word as
// it was: whoever makes the fraction wrap sees it, and no one else, so every carry is counted once, whatever the order.
// All that is added together must stay below 2^63.
template <typename FetchAdd>
VLP_HD inline void add_shared(ExactSum& sum, const ExactSum& value, const FetchAdd& fetch_add) {
    const uint64_t before = fetch_add(sum.fraction, value.fraction);
    const uint64_t carry = before + value.fraction < before ? 1 : 0;
    const uint64_t whole = static_cast<uint64_t>(value.whole) + carry;
    if (whole > 0) fetch_add(reinterpret_cast<uint64_t&>(sum.whole), whole);
}

}  // namespace vlp
