// The pilot: light paths alone for kappa and the grid, both kinds of paths to try settings out.
#include "renderer/pilot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "integrator/light_tracing.h"
#include "renderer/light_guide.h"
#include "renderer/trial.h"

namespace vlp {

namespace {

// Sums over the VLPs of some light paths.
struct PilotSums {
    double stored = 0, position[3]{}, squares[3]{};
};

PilotSums trace_some(const SceneView& scene, const PassSettings& pass, uint32_t begin, uint32_t end) {
    PilotSums sums;
    std::vector<LightVertex> slots(pass.light_path_length);
    for (uint32_t path = begin; path < end; ++path) {
        NoSplats none;
        const uint32_t vertices = trace_light_path(scene, pass, k_pilot_stream, 0, path, slots.data(), none);
        for (const LightVertex& vlp : std::span(slots).first(vertices)) {
            if (!vlp.connectible()) continue;
            ++sums.stored;
            for (int axis = 0; axis < 3; ++axis) {
                const double x = (&vlp.position.x)[axis];
                sums.position[axis] += x, sums.squares[axis] += x * x;
            }
        }
    }
    return sums;
}

}  // namespace

Pilot trace_pilot(const SceneView& scene, const PassSettings& pass, ThreadPool& pool) {
    constexpr uint32_t k_pilot_paths = 4096, k_pieces = 16, k_paths_each = k_pilot_paths / k_pieces;
    PilotSums pieces[k_pieces];
    pool.run(k_pieces,
             [&](uint32_t i) { pieces[i] = trace_some(scene, pass, i * k_paths_each, (i + 1) * k_paths_each); });
    double stored = 0, sum[3]{}, squares[3]{};
    for (const PilotSums& piece : pieces) {
        stored += piece.stored;
        for (int axis = 0; axis < 3; ++axis) sum[axis] += piece.position[axis], squares[axis] += piece.squares[axis];
    }
    Pilot pilot{static_cast<float>(stored / k_pilot_paths), {}};
    if (stored == 0) return pilot;
    double half[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double mean = sum[axis] / stored;
        half[axis] = std::sqrt(3 * std::max(squares[axis] / stored - mean * mean, 0.0));
        (&pilot.grid.low.x)[axis] = static_cast<float>(mean - half[axis]);
    }
    // Across a plane rounding alone would choose the cell.
    const double least = std::max(1e-4 * *std::max_element(half, half + 3), 1e-30);
    for (int axis = 0; axis < 3; ++axis) {
        if (half[axis] > least) (&pilot.grid.cells_per_metre.x)[axis] = static_cast<float>(2 / half[axis]);
    }
    return pilot;
}

namespace {

// Whether eye paths and splats can find all light that connections find: from lamps of no size none of what is seen in mirrors
// can be met by chance.
bool finds_all_unconnected(const SceneView& scene, const PassSettings& pass) {
    if (!pass.roulette || !pass.hits || pass.light_samples == 0) return false;
    if (pass.eye_path_length + pass.light_path_length + 1 > k_max_walk) return false;
    return std::none_of(scene.lights, scene.lights + scene.light_count, [](const Light& l) { return is_delta(l); });
}

// Whether some surface throws light together, as a mirror or a lens does. Light paths alone find that well, and a trial may
// miss where.
bool may_focus(const SceneView& scene) {
    const auto is_sharp = [](const Lobe& lobe) {
        return lobe.kind != LobeKind::diffuse && lobe.kind != LobeKind::translucent && lobe.alpha < 0.1f;
    };
    for (uint32_t i = 0; i < scene.instance_count; ++i) {
        const InstanceView& instance = scene.instances[i];
        for (uint32_t slot = 0; slot < instance.slot_count; ++slot) {
            const Material& material = scene.materials[scene.material_of_slot[instance.first_material + slot]];
            const Lobe* const lobes = scene.lobes + material.first_lobe;
            if (std::any_of(lobes, lobes + material.lobe_count, is_sharp)) return true;
        }
    }
    return false;
}

// As a trial finds it best: how many light paths splat, how many connections the surface that the camera sees has, and none at
// all where they bring less than they take; no light paths either where neither pays.
PassSettings as_it_pays(const SceneView& scene, PassSettings pass, ThreadPool& pool) {
    // What connections have to win: part of what the trial counts against a render without them would fall to splats.
    constexpr double k_least_gain = 1.05;
    constexpr uint32_t k_most_rounds = 8, k_most_paths = 1u << 31;
    pass.light_rounds = pass.first_times = 1;
    const Trial trial = try_out(scene, pass, pool);
    const uint32_t most = pass.splats ? std::min(k_most_rounds, k_most_paths / pass.light_paths) : 1;
    double least = std::numeric_limits<double>::infinity();
    for (uint32_t option = 0; option < trial.connected.size(); ++option) {
        const uint32_t rounds = trial.connected[option].best_rounds(most);
        const double here = trial.connected[option].inverse_efficiency(rounds);
        if (here < least) least = here, pass.light_rounds = rounds, pass.first_times = 1u << option;
    }
    if (!finds_all_unconnected(scene, pass)) return pass;
    // Hits of an eye path that is as long as those that are made of two, or as a splat's.
    const uint32_t alone = pass.kappa > 0 ? pass.eye_path_length + pass.light_path_length + 1
                                          : std::max(pass.eye_path_length, pass.light_path_length + 1);
    const uint32_t rounds = trial.unconnected.best_rounds(most);
    const double unconnected = trial.unconnected.inverse_efficiency(rounds);
    if (pass.kappa > 0 && unconnected < k_least_gain * least) {
        least = unconnected, pass.light_rounds = rounds;
        pass.kappa = 0, pass.eye_path_length = alone;
    }
    if (pass.splats && trial.unlit.inverse_efficiency(1) < least && !may_focus(scene)) {
        pass.splats = false, pass.light_rounds = 1;
        pass.kappa = 0, pass.eye_path_length = alone;
    }
    return pass;
}

}  // namespace

PassSettings for_scene(const SceneView& scene_alone, PassSettings pass, unsigned threads) {
    const bool light_walks = pass.light_path_length > 0 && pass.light_paths > 0 && scene_alone.light_count > 0;
    pass.splats &= light_walks;
    pass.kappa = 0;
    ThreadPool pool(threads);
    pass.light_guide = pass.weighting == Weighting::uniform ? LightGuide{} : learn_light_guide(scene_alone, pass, pool);
    const SceneView scene = guided(scene_alone, pass);
    if (pass.vlp_connections > 0 && light_walks) {
        const Pilot pilot = trace_pilot(scene, pass, pool);
        if (pilot.vlps_per_path > 0) pass.kappa = static_cast<float>(pass.vlp_candidates) / pilot.vlps_per_path;
        pass.vlp_grid = pilot.grid;
    }
    if (pass.adaptive && pass.traces_light() && pass.weighting == Weighting::balance)
        pass = as_it_pays(scene, pass, pool);
    if (!pass.traces_light()) {  // what is for light paths alone guides nothing
        const LightGuide none;
        pass.light_guide.favoured = none.favoured;
        if (!pass.light_guide.portals.in_next_event) pass.light_guide.portals = none.portals;
    }
    return pass;
}

}  // namespace vlp
