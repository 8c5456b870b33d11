// Affine maps of points, directions and normals: three rows of four.
#pragma once

#include "core/vec.h"

namespace vlp {

struct Affine {
    float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

    VLP_HD Vec3 column(int j) const { return {m[0][j], m[1][j], m[2][j]}; }
    VLP_HD Vec3 row(int i) const { return {m[i][0], m[i][1], m[i][2]}; }
};

VLP_HD inline Vec3 transform_vector(const Affine& a, Vec3 v) {
    return {dot(a.row(0), v), dot(a.row(1), v), dot(a.row(2), v)};
}
VLP_HD inline Vec3 transform_point(const Affine& a, Vec3 p) { return transform_vector(a, p) + a.column(3); }

// A normal goes by the inverse transpose; the result is not normalised and keeps its side under mirroring.
VLP_HD inline Vec3 transform_normal(const Affine& inverse, Vec3 n) {
    return inverse.row(0) * n.x + inverse.row(1) * n.y + inverse.row(2) * n.z;
}

VLP_HD inline float determinant(const Affine& a) { return dot(a.row(0), cross(a.row(1), a.row(2))); }

// Undefined when `a` is singular: callers check `determinant` first.
VLP_HD inline Affine inverse(const Affine& a) {
    const Vec3 c0 = cross(a.row(1), a.row(2)), c1 = cross(a.row(2), a.row(0)), c2 = cross(a.row(0), a.row(1));
    const float s = 1.0f / dot(a.row(0), c0);
    Affine r;
    for (int i = 0; i < 3; ++i) {
        const float x = (i == 0 ? c0.x : i == 1 ? c0.y : c0.z) * s;
        const float y = (i == 0 ? c1.x : i == 1 ? c1.y : c1.z) * s;
        const float z = (i == 0 ? c2.x : i == 1 ? c2.y : c2.z) * s;
        r.m[i][0] = x, r.m[i][1] = y, r.m[i][2] = z;
        r.m[i][3] = -(x * a.m[0][3] + y * a.m[1][3] + z * a.m[2][3]);
    }
    return r;
}

}  // namespace vlp
