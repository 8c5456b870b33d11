// Searches of a tree in both of its forms, wide and compressed, which must find the same.
#pragma once

#include <gtest/gtest.h>

#include "bvh/compressed_traverse.h"
#include "tests/native/ray_scenes.h"

namespace vlp::test {

// Of the tree as it is now; the scene must outlive it.
struct BothForms {
    explicit BothForms(const RayScene& scene) : wide(scene.view()), compressed(wide) {
        ThreadPool pool(1);
        nodes = compress(scene.bvh.nodes, pool);
        compressed.bvh.nodes = nullptr, compressed.bvh.compressed = nodes.data();
    }
    BothForms(const BothForms&) = delete;
    BothForms& operator=(const BothForms&) = delete;

    SceneView wide, compressed;
    std::vector<CompressedNode> nodes;
};

// What the wide nodes find, which must be the same to the last bit. Where triangles share an edge or lie in each other,
// their distances are the same but for rounding, by which one may come before its own box: then the order decides.
inline Hit closest_hit(const BothForms& forms, const Ray& ray, PrimitiveId skip) {
    const Hit hit = closest_hit(forms.wide, ray, skip), other = closest_hit_compressed(forms.compressed, ray, skip);
    EXPECT_EQ(hit.found(), other.found());
    if (hit.instance == other.instance && hit.primitive == other.primitive) {
        EXPECT_EQ(bits_of(hit.t), bits_of(other.t));
        EXPECT_EQ(bits_of(hit.u), bits_of(other.u));
        EXPECT_EQ(bits_of(hit.v), bits_of(other.v));
    } else {
        EXPECT_NEAR(hit.t, other.t, 1e-5f * hit.t);
    }
    return hit;
}

inline bool any_hit(const BothForms& forms, const Ray& ray, PrimitiveId skip_a, PrimitiveId skip_b) {
    const bool hit = any_hit(forms.wide, ray, skip_a, skip_b);
    EXPECT_EQ(hit, any_hit_compressed(forms.compressed, ray, skip_a, skip_b));
    return hit;
}

}  // namespace vlp::test
