// What settings are worth in a scene, found out by a few paths with random numbers of their own (host only).
#pragma once

#include <vector>

#include "core/parallel.h"
#include "integrator/pass.h"

namespace vlp {

// What an iteration of a render would be like whose samples go where there is noise. Variances are those of a pixel over
// (mean + 0.1)^2, on average. Costs are in steps of an eye walk: a ray, a light sample and their surface.
struct Prospect {
    double eye_variance = 0, splat_variance = 0;
    double eye_cost = 0, light_cost = 0;  // for each pixel

    // Variance times cost (the inverse of efficiency, Veach 1997, chapter 2) with R = `rounds`: what is to be least.
    double inverse_efficiency(double rounds) const {
        return (eye_variance + splat_variance / rounds) * (eye_cost + light_cost * rounds);
    }
    // The R for which it is, of `most` or fewer.
    uint32_t best_rounds(uint32_t most) const;
};

struct Trial {
    std::vector<Prospect> connected;  // with F = 1, 2, 4 and 8; 1 alone where there are no VLPs
    Prospect unconnected;  // without connections to VLPs
    Prospect unlit;  // without light paths: eye paths find all light by themselves
};

// `pass` as for_scene gives it, with R = F = 1 and the balance heuristic. The same on every machine, however many threads.
Trial try_out(const SceneView& scene, PassSettings pass, ThreadPool& pool);

}  // namespace vlp
