// What guides a denoiser: the colour and the normal of what an eye path sees first.
//
// A mirror or a pane of glass has no colour of its own that would tell it from its neighbours: what tells apart is what is
// seen in it. So a walk is followed through sharp lobes, as long as it takes them, to the first one that blurs, and its
// albedo is tinted by what the sharp ones did to the throughput: for glass, reflection and refraction blend by their
// Fresnel shares. A surface that has both blurs with its blurring lobes and goes on with the sharp ones. The normal is that
// of the last surface so reached, none where that is sharp alone and the walk leaves it for the background.
// Lamps, shining surfaces and the background count with their radiance, no channel above 1.
#pragma once

#include "film/guide.h"
#include "integrator/path_tracing.h"

namespace vlp {

// GGX lobes up to this width count as sharp where a surface has no other lobes (a roughness of 0.15).
inline constexpr float k_sharp_alpha = 0.0225f;

// The share of the light that a lobe scatters towards an eye at this cosine.
VLP_HD inline Rgb lobe_albedo(const Bsdf& bsdf, const Lobe& lobe, float cos_eye) {
    const float cos = std::fabs(cos_eye);
    Rgb albedo = lobe.weight;
    if (lobe.kind == LobeKind::reflection) {
        albedo *= layer_albedo(lobe, bsdf.tables, cos);
    } else if (lobe.kind == LobeKind::dielectric || lobe.kind == LobeKind::refraction) {
        const Split split = split_light(lobe, cos, cos_eye < 0 ? 1.0f / lobe.eta : lobe.eta);
        albedo *= split.reflect + split.refract;
    }
    return albedo * passed_by_layers(bsdf, lobe, cos);
}

// Whether it scatters by sharp lobes alone.
VLP_HD inline bool is_sharp(const Bsdf& bsdf) {
    for (uint32_t i = 0; i < bsdf.count; ++i) {
        const Lobe& lobe = bsdf.lobes[i];
        if (lobe.kind == LobeKind::diffuse || lobe.kind == LobeKind::translucent || lobe.alpha > k_sharp_alpha)
            return false;
    }
    return bsdf.count > 0;
}

// Of a single path the albedo may exceed 1, as throughputs do: means over many are what counts.
struct GuidedFinds {
    PathFinds path;
    Rgb albedo{};
    Vec3 normal{};
    bool open = true;  // nothing blurred so far
    bool sharp = false;  // the walk's last surface has sharp lobes alone

    VLP_HD GuideSample guide() const {
        const bool finite = is_finite(albedo) && is_finite(normal);
        return finite ? GuideSample{{albedo.r, albedo.g, albedo.b}, {normal.x, normal.y, normal.z}} : GuideSample{};
    }
};

// Sums up a pixel's path as PixelSink does, and its guides.
struct GuidedSink {
    using Finds = GuidedFinds;

    const PassSettings& pass;
    const SceneView& scene;
    Finds finds{};
    const EyeWalk* eye = nullptr;  // once it has left the lens

    VLP_HD GuidedSink(const PassSettings& settings, const SceneView& view) : pass(settings), scene(view) {}
    VLP_HD void resume(const Finds& before, const EyeWalk& walk) {
        finds = before;
        eye = walk.t > 1 ? &walk : nullptr;
    }

    VLP_HD void add(const Contribution& c) {
        finds.path.add(pass, c);
        if (c.s != 0 || (eye != nullptr && !sees(eye->t + 1))) return;
        const Rgb most = eye != nullptr ? eye->throughput : rgb(1);
        finds.albedo += {min_of(c.value.r, most.r), min_of(c.value.g, most.g), min_of(c.value.b, most.b)};
    }
    VLP_HD void visit(const EyeWalk& walk) {
        eye = &walk;
        finds.open = sees(walk.t);
        if (!finds.open) return;
        const Bsdf bsdf = make_bsdf(scene, walk.surface);
        finds.sharp = is_sharp(bsdf);
        finds.normal = finds.sharp ? Vec3{} : face_toward(bsdf.normal, walk.w_eye);
        if (finds.sharp) return;
        const float cos_eye = dot(walk.w_eye, bsdf.normal);
        for (uint32_t i = 0; i < bsdf.count; ++i) {
            const Lobe& lobe = bsdf.lobes[i];
            if (!is_specular(lobe)) finds.albedo += walk.throughput * lobe_albedo(bsdf, lobe, cos_eye);
        }
    }

private:
    // Whether vertex z_{t-1} is reached without blur.
    VLP_HD bool sees(uint32_t t) const {
        return finds.open && (t == 2 || eye->vertices[t - 2].specular || finds.sharp);
    }
};

}  // namespace vlp
