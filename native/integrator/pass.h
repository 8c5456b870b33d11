// What the two passes of an iteration are given: lengths, counts and the stream of random numbers.
#pragma once

#include "core/sampler.h"
#include "film/filter.h"
#include "integrator/path_vertex.h"
#include "scene/scene_view.h"

namespace vlp {

// How the strategies that can make a path share it (Veach 1997, 9.2).
enum class Weighting : uint8_t { uniform, balance, power };

// Longest walk of either side, in surface hits.
inline constexpr uint32_t k_max_walk = 64;

// Cells that virtual light points lie in, see vlp_groups.h. The default has one.
struct VlpGrid {
    Vec3 low{}, cells_per_metre{};
};

struct PassSettings {
    uint32_t light_path_length = 1;  // L: most surface hits of a light path, at most k_max_walk
    uint32_t eye_path_length = 5;    // K: most surface hits of an eye path, at most k_max_walk
    uint32_t light_paths = 0;        // N: leave VLPs
    uint32_t light_rounds = 1;       // R: so many times N light paths splat, and the first N of them leave VLPs
    uint32_t vlp_connections = 1;    // C
    uint32_t first_times = 1;        // F: C F connections at the surface that the camera sees, C at others
    uint32_t vlp_candidates = 1;     // M: VLPs that each connection chooses from
    uint32_t light_samples = 1;      // S
    bool splats = false;             // joins light paths to the lens; wants L and N above 0
    bool hits = true;                // counts lights that the eye walk itself meets
    Weighting weighting = Weighting::balance;
    bool roulette = false;           // ends walks at random by their throughput instead of at a fixed length
    float clamp_direct = 0,
          clamp_indirect = 0;  // most that one find adds to a pixel (mean of its channels), 0: no limit
    bool transparent_film = false;   // the camera sees no background
    bool guides = false;             // gathers those of a denoiser, see guides.h
    bool adaptive = false;           // samples go where there is noise, see film/sample_rates.h
    uint32_t seed = 0;
    float kappa = 0;  // M N / V, V being what a pilot pass of the scene stored: how often a connection draws a VLP
    VlpGrid vlp_grid;  // where those of the pilot lay
    LightGuide light_guide;  // where light paths are best begun
    Filter filter = Filter::blackman_harris;
    float filter_width = 1.5f;  // full width (pixels)

    // The limit on what a path of n vertices adds: direct light has met one surface at most.
    VLP_HD float clamp_of(uint32_t n) const { return n <= 3 ? clamp_direct : clamp_indirect; }

    // At z_{t-1}.
    VLP_HD uint32_t connections_at(uint32_t t) const {
        return t == 2 ? vlp_connections * first_times : vlp_connections;
    }
    VLP_HD uint32_t splat_paths() const { return light_rounds * light_paths; }
    // Whether an iteration has a light pass.
    VLP_HD bool traces_light() const { return kappa > 0 || splats; }
};

// The scene as the passes see it: with what was learnt of its lights.
inline SceneView guided(SceneView scene, const PassSettings& pass) {
    scene.light_guide = pass.light_guide;
    return scene;
}

// What one find adds to a pixel, made as dim as the settings ask: a bias against bright specks.
VLP_HD inline Rgb clamped(const PassSettings& pass, uint32_t n, Rgb light) {
    const float most = pass.clamp_of(n), size = average(light);
    return most > 0 && size > most ? light * (most / size) : light;
}

// A VLP as one of those that a connection chooses from, see vlp_candidates.h.
struct alignas(32) VlpCandidate {
    Vec3 position;
    OctNormal normal;  // towards the side that its light comes from
    uint32_t red_and_green, blue_and_behind;  // what it reflects, and what share of that counts on the other side
    float others;
    uint32_t slot;
};
static_assert(sizeof(VlpCandidate) == 32, "a cache line holds two, a vector register one");

// The V virtual light points of an iteration that can be connected, in hands of M: a connection is dealt one hand, which lies
// together in memory. Each has one VLP from every M-th of the order of vlp_groups.h: hand h has numbers h, H + h, 2 H + h ...
// Where M does not divide V, blanks that promise nothing stand for what the last ones lack.
struct Hands {
    uint32_t size, count;  // M, H

    VLP_HD Hands(uint32_t m, uint32_t v) : size(m), count((v + m - 1) / m) {}
    VLP_HD uint32_t place(uint32_t number) const { return number % count * size + number / count; }
    VLP_HD uint32_t places() const { return size * count; }
};

// The virtual light points of one iteration. A path's hits follow one another in the slots.
struct LightVertexCache {
    const LightVertex* slots = nullptr;
    const VlpCandidate* stored = nullptr;
    uint32_t hand_count = 0;  // in `stored`
};

// The streams that a seed and an iteration hold apart; the dimension that each walk step starts from.
enum Stream : uint32_t {
    k_light_stream = 1,
    k_eye_stream = 2,
    k_pilot_stream = 3,
    k_transparency_stream = 4,
    k_lens_stream = 5,
};

}  // namespace vlp
