// Python's Renderer, and the devices there are.
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <stdexcept>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "renderer/pilot.h"
#include "renderer/renderer.h"
#include "renderer/strategies.h"
#include "renderer/truncation.h"
#include "scene/scene.h"

namespace vlp {
namespace {

using Picture = nb::ndarray<float, nb::shape<-1, -1, 4>, nb::c_contig, nb::device::cpu>;
using RgbPicture = nb::ndarray<float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using FilmState = nb::ndarray<const int64_t, nb::shape<-1, -1, -1, 2>, nb::c_contig, nb::device::cpu>;

template <typename T>
T get(const nb::dict& settings, const char* name) {
    if (!settings.contains(name)) throw std::invalid_argument(std::string("setting '") + name + "' is missing");
    return nb::cast<T>(settings[name]);
}

Weighting weighting_of(const std::string& name) {
    if (name == "UNIFORM") return Weighting::uniform;
    if (name == "BALANCE") return Weighting::balance;
    if (name == "POWER") return Weighting::power;
    throw std::invalid_argument("setting weighting: unknown value '" + name + "'");
}

Filter filter_of(const std::string& name) {
    if (name == "BOX") return Filter::box;
    if (name == "GAUSSIAN") return Filter::gaussian;
    if (name == "BLACKMAN_HARRIS") return Filter::blackman_harris;
    throw std::invalid_argument("setting filter: unknown value '" + name + "'");
}

PassSettings pass_of(const nb::dict& settings, bool transparent_film) {
    PassSettings pass;
    pass.light_path_length = get<uint32_t>(settings, "light_path_length");
    pass.eye_path_length = get<uint32_t>(settings, "eye_path_length");
    pass.light_paths = get<uint32_t>(settings, "light_paths");
    pass.vlp_connections = get<uint32_t>(settings, "vlp_connections");
    pass.vlp_candidates = get<uint32_t>(settings, "vlp_candidates");
    pass.light_samples = get<uint32_t>(settings, "light_samples");
    pass.splats = get<bool>(settings, "splats");
    pass.hits = get<bool>(settings, "hits");
    pass.weighting = weighting_of(get<std::string>(settings, "weighting"));
    pass.roulette = get<bool>(settings, "roulette");
    pass.clamp_direct = get<float>(settings, "clamp_direct");
    pass.clamp_indirect = get<float>(settings, "clamp_indirect");
    pass.transparent_film = transparent_film;
    pass.guides = get<bool>(settings, "denoise");
    pass.adaptive = get<bool>(settings, "adaptive");
    pass.seed = get<uint32_t>(settings, "seed");
    pass.filter = filter_of(get<std::string>(settings, "filter"));
    pass.filter_width = get<float>(settings, "filter_width");
    if (!(pass.filter_width > 0) || !is_finite(pass.filter_width)) {
        throw std::invalid_argument("setting filter_width: " + std::to_string(pass.filter_width) + " must be above 0");
    }
    if (pass.vlp_candidates == 0) throw std::invalid_argument("setting vlp_candidates must be at least 1");
    if (pass.light_path_length > k_max_walk || pass.eye_path_length > k_max_walk || pass.eye_path_length == 0) {
        throw std::invalid_argument(
            "settings light_path_length and eye_path_length must be at most 64, the latter at least 1");
    }
    if (static_cast<uint64_t>(pass.light_paths) * pass.light_path_length >= (1ull << 31)) {
        throw std::invalid_argument("settings light_paths * light_path_length must be below 2^31");
    }
    return pass;
}

nb::object film_state(Renderer& renderer) {
    renderer.settle();
    const auto sums = renderer.film().sums();
    const Window& window = renderer.film().window();
    auto* words = new int64_t[sums.size() * 2];
    std::memcpy(words, sums.data(), sums.size_bytes());
    nb::capsule owner(words, [](void* p) noexcept { delete[] static_cast<int64_t*>(p); });
    return nb::cast(
        nb::ndarray<nb::numpy, int64_t>(words, {window.height, window.width, renderer.film().channels(), 2}, owner));
}

// Arrays of a film begin with its rows and columns.
template <typename A>
void require_size_of_film(const Renderer& renderer, const A& array, const char* what) {
    const Window& window = renderer.film().window();
    if (array.shape(0) == window.height && array.shape(1) == window.width) return;
    throw std::invalid_argument(std::string(what) + " of " + std::to_string(array.shape(1)) + " x " +
                                std::to_string(array.shape(0)) + " pixels, but the film has " +
                                std::to_string(window.width) + " x " + std::to_string(window.height));
}

void add_film_state(Renderer& renderer, FilmState state, uint64_t iterations) {
    require_size_of_film(renderer, state, "film state");
    if (state.shape(2) != renderer.film().channels()) {
        throw std::invalid_argument("film state of " + std::to_string(state.shape(2)) + " channels, but the film has " +
                                    std::to_string(renderer.film().channels()));
    }
    renderer.add_film_state({reinterpret_cast<const ExactSum*>(state.data()), state.size() / 2}, iterations);
}

PassSettings pass_of(const std::shared_ptr<Scene>& scene, const nb::dict& settings) {
    if (!scene || !scene->built()) throw std::runtime_error("scene: build() has not been called");
    return pass_of(settings, scene->transparent_film());
}

// In one iteration.
uint32_t traced_light_paths(const Renderer& renderer) {
    return renderer.pass().traces_light() ? renderer.pass().splat_paths() : 0;
}

// {device: {part: bytes}} without what takes none.
nb::dict to_python(const MemoryByDevice& memory) {
    nb::dict devices;
    for (const auto& [device, use] : memory) {
        nb::dict parts;
        const auto put = [&](const char* name, size_t bytes) {
            if (bytes > 0) parts[name] = bytes;
        };
        for (size_t i = 0; i < use.scene.of.size(); ++i) put(k_scene_part_names[i], use.scene.of[i]);
        put("light_vertices", use.light_vertices);
        put("film", use.film);
        put("work", use.work);
        put("stacks", use.stacks);
        devices[device.c_str()] = parts;
    }
    return devices;
}

// The iterations that settings ask for: where they end, and that they begin with.
struct IterationRange {
    uint32_t first, end;
};

IterationRange range_of(const nb::dict& settings) {
    const auto samples = get<uint32_t>(settings, "samples"), first = get<uint32_t>(settings, "iteration_begin");
    return {first, samples < k_none - first ? first + samples : k_none};
}

nb::list devices() {
    nb::list all;
    std::vector<DeviceInfo> found = {{"CPU", "CPU", 0}};
    for (const DeviceInfo& gpu : cuda_devices()) found.push_back(gpu);
    for (const DeviceInfo& device : found) {
        nb::dict d;
        d["name"] = device.name;
        d["kind"] = device.kind;
        d["memory"] = device.memory;
        d["isa"] = device.kind == "CPU" ? VLP_ISA : "cuda";
        all.append(d);
    }
    return all;
}

}  // namespace

void bind_renderer(nb::module_& m) {
    nb::class_<Renderer>(m, "Renderer")
        .def("__init__",
             [](Renderer* self, std::shared_ptr<Scene> scene, const nb::dict& settings) {
                 const PassSettings asked = pass_of(scene, settings);
                 const auto device = get<std::string>(settings, "device");
                 const auto threads = get<uint32_t>(settings, "threads");
                 const IterationRange iterations = range_of(settings);
                 nb::gil_scoped_release release;
                 PassSettings pass = for_scene(scene->view(), asked, threads);
                 Devices made = make_devices(device, *scene, pass, threads);
                 new (self) Renderer(scene, pass, scene->window(), std::move(made), iterations.first, iterations.end);
             })
        .def("update",
             [](Renderer& r, std::shared_ptr<Scene> scene, const nb::dict& settings) {
                 const PassSettings asked = pass_of(scene, settings);
                 const auto threads = get<uint32_t>(settings, "threads");
                 const IterationRange iterations = range_of(settings);
                 nb::gil_scoped_release release;
                 r.update(scene, for_scene(scene->view(), asked, threads), iterations.first, iterations.end);
             })
        .def("iterate", &Renderer::iterate, nb::arg("count"), nb::call_guard<nb::gil_scoped_release>())
        .def("cancel", &Renderer::cancel)
        .def(
            "rest", [](Renderer& r) { r.rest(); }, nb::call_guard<nb::gil_scoped_release>())
        .def("settle", &Renderer::settle, nb::call_guard<nb::gil_scoped_release>())
        .def("set_deadline", &Renderer::set_deadline, nb::arg("seconds"))
        .def("progress", &Renderer::progress)
        .def(
            "read",
            [](Renderer& r, Picture out) {
                require_size_of_film(r, out, "picture");
                const std::span<float> rgba(out.data(), out.size());
                nb::gil_scoped_release release;
                r.settle();
                r.film().read(rgba);
            },
            nb::arg("out").noconvert())
        .def(
            "read_guided",
            [](Renderer& r, RgbPicture color, RgbPicture albedo, RgbPicture normal) {
                for (const RgbPicture& picture : {color, albedo, normal}) require_size_of_film(r, picture, "picture");
                nb::gil_scoped_release release;
                r.settle();
                r.film().read_guided({color.data(), color.size()}, {albedo.data(), albedo.size()},
                                     {normal.data(), normal.size()});
            },
            nb::arg("color").noconvert(), nb::arg("albedo").noconvert(), nb::arg("normal").noconvert())
        .def("film_state", &film_state)
        .def("add_film_state", &add_film_state, nb::arg("state").noconvert(), nb::arg("iterations"))
        .def(
            "lost_light",
            [](const Renderer& r, uint32_t threads) {
                nb::gil_scoped_release release;
                ThreadPool pool(threads);
                const LostLight lost = measure_lost_light(r.scene().view(), r.pass(), pool);
                return std::array<float, 2>{lost.share, lost.standard_error};
            },
            nb::arg("threads"))
        .def("memory", [](const Renderer& r) { return to_python(r.memory()); })
        .def_prop_ro("uploaded_bytes", &Renderer::uploaded_bytes)
        .def_prop_ro("iterations", &Renderer::iteration_count)
        .def_prop_ro("vlps", [](const Renderer& r) { return r.stored_vlps(); })
        .def_prop_ro("dropped", [](const Renderer& r) { return r.dropped(); })
        .def_prop_ro("eye_form", [](const Renderer& r) { return k_eye_form_names[static_cast<size_t>(r.eye_form())]; })
        .def_prop_ro("eye_samples", [](const Renderer& r) { return r.eye_samples(); })
        .def_prop_ro("light_paths", &traced_light_paths)
        .def_prop_ro("light_rounds", [](const Renderer& r) { return r.pass().light_rounds; })
        .def_prop_ro("first_connections",
                     [](const Renderer& r) { return r.pass().kappa > 0 ? r.pass().connections_at(2) : 0; })
        .def_prop_ro("portals", [](const Renderer& r) { return r.pass().light_guide.portals.count; })
        .def_prop_ro("favoured_lights", [](const Renderer& r) { return r.pass().light_guide.favoured.count; })
        .def_prop_ro("paths",
                     [](const Renderer& r) {
                         return r.iteration_count() * (r.film().window().pixel_count() + traced_light_paths(r));
                     })
        .def_prop_ro("ranges", [](const Renderer& r) { return r.iterations().finished(); })
        .def_prop_ro("notes", &Renderer::notes)
        .def_prop_ro("kappa", [](const Renderer& r) { return r.pass().kappa; });
    nb::class_<StrategyRenderer>(m, "StrategyRenderer")
        .def("__init__",
             [](StrategyRenderer* self, std::shared_ptr<Scene> scene, const nb::dict& settings) {
                 const PassSettings pass = pass_of(scene, settings);
                 const auto threads = get<uint32_t>(settings, "threads");
                 nb::gil_scoped_release release;
                 new (self) StrategyRenderer(scene, pass, threads);
             })
        .def("iterate", &StrategyRenderer::iterate, nb::arg("iteration"), nb::call_guard<nb::gil_scoped_release>())
        .def(
            "read",
            [](const StrategyRenderer& r, uint32_t s, uint32_t t, bool weighted, RgbPicture out) {
                r.read(s, t, weighted, {out.data(), out.size()});
            },
            nb::arg("s"), nb::arg("t"), nb::arg("weighted"), nb::arg("out").noconvert());
    m.def("devices", &devices);
    m.def("plan_memory", [](const std::shared_ptr<Scene>& scene, const nb::dict& settings) {
        const PassSettings asked = pass_of(scene, settings);
        const auto device = get<std::string>(settings, "device");
        const auto threads = get<uint32_t>(settings, "threads");
        MemoryByDevice plan;
        {
            nb::gil_scoped_release release;
            plan = plan_memory(device, *scene, for_scene(scene->view(), asked, threads));
        }
        return to_python(plan);
    });
}

}  // namespace vlp
