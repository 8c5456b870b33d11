// Tails of the distributions that tests of this folder hold their figures against.
#pragma once

#include <cmath>
#include <cstddef>

namespace vlp::test {

// The p below which one of `tests` independent tests fails, for a chance of `false_alarm` that any does (Sidak).
inline double sidak(double false_alarm, size_t tests) {
    return -std::expm1(std::log1p(-false_alarm) / static_cast<double>(tests));
}

// Of |z| or more standard deviations.
inline double normal_tails(double z) { return std::erfc(std::fabs(z) / std::sqrt(2.0)); }

// Probability that a chi-squared variable of `freedom` degrees exceeds `statistic`: the regularised upper incomplete
// gamma function, by its series or its continued fraction (Lentz), whichever converges.
inline double chi_squared_tail(double statistic, double freedom) {
    const double a = freedom / 2, x = statistic / 2;
    if (x <= 0) return 1;
    const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (double n = a + 1; term > sum * 1e-16; n += 1) sum += term *= x / n;
        return 1 - scale * sum;
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int i = 1; i < 100000; ++i) {
        const double an = -i * (i - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        const double change = c * d;
        h *= change;
        if (std::fabs(change - 1) < 1e-15) break;
    }
    return scale * h;
}

}  // namespace vlp::test
