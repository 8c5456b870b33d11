// Tails of the distributions that tests of this folder hold their figures against.
#pragma once

#include <cmath>

namespace vlp::test {

// The p below which one of `tests` independent tests fails, for a chance of `false_alarm` that any does (Sidak).
inline double sidak(double false_alarm, size_t tests) {
    return -std::expm1(std::log1p(-false_alarm) / static_cast<double>(tests));
}

// Of |z| or more standard deviations.
inline double normal_tails(double z) { return std::erfc(std::fabs(z) / std::sqrt(2.0)); }

// Of a chi-squared variable of many degrees of freedom (Wilson & Hilferty 1931: its cube root is nearly normal); for 255
// degrees its relative error is below 2 % down to a tail of 1e-5.
inline double chi_squared_upper_tail(double statistic, double freedom) {
    const double v = 2 / (9 * freedom);
    return 0.5 * std::erfc((std::cbrt(statistic / freedom) - (1 - v)) / std::sqrt(2 * v));
}

}  // namespace vlp::test
