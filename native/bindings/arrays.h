// Numpy arrays as spans of the core's types, without copies.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <cstring>
#include <optional>
#include <span>

#include "core/rgb.h"
#include "core/transform.h"

namespace vlp {

namespace nb = nanobind;

// Sizes, -1 for any.
template <typename T, nb::ssize_t... Sizes>
using Array = nb::ndarray<T, nb::shape<Sizes...>, nb::c_contig, nb::device::cpu>;
using FloatMatrix = Array<const float, 3, 4>;
using Triple = std::array<float, 3>;

// The elements of an array as values of T, which packs several of them; nothing for an array that was not given.
template <typename T, typename... Options>
std::span<const T> span_of(const nb::ndarray<Options...>& a) {
    using Element = typename nb::ndarray<Options...>::Scalar;
    static_assert(sizeof(T) % sizeof(Element) == 0);
    return {reinterpret_cast<const T*>(a.data()), a.size() * sizeof(Element) / sizeof(T)};
}
template <typename T, typename A>
std::span<const T> span_of(const std::optional<A>& a) {
    return a ? span_of<T>(*a) : std::span<const T>{};
}

inline Affine affine_of(const FloatMatrix& matrix) {
    Affine a;
    std::memcpy(a.m, matrix.data(), sizeof a.m);
    return a;
}
inline Rgb rgb_of(Triple t) { return {t[0], t[1], t[2]}; }
inline Vec3 vec3_of(Triple t) { return {t[0], t[1], t[2]}; }

}  // namespace vlp
