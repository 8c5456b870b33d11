// Runs both passes and hands out every path that a strategy finds, from the light to the lens.
#pragma once

#include <algorithm>
#include <vector>

#include "integrator/light_tracing.h"
#include "integrator/path_tracing.h"
#include "integrator/vlp_groups.h"
#include "integrator/weights_reference.h"
#include "renderer/pilot.h"

namespace vlp::test {

// Keeps the splats that fall on the film, each with its share of every pixel added up.
struct SplatRecorder {
    using Sum = ConnectionSum;

    const SceneView& scene;
    const PassSettings& pass;
    struct Found {
        Splat splat;
        float on_film;  // sum of h over the pixels
    };
    std::vector<Found> found{};

    bool wanted(uint32_t i) const { return splats_from(pass, i); }
    bool reaches(Vec2) const { return true; }
    void add(const Splat& splat) {
        float on_film = 0;
        const Window all{0, 0, scene.camera.width, scene.camera.height};
        for_each_pixel(pass, all, splat.film, [&](uint32_t, uint32_t, float h) { on_film += h; });
        if (on_film > 0) found.push_back({splat, on_film});
    }
};

// The light pass of one iteration.
struct TracedLight {
    std::vector<LightVertex> slots;
    std::vector<VlpCandidate> stored;
    std::vector<SplatRecorder::Found> splats;
    LightVertexCache cache;

    TracedLight(const SceneView& scene, const PassSettings& pass, uint32_t iteration)
        : slots(size_t{pass.splat_paths()} * pass.light_path_length) {
        SplatRecorder recorder{scene, pass};
        for (uint32_t p = 0; p < pass.splat_paths() && pass.light_path_length > 0; ++p) {
            LightVertex* first = &slots[size_t{p} * pass.light_path_length];
            trace_light_path(scene, pass, k_light_stream, iteration, p, first, recorder);
        }
        splats = std::move(recorder.found);
        std::vector<uint32_t> connectible;
        for (uint32_t i = 0; i < size_t{pass.light_paths} * pass.light_path_length; ++i) {
            if (slots[i].connectible()) connectible.push_back(i);
        }
        const auto count = static_cast<uint32_t>(connectible.size());
        const Hands hands(pass.vlp_candidates, count);
        stored.resize(hands.places());
        for (uint32_t i = 0; i < count; ++i) {
            stored[hands.place(i)] = make_candidate(scene, pass, slots.data(), connectible[i]);
        }
        list_blanks(hands, count, stored.data());
        cache = {slots.data(), stored.data(), hands.count};
    }
};

inline PassSettings with_kappa(const SceneView& scene, PassSettings pass) {
    ThreadPool pool(1);
    const float per_path =
        pass.light_path_length > 0 && pass.light_paths > 0 ? trace_pilot(scene, pass, pool).vlps_per_path : 0.0f;
    pass.kappa = pass.vlp_connections > 0 && per_path > 0 ? 1 / per_path : 0.0f;
    return pass;
}

// The surface at a stored position with the normals of its primitive, which the light vertex rounds.
inline SurfacePoint exact_surface(const SceneView& scene, uint32_t instance, uint32_t primitive, Vec3 position) {
    const InstanceView& placement = scene.instances[instance];
    const GeometryView& geometry = scene.geometries[placement.geometry];
    const Vec3 p = transform_point(placement.world_to_object, position);
    SurfacePoint point;
    if (geometry.kind == GeometryKind::mesh) {
        const Triangle& t = geometry.triangles[primitive];
        const Vec3 a = geometry.positions[t.v[0]];
        const Vec3 e1 = geometry.positions[t.v[1]] - a, e2 = geometry.positions[t.v[2]] - a, n = cross(e1, e2);
        const float u = dot(cross(p - a, e2), n) / dot(n, n), v = dot(cross(e1, p - a), n) / dot(n, n);
        point = vlp::surface_of(scene, instance, primitive, u, v);
    } else {
        const Vec3 outward = p - geometry.spheres[primitive].center;
        point.geometric_normal = point.shading_normal = normalize(transform_normal(placement.world_to_object, outward));
        point.material = material_of(scene, placement, primitive);
        point.instance = instance, point.primitive = primitive;
    }
    point.position = position;
    return point;
}

// y_0 of a light path: its first draws once more.
struct LightStart {
    uint32_t light;
    Emission emission;
};
inline LightStart repeat_emission(const SceneView& scene, const PassSettings& pass, uint32_t iteration, uint32_t path) {
    Sampler sampler = make_sampler(hash(pass.seed, k_light_stream, iteration), path);
    const DiscreteSample choice = choose_source(scene, sampler.next_bits());
    const Vec2 u_position = sampler.next_2d(), u_direction = sampler.next_2d();
    return {choice.index, sample_emission(scene, scene.lights[choice.index], u_position, u_direction)};
}

// The emission normal of a light's point, from the two ends of the first edge alone.
inline Vec3 normal_on_light(const Light& light, Vec3 position, Vec3 x_1) {
    const Vec3 toward = x_1 - position;
    switch (light.kind) {
        case LightKind::area:
            return light.normal;
        case LightKind::triangle:
            return face_toward(light.normal, toward);
        case LightKind::point:
        case LightKind::spot:
        case LightKind::sphere:
            return light.radius > 0 ? face_toward(normalize(position - light.position), toward) : normalize(toward);
        default:
            return {};
    }
}

// y_0 ... y_{s-1} of what was found with y_{s-1} = c.vlp.
inline reference::Path light_vertices(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                                      uint32_t iteration, const Contribution& c) {
    const auto slot = static_cast<uint32_t>(c.vlp - cache.slots);
    const LightVertex* y = c.vlp - (c.s - 2);  // y_1
    const LightStart start = repeat_emission(scene, pass, iteration, slot / pass.light_path_length);
    reference::Path path;
    path.light = start.light;
    path.to_infinity = -start.emission.direction;
    path.x.emplace_back().surface.position = start.emission.position;
    for (uint32_t i = 1; i < c.s; ++i, ++y) {
        path.x.push_back({exact_surface(scene, y->instance, y->primitive, y->position), i + 1 < c.s && y->specular()});
    }
    return path;
}

// The directions and the light's normal of a path with all its vertices.
inline void complete(const SceneView& scene, reference::Path& path) {
    path.x[0].surface.geometric_normal =
        normal_on_light(scene.lights[path.light], path.x[0].surface.position, path.x[1].surface.position);
    reference::set_directions(scene, path);
}

// A sink of trace_eye_path that calls on_path(Path, Contribution) for everything found that is not black.
template <typename F>
struct PathRecorder {
    using Sum = ConnectionSum;

    const SceneView& scene;
    const PassSettings& pass;
    const LightVertexCache& cache;
    uint32_t iteration;
    F on_path;
    const EyeWalk* walk = nullptr;
    std::vector<SurfacePoint> hits{};  // z_1 ...
    Vec3 to_lens{};

    void visit(const EyeWalk& eye) {
        walk = &eye;
        hits.push_back(eye.surface);
        if (hits.size() == 1) to_lens = eye.w_eye;
    }

    void add(const Contribution& c) {
        if (is_black(c.value)) return;
        reference::Path path;
        if (c.s >= 2) {
            path = light_vertices(scene, pass, cache, iteration, c);
        } else if (c.light != k_none) {
            path.light = c.light;
            path.x.emplace_back();
            if (is_infinite(scene.lights[c.light])) {
                path.to_infinity = c.position;
            } else {
                path.x[0].surface.position = c.position;
            }
        } else {
            path.x.emplace_back();  // a light that only hits can find
        }
        for (size_t i = hits.size(); i-- > 0;) {  // z_{t-1} ... z_1
            const bool connected = i + 1 == hits.size() && c.s > 0;
            path.x.push_back({hits[i], !connected && walk->vertices[i + 1].specular});
        }
        if (!hits.empty()) {
            path.x.emplace_back().surface.position = hits[0].position + to_lens;
            if (path.light != k_none) complete(scene, path);
        }
        on_path(path, c);
    }
};

// The lens point of a splat from y_i: its draw once more, on the ray of the film position.
inline Vec3 lens_of(const SceneView& scene, const PassSettings& pass, uint32_t iteration, uint32_t path, uint32_t i,
                    Vec2 film) {
    Sampler sampler = make_sampler(hash(hash(pass.seed, k_light_stream, iteration), k_lens_stream), path);
    sampler.dimension = i;
    const Ray ray = sample_ray(scene.camera, film, sampler.next_2d());
    return ray.origin - ray.direction * distance_from_lens(scene.camera, ray);
}

// All paths of one iteration over the whole film.
template <typename F>
void record_paths(const SceneView& scene, const PassSettings& pass, uint32_t iteration, F on_path) {
    const TracedLight light(scene, pass, iteration);
    for (const SplatRecorder::Found& found : light.splats) {
        const Contribution& c = found.splat.found;
        const auto slot = static_cast<uint32_t>(c.vlp - light.cache.slots);
        reference::Path path = light_vertices(scene, pass, light.cache, iteration, c);
        path.x.emplace_back().surface.position =
            lens_of(scene, pass, iteration, slot / pass.light_path_length, c.s - 1, found.splat.film);
        complete(scene, path);
        on_path(path, c);
    }
    for (uint32_t y = 0; y < scene.camera.height; ++y) {
        for (uint32_t x = 0; x < scene.camera.width; ++x) {
            PathRecorder<F&> recorder{scene, pass, light.cache, iteration, on_path};
            trace_eye_path(scene, pass, light.cache, {0, iteration}, x, y, recorder);
        }
    }
}

}  // namespace vlp::test
