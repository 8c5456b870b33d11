// Portals and favoured lights, from where eye paths find light.
//
// A find of an eye path is a path from the light: its first edge is the ray that a light path should begin with, and its
// light the one that it should begin at, in proportion to what the find adds to the picture. If light paths have density q of
// such rays, relative to what they would have without a guide, the variance of what they bring goes with the mean of 1 / q
// over the finds. Guides are fitted to one half of the finds and have to show their gain with the other half.
#include "renderer/light_guide.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "integrator/path_tracing.h"
#include "light/light_build.h"

namespace vlp {
namespace {

constexpr uint32_t k_rounds = 8;  // of one path through every pixel that is looked at
constexpr uint32_t k_side = 32;  // pixels along each side, at most
constexpr size_t k_least_finds = 32;  // in each half; fewer say nothing
constexpr double k_most_times = 8;  // as large as usual that a find counts at most: more of it is chance
// Most that is left of 1 / q on average: a guide that brings little is not worth the noise that it adds elsewhere.
constexpr double k_most_left = 0.5, k_most_left_next_event = 0.75;

// Light that an eye path found at or from a light: next event or a hit.
struct Find {
    Vec3 x_1, direction;  // of infinite lights: toward the light
    double worth;
    uint32_t light;
    bool indirect;  // seen by way of another surface
};

struct FindSink {
    std::vector<Find>& finds;
    const EyeWalk* eye = nullptr;

    void visit(const EyeWalk& walk) { eye = &walk; }
    void add(const Contribution& c) {
        const auto worth = static_cast<double>(average(c.value * c.weight));
        if (c.s > 1 || c.s + c.t == 2 || c.light == k_none || !(worth > 0 && worth < 1e30)) return;
        finds.push_back({eye->surface.position, c.position, worth, c.light, eye->t > 2});
    }
};

using Finds = std::vector<Find>;

// The finds of the even and of the odd rounds.
std::pair<Finds, Finds> find_light(const SceneView& scene, PassSettings pass, ThreadPool& pool) {
    pass.light_path_length = 0, pass.kappa = 0, pass.splats = false;
    pass.hits = true, pass.light_samples = 1, pass.roulette = true, pass.weighting = Weighting::balance;
    const Camera& camera = scene.camera;
    const uint32_t columns = min_of(camera.width, k_side), rows = min_of(camera.height, k_side);
    Finds of_round[k_rounds];
    pool.run(k_rounds, [&](uint32_t round) {
        PassSettings own = pass;
        own.seed = hash(k_pilot_stream, 100 + round);
        for (uint32_t j = 0; j < rows; ++j) {
            for (uint32_t i = 0; i < columns; ++i) {
                const auto x = static_cast<uint32_t>((uint64_t{2} * i + 1) * camera.width / (2 * columns));
                const auto y = static_cast<uint32_t>((uint64_t{2} * j + 1) * camera.height / (2 * rows));
                FindSink sink{of_round[round]};
                trace_eye_path(scene, own, {}, {}, x, y, sink);
            }
        }
    });
    std::pair<Finds, Finds> halves;
    double sum = 0;
    size_t count = 0;
    for (uint32_t round = 0; round < k_rounds; ++round) {
        Finds& half = round % 2 == 0 ? halves.first : halves.second;
        half.insert(half.end(), of_round[round].begin(), of_round[round].end());
        for (const Find& find : of_round[round]) sum += find.worth;
        count += of_round[round].size();
    }
    for (Finds* half : {&halves.first, &halves.second}) {
        for (Find& find : *half) find.worth = std::min(find.worth, k_most_times * sum / static_cast<double>(count));
    }
    return halves;
}

template <typename Wanted>
Finds only(const Finds& finds, const Wanted& wanted) {
    Finds some;
    std::copy_if(finds.begin(), finds.end(), std::back_inserter(some), wanted);
    return some;
}

// The mean of 1 / q over finds; 1 where there are too few.
template <typename Density>
double left_of(const Finds& finds, const Density& q) {
    if (finds.size() < k_least_finds) return 1;
    double sum = 0, worth = 0;
    for (const Find& find : finds) sum += find.worth / q(find), worth += find.worth;
    return sum / worth;
}

// Where two lines come closest to each other; of parallel ones, midway between their x_1.
Vec3 crossing(const Find& a, const Find& b) {
    const Vec3 apart = b.x_1 - a.x_1;
    const float cosine = dot(a.direction, b.direction), sin_squared = 1 - cosine * cosine;
    if (sin_squared < 1e-3f) return a.x_1 + apart * 0.5f;
    const float along_a = dot(apart, a.direction), along_b = dot(apart, b.direction);
    const Vec3 on_a = a.x_1 + a.direction * ((along_a - cosine * along_b) / sin_squared);
    const Vec3 on_b = b.x_1 + b.direction * ((cosine * along_a - along_b) / sin_squared);
    return (on_a + on_b) * 0.5f;
}

struct Portal {
    Vec3 center;
    double radius = 0, worth = 0;  // of the lines through it
    double left = 1;  // the mean of 1 / q, were it the only one
};

// The one around `center` with the best radius for the lines.
Portal portal_around(const Finds& lines, Vec3 center, double scene_radius) {
    constexpr double k_margin = 1.05, k_least = 1e-3, k_share = k_portal_share;
    std::vector<std::pair<double, double>> by_distance;  // and worth
    double all = 0;
    for (const Find& line : lines) {
        by_distance.emplace_back(static_cast<double>(length(cross(center - line.x_1, line.direction))), line.worth);
        all += line.worth;
    }
    std::sort(by_distance.begin(), by_distance.end());
    Portal best{center};
    double within = 0;
    for (const auto& [off_axis, worth] : by_distance) {
        within += worth;
        const double radius = std::max(k_margin * off_axis, k_least * scene_radius);
        const double gain = within / all * (scene_radius / radius) * (scene_radius / radius);
        const double left = ((all - within) / (1 - k_share) + within / (1 - k_share + k_share * gain)) / all;
        if (left < best.left) best.left = left, best.radius = radius, best.worth = within;
    }
    return best;
}

// Portals, each the best for the lines that the ones before let by, of those around places where two lines cross. Its `share` is
// the worth of its lines.
Portals fit_portals(const Finds& all_lines, float scene_radius) {
    constexpr uint32_t k_tries = 96;
    constexpr size_t k_most_lines = 512;
    const size_t every = (all_lines.size() + k_most_lines - 1) / k_most_lines;
    Finds lines;
    for (size_t i = 0; i < all_lines.size(); i += every) lines.push_back(all_lines[i]);
    Portals portals;
    while (portals.count < k_max_portals && lines.size() >= k_least_finds) {
        Portal best;
        for (uint32_t i = 0; i < k_tries; ++i) {
            const auto any = [&](uint32_t which) -> const Find& { return lines[hash(i, which) % lines.size()]; };
            const Vec3 center = crossing(any(1), any(2));
            if (!is_finite(center)) continue;
            const Portal portal = portal_around(lines, center, static_cast<double>(scene_radius));
            if (portal.left < best.left) best = portal;
        }
        if (!(best.worth > 0)) break;
        portals.center[portals.count] = best.center;
        portals.radius[portals.count] = static_cast<float>(best.radius);
        portals.share[portals.count++] = static_cast<float>(best.worth);
        const float radius_squared = square(static_cast<float>(best.radius));
        std::erase_if(lines, [&](const Find& line) {
            return length_squared(cross(best.center - line.x_1, line.direction)) <= radius_squared;
        });
    }
    return portals;
}

// The first `count`, with shares that sum to 1.
Portals first_of(Portals portals, uint32_t count) {
    portals.count = count;
    float all = 0;
    for (uint32_t i = 0; i < count; ++i) all += portals.share[i];
    for (uint32_t i = 0; i < k_max_portals; ++i) portals.share[i] = i < count ? portals.share[i] / all : 0;
    return portals;
}

Portals learn_portals(const SceneView& scene, const Finds& fit, const Finds& check, bool light_paths) {
    const auto from_infinity = [&](const Find& f) {
        return is_infinite(scene.lights[f.light]) && (f.indirect || !light_paths);
    };
    const Finds others = only(check, from_infinity);
    const Portals fitted = fit_portals(only(fit, from_infinity), scene.radius);
    Portals best;
    double least = k_most_left;
    for (uint32_t count = 1; count <= fitted.count; ++count) {
        const Portals portals = first_of(fitted, count);
        const double left = left_of(others, [&](const Find& f) {
            return static_cast<double>(pdf_scene_disc(portals, scene.radius, f.x_1, -f.direction) /
                                       pdf_scene_disc(scene.radius));
        });
        constexpr double k_worth_another = 0.9;  // each portal costs time wherever densities are asked for
        if (left < least * (count == 1 ? 1 : k_worth_another)) least = left, best = portals;
    }
    if (best.count == 0) return best;
    const auto of_sky = [&](const Find& f) { return scene.lights[f.light].kind == LightKind::environment; };
    const double left = left_of(only(check, of_sky), [&](const Find& f) {
        const float anywhere = environment_pdf(scene.environment, f.direction);
        return static_cast<double>(pdf_through_portals(best, anywhere, f.x_1, f.direction) / anywhere);
    });
    best.in_next_event = left < k_most_left_next_event;
    return light_paths || best.in_next_event ? best : Portals{};
}

FavouredLights learn_favoured(const SceneView& scene, const Finds& fit, const Finds& check) {
    const auto indirect = [](const Find& f) { return f.indirect; };
    std::vector<double> worth(scene.light_count);
    for (const Find& find : only(fit, indirect)) worth[find.light] += find.worth;
    std::vector<uint32_t> order;
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        if (worth[i] > 0) order.push_back(i);
    }
    if (order.empty()) return FavouredLights{};
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return worth[a] > worth[b]; });
    if (order.size() > k_max_favoured) order.resize(k_max_favoured);
    FavouredLights favoured;
    std::vector<double> chosen;
    for (const uint32_t light : order) {
        favoured.light[favoured.count++] = light;
        chosen.push_back(worth[light]);
    }
    const std::vector<uint32_t> below = make_distribution(chosen);
    std::copy(below.begin(), below.end(), favoured.below);
    SceneView with = scene;
    with.light_guide.favoured = favoured;
    const double left = left_of(only(check, indirect), [&](const Find& f) {
        return static_cast<double>(pdf_choose_source(with, f.light) / pdf_choose_source(scene, f.light));
    });
    return left < k_most_left ? favoured : FavouredLights{};
}

}  // namespace

LightGuide learn_light_guide(const SceneView& scene, const PassSettings& pass, ThreadPool& pool) {
    const bool light_paths = pass.light_path_length > 0 && pass.light_paths > 0;
    bool from_infinity = false;
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        from_infinity |= light_paths ? is_infinite(scene.lights[i]) : scene.lights[i].kind == LightKind::environment;
    }
    if (!from_infinity && !(light_paths && scene.light_count > 1)) return LightGuide{};
    const auto [fit, check] = find_light(scene, pass, pool);
    LightGuide guide;
    if (from_infinity) guide.portals = learn_portals(scene, fit, check, light_paths);
    if (light_paths && scene.light_count > 1) guide.favoured = learn_favoured(scene, fit, check);
    return guide;
}

}  // namespace vlp
