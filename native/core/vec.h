// Small vectors of floats: points, directions and texture coordinates.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/device.h"

namespace vlp {

inline constexpr float k_pi = 3.14159265358979323846f;
inline constexpr float k_inv_pi = 0.31830988618379067154f;
inline constexpr float k_two_pi = 6.28318530717958647692f;
inline constexpr float k_infinity = __builtin_huge_valf();
inline constexpr uint32_t k_none = 0xffffffffu;

template <typename T>
VLP_HD constexpr T min_of(T a, T b) {
    return b < a ? b : a;
}
template <typename T>
VLP_HD constexpr T max_of(T a, T b) {
    return a < b ? b : a;
}
template <typename T>
VLP_HD constexpr T clamp(T x, T low, T high) {
    return x < low ? low : (high < x ? high : x);
}
VLP_HD constexpr float square(float x) { return x * x; }
VLP_HD constexpr float lerp(float a, float b, float t) { return a + t * (b - a); }
VLP_HD inline float safe_sqrt(float x) { return std::sqrt(max_of(x, 0.0f)); }
VLP_HD inline bool is_finite(float x) { return std::fabs(x) < k_infinity; }

struct Vec2 {
    float x = 0, y = 0;
};

VLP_HD constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
VLP_HD constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
VLP_HD constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }
VLP_HD constexpr Vec2 operator*(float s, Vec2 a) { return a * s; }

struct Vec3 {
    float x = 0, y = 0, z = 0;
};

VLP_HD constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
VLP_HD constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
VLP_HD constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
VLP_HD constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
VLP_HD constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
VLP_HD constexpr Vec3 operator*(float s, Vec3 a) { return a * s; }
VLP_HD constexpr Vec3 operator/(Vec3 a, float s) { return a * (1.0f / s); }
VLP_HD constexpr Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
VLP_HD constexpr bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

VLP_HD constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
VLP_HD constexpr Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
VLP_HD constexpr float length_squared(Vec3 a) { return dot(a, a); }
VLP_HD inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }
VLP_HD VLP_FORCE_INLINE Vec3 normalize(Vec3 a) { return a * (1.0f / length(a)); }
VLP_HD constexpr float abs_dot(Vec3 a, Vec3 b) {
    const float d = dot(a, b);
    return d < 0 ? -d : d;
}
VLP_HD constexpr float max_component(Vec3 a) { return max_of(a.x, max_of(a.y, a.z)); }
VLP_HD constexpr Vec3 min_of(Vec3 a, Vec3 b) { return {min_of(a.x, b.x), min_of(a.y, b.y), min_of(a.z, b.z)}; }
VLP_HD constexpr Vec3 max_of(Vec3 a, Vec3 b) { return {max_of(a.x, b.x), max_of(a.y, b.y), max_of(a.z, b.z)}; }
VLP_HD inline bool is_finite(Vec3 a) { return is_finite(a.x) && is_finite(a.y) && is_finite(a.z); }

// The same normal, on the side that `direction` points to.
VLP_HD constexpr Vec3 face_toward(Vec3 normal, Vec3 direction) { return dot(normal, direction) < 0 ? -normal : normal; }

}  // namespace vlp
