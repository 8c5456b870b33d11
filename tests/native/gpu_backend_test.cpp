// The GPU back end's own logic, with the host as its device: buffers, batches, streams, memory that runs out, devices that
// fail and scenes that change. Pictures are the CPU back end's, see gpu_cases.h.
#include "gpu_cases.h"

#include <cstring>
#include <map>
#include <numeric>

namespace vlp::test {
namespace {

class GpuPasses : public testing::TestWithParam<std::tuple<NamedPass, const char*>> {};

TEST_P(GpuPasses, MakeTheCpusSums) {
    const auto scene = room();
    const PassSettings pass = for_scene(scene->view(), std::get<0>(GetParam()).pass);
    const FormOfEyePasses form(std::get<1>(GetParam()));
    const std::vector<ExactSum> expected = cpu_sums(*scene, pass, 5);
    EXPECT_GT(expected[4 * (12 * 24 + 12)].value(), 0);
    for (const Eager eager : {Eager::none, Eager::passes, Eager::copies}) {
        HostMachine machine;
        machine.eager = eager;
        HostBackend gpu(*scene, pass, machine);
        Film film(scene->window(), pass.splats, pass.guides);
        const std::atomic<bool> go_on{false};
        for (uint32_t i = 0; i < 5; ++i) {
            EXPECT_TRUE(gpu.run_iteration(i, film, go_on));
            if (i == 1 || i == 2) gpu.begin_collect();
        }
        EXPECT_EQ(film.iterations() + gpu.kept(), 5u);
        gpu.finish();
        gpu.collect(film);
        EXPECT_EQ(film.iterations(), 5u);
        EXPECT_EQ(gpu.kept(), 0u);
        expect_same_sums(film.sums(), expected);
        EXPECT_EQ(gpu.counters.stored_vlps > 0, pass.kappa > 0);
        gpu.collect(film);
        EXPECT_EQ(film.iterations(), 5u) << "nothing is collected twice";
    }
}

INSTANTIATE_TEST_SUITE_P(All, GpuPasses, testing::Combine(testing::ValuesIn(passes()), testing::ValuesIn(k_forms)),
                         [](const auto& chosen) {
                             const std::string form = std::get<1>(chosen.param);
                             return std::get<0>(chosen.param).name + ("_" + (form.empty() ? "chosen" : form));
                         });

// Over three plans, of which the device is told each; the block between them is interrupted.
TEST(GpuBackend, SamplesAdaptAsOnTheCpu) {
    const auto scene = room();
    for (const auto& [guides, name] : {std::pair{false, "paths"}, {false, "wavefront"}, {true, ""}}) {
        const FormOfEyePasses form(name);
        PassSettings asked = balanced();
        asked.adaptive = true, asked.guides = guides;
        const PassSettings pass = for_scene(scene->view(), asked);
        const std::vector<ExactSum> expected = cpu_sums(*scene, pass, 40);
        asked.adaptive = false;
        const std::vector<ExactSum> uniform = cpu_sums(*scene, for_scene(scene->view(), asked), 40);
        EXPECT_NE(std::memcmp(expected.data(), uniform.data(), uniform.size() * sizeof(ExactSum)), 0);
        for (const Eager eager : {Eager::none, Eager::passes, Eager::copies}) {
            HostMachine machine;
            machine.eager = eager;
            HostBackend gpu(*scene, pass, machine);
            Film film(scene->window(), pass.splats, pass.guides);
            for (uint32_t i = 0; i < 40; ++i) {
                if (i == 20) {
                    EXPECT_FALSE(gpu.run_iteration(i, film, true));
                }
                EXPECT_TRUE(gpu.run_iteration(i, film, false));
                if (i % 7 == 1) gpu.begin_collect();
            }
            gpu.finish();
            gpu.collect(film);
            expect_same_sums(film.sums(), expected);
        }
    }
}

TEST(GpuBackend, AWindowIsAPartOfThePicture) {
    auto scene = crowded_room(every_light().front().add, 24);
    scene->reopen({});
    scene->set_film(24, 24, {3, 5, 11, 7}, false);
    scene->build(1);
    const PassSettings pass = for_scene(scene->view(), balanced());
    HostMachine machine;
    HostBackend gpu(*scene, pass, machine);
    Film film(scene->window(), pass.splats);
    EXPECT_TRUE(gpu.run_iteration(0, film, false));
    gpu.collect(film);
    expect_same_sums(film.sums(), cpu_sums(*scene, pass, 1));
}

// More pixels and light paths than a batch: none is longer, and no more are queued than it takes to keep a GPU at work.
TEST(GpuBackend, BatchesAreBounded) {
    Scene scene;
    scene.set_world({1, 1, 1});
    add_materials(scene);
    add_surface(scene, quad({-1, -1, -2}, {1, -1, -2}, {1, 1, -2}, {-1, 1, -2}), k_white);
    scene.set_camera({});
    scene.set_film(700, 600, {0, 0, 700, 600}, false);
    scene.build(1);
    PassSettings pass;
    pass.light_paths = 300'000, pass.eye_path_length = 1;
    pass = for_scene(scene.view(), pass);
    ASSERT_GT(pass.kappa, 0);
    const std::vector<ExactSum> expected = cpu_sums(scene, pass, 2);
    for (const auto& [name, queued] : {std::pair{"paths", 5u}, {"wavefront", 32u}}) {  // two batches or rounds, and
        const FormOfEyePasses form(name);  // the short ones between
        HostMachine machine;
        HostBackend gpu(scene, pass, machine);
        Film film(scene.window());
        for (uint32_t i = 0; i < 2; ++i) EXPECT_TRUE(gpu.run_iteration(i, film, false));
        gpu.collect(film);
        EXPECT_LE(machine.most_in_one_launch, size_t{4} * 700 * 600);  // adding to the sums
        EXPECT_LE(machine.most_queued_launches, queued) << name;
        expect_same_sums(film.sums(), expected);
    }
}

TEST(GpuBackend, WhatIsStoppedLeavesTheSumsAsTheyWere) {
    const auto scene = room(8);
    const PassSettings pass = for_scene(scene->view(), balanced(40));
    const std::vector<ExactSum> expected = cpu_sums(*scene, pass, 2);
    for (const char* name : k_forms) {
        const FormOfEyePasses form(name);
        HostMachine machine;
        HostBackend gpu(*scene, pass, machine);
        Film film(scene->window(), pass.splats);
        EXPECT_TRUE(gpu.run_iteration(0, film, false));
        EXPECT_FALSE(gpu.run_iteration(1, film, true));
        // Stopped at each launch in turn: the first time the flag is read it is not set yet.
        std::atomic<bool> stop{false};
        bool done = false;
        for (int launches = 1; !done; ++launches) {
            stop = false;
            machine.on_launch = [&, left = launches]() mutable {
                if (--left == 0) stop = true;
            };
            EXPECT_EQ(gpu.kept(), 1u);
            done = gpu.run_iteration(1, film, stop);
            EXPECT_TRUE(done || stop);
        }
        machine.on_launch = {};
        EXPECT_EQ(gpu.kept(), 2u);
        gpu.collect(film);
        expect_same_sums(film.sums(), expected);
    }
}

TEST(GpuBackend, TakesTheMemoryThatWasPlanned) {
    const auto scene = room();
    std::vector<NamedPass> all = passes();
    all.push_back({"adaptive", balanced()});
    all.back().pass.adaptive = true;
    for (const NamedPass& named : all) {
        const FormOfEyePasses form(named.pass.guides ? "paths" : "");
        const PassSettings pass = for_scene(scene->view(), named.pass);
        HostMachine machine;
        MemoryByDevice plan, taken;
        add_gpu_memory(plan, *scene, pass);
        const size_t before = device_memory_taken();
        const HostBackend gpu(*scene, pass, machine);
        gpu.add_memory(taken);
        EXPECT_EQ(taken["HOST"].total(), plan["CUDA"].total()) << named.name;
        EXPECT_EQ(device_memory_taken() - before, plan["CUDA"].total()) << named.name;
        EXPECT_EQ(taken["HOST"].scene.of, plan["CUDA"].scene.of);
        EXPECT_EQ(taken["HOST"].light_vertices, plan["CUDA"].light_vertices);
        EXPECT_EQ(taken["HOST"].film, plan["CUDA"].film);
        EXPECT_EQ(taken["CPU"].total(), plan["CPU"].total());
    }
}

TEST(CpuBackend, TakesTheMemoryThatWasPlanned) {
    const std::shared_ptr<Scene> scene = room(40);
    for (const NamedPass& named : passes()) {
        PassSettings pass = for_scene(scene->view(), named.pass);
        MemoryByDevice plan = plan_memory("CPU", *scene, pass);
        Devices devices = make_devices("CPU", *scene, pass, 1);
        const Renderer renderer(scene, pass, scene->window(), std::move(devices), 0, 1);
        MemoryByDevice taken = renderer.memory();
        EXPECT_EQ(taken["CPU"].total(), plan["CPU"].total()) << named.name;
        EXPECT_EQ(taken.size(), 1u);
    }
}

TEST(GpuMemory, LightPathsAreHalvedUntilTheyFit) {
    const FormOfEyePasses form("paths");
    const auto scene = room();
    const PassSettings asked = for_scene(scene->view(), balanced(4000));
    MemoryByDevice plan;
    add_gpu_memory(plan, *scene, asked);
    const MemoryLimit limit(plan["CUDA"].total() - asked.light_paths * size_t{12 * 96} * 2 / 3);
    GpuRender render(scene, balanced(4000));
    EXPECT_EQ(render.pass.light_paths, 1000u);
    EXPECT_EQ(render.renderer->pass().light_paths, 1000u);
    ASSERT_EQ(render.renderer->notes().size(), 1u);
    EXPECT_EQ(render.renderer->notes()[0], "device CUDA: out of memory for 4000 light paths; rendering with 1000");
    EXPECT_EQ(render.renderer->iterate(3), 3u);
    render.renderer->settle();
    PassSettings fewer = asked;
    fewer.light_paths = 1000;
    expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, fewer, 3));
}

// Two devices must render the same estimator.
TEST(GpuMemory, TheHelperHasAsManyLightPaths) {
    const FormOfEyePasses form("paths");
    const auto scene = room();
    const PassSettings asked = for_scene(scene->view(), balanced(4000));
    MemoryByDevice plan;
    add_gpu_memory(plan, *scene, asked);
    const MemoryLimit limit(plan["CUDA"].total() - 1);
    GpuRender render(scene, balanced(4000), "HYBRID");
    EXPECT_EQ(render.pass.light_paths, 2000u);
    EXPECT_EQ(render.renderer->iterate(8), 8u);
    render.renderer->rest();
    render.renderer->settle();
    PassSettings fewer = asked;
    fewer.light_paths = 2000;
    const auto finished = render.renderer->iterations().finished();
    if (finished.size() == 1 && finished.begin()->first == 0) {
        expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, fewer, finished.begin()->second));
    }
}

TEST(GpuMemory, ALimitBelowWhatIsTakenLeavesNoRoom) {
    const auto scene = room();
    const PassSettings pass = for_scene(scene->view(), balanced());
    HostMachine machine;
    const HostBackend first(*scene, pass, machine);
    const MemoryLimit limit(device_memory_taken() - 1);
    EXPECT_THROW(HostBackend(*scene, pass, machine), OutOfDeviceMemory);
}

// Its sums have more numbers than a thread's index can count.
TEST(GpuMemory, APictureThatIsTooLargeIsRefused) {
    const auto scene = room(32768);
    HostMachine machine;
    try {
        const HostBackend gpu(*scene, for_scene(scene->view(), balanced()), machine);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "device HOST: a picture of 1073741824 pixels is too large");
    }
}

TEST(GpuMemory, WithoutRoomForTheSceneTheCpuRenders) {
    const auto scene = room();
    const MemoryLimit limit(1000);
    GpuRender render(scene, balanced());
    ASSERT_EQ(render.renderer->notes().size(), 1u);
    const size_t bytes = scene->bytes(NodeForm::compressed, k_device_alignment)[ScenePart::geometry];
    EXPECT_EQ(render.renderer->notes()[0], "device HOST: allocating " + std::to_string(bytes) +
                                               " bytes for the scene's geometry: out of memory; rendering on the CPU");
    EXPECT_EQ(render.renderer->iterate(2), 2u);
    expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, render.pass, 2));
}

TEST(GpuFailure, InAPassKeepsWhatIsRendered) {
    const auto scene = room(8);
    PassSettings asked = balanced(40);
    asked.eye_path_length = 3;
    const std::vector<ExactSum> expected = cpu_sums(*scene, for_scene(scene->view(), asked), 7);
    for (const char* name : k_forms) {
        const FormOfEyePasses form(name);
        bool failed = true;
        for (int launches = 0; failed; ++launches) {  // any of those of 7 iterations
            GpuRender render(scene, asked);
            render.machine.launches_until_failure = launches;
            EXPECT_EQ(render.renderer->iterate(3), 3u);
            EXPECT_EQ(render.renderer->iterate(4), 4u);
            EXPECT_EQ(render.renderer->settle(), 0);
            EXPECT_EQ(render.renderer->iterations().finished(), (std::map<uint32_t, uint32_t>{{0, 7}}));
            EXPECT_EQ(render.renderer->film().iterations(), 7u);
            failed = render.machine.launches_until_failure < 0;
            ASSERT_EQ(render.renderer->notes().size(), failed ? 1u : 0u);
            if (failed) {
                EXPECT_EQ(render.renderer->notes()[0], "device HOST: the passes: lost; going on with the CPU");
            }
            expect_same_sums(render.renderer->film().sums(), expected);
        }
    }
}

// What was still with the device is rendered again.
TEST(GpuFailure, WhileTheSumsAreReadIsMadeGood) {
    const auto scene = room();
    GpuRender render(scene, balanced());
    EXPECT_EQ(render.renderer->iterate(3), 3u);
    EXPECT_EQ(render.renderer->settle(), 0);
    EXPECT_EQ(render.renderer->iterate(2), 2u);
    EXPECT_EQ(render.renderer->iteration_count(), 5u);
    render.machine.downloads_until_failure = 0;
    EXPECT_EQ(render.renderer->settle(), -2);
    EXPECT_EQ(render.renderer->iteration_count(), 3u);
    EXPECT_EQ(render.renderer->iterations().finished(), (std::map<uint32_t, uint32_t>{{0, 3}}));
    EXPECT_EQ(render.renderer->iterate(4), 4u);
    EXPECT_EQ(render.renderer->iterations().finished(), (std::map<uint32_t, uint32_t>{{0, 7}}));
    expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, render.pass, 7));
}

// The sums after an update are those of a renderer that is made for the changed scene.
class GpuUpdate : public testing::Test {
protected:
    // Changes the scene, tells the renderer, and returns the bytes that were uploaded for it.
    uint64_t update(const Scene::Opened& parts, const std::function<void(Scene&)>& change) {
        const uint64_t before = render.renderer->uploaded_bytes();
        scene->reopen(parts);
        change(*scene);
        scene->build(1);
        render.renderer->update(scene, for_scene(scene->view(), balanced()), 0, 1000);
        const uint64_t uploaded = render.renderer->uploaded_bytes() - before;
        EXPECT_EQ(render.renderer->iteration_count(), 0u);
        EXPECT_EQ(render.renderer->iterate(3), 3u);
        render.renderer->settle();
        expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, render.renderer->pass(), 3));
        return uploaded;
    }
    uint64_t bytes_of(std::initializer_list<ScenePart> parts) const {
        uint64_t sum = 0;
        for (const ScenePart part : parts) sum += scene->bytes(NodeForm::compressed)[part];
        return sum;
    }
    void SetUp() override {
        EXPECT_EQ(render.renderer->uploaded_bytes(),
                  bytes_of({ScenePart::geometry, ScenePart::bvh, ScenePart::instances, ScenePart::materials,
                            ScenePart::lights, ScenePart::world, ScenePart::tables}));
        EXPECT_EQ(render.renderer->iterate(2), 2u);
    }

    std::shared_ptr<Scene> scene = room();
    GpuRender render{scene, balanced()};
};

TEST_F(GpuUpdate, OfTheCameraUploadsNothing) {
    const auto closer = [](Scene& s) { s.set_camera(looking({0.3f, -2.2f, 1}, {0, 0, 0.8f}, 0.45f)); };
    EXPECT_EQ(update({}, closer), 0u);
    const auto larger = [](Scene& s) { s.set_film(30, 20, {1, 2, 25, 17}, false); };
    EXPECT_EQ(update({}, larger), 0u);
}

TEST_F(GpuUpdate, OfSettingsUploadsNothing) {
    const uint64_t before = render.renderer->uploaded_bytes();
    PassSettings pass = balanced(300);
    pass.splats = false, pass.seed = 5;
    pass = for_scene(scene->view(), pass);
    render.renderer->update(scene, pass, 4, 1000);
    EXPECT_EQ(render.renderer->uploaded_bytes(), before);
    EXPECT_EQ(render.renderer->iterate(1), 1u);
    render.renderer->settle();
    EXPECT_EQ(render.renderer->iterations().finished(), (std::map<uint32_t, uint32_t>{{4, 5}}));
    const auto cpu = make_cpu_backend(*scene, pass, 1);
    Film film(scene->window());
    EXPECT_TRUE(cpu->run_iteration(4, film, false));
    expect_same_sums(render.renderer->film().sums(), film.sums());
}

TEST_F(GpuUpdate, OfAMovedMeshUploadsGeometryAndTree) {
    Mesh floor = quad({-1, -1, 0.1f}, {1, -1, 0}, {1, 1, 0.1f}, {-1, 1, 0});
    const uint64_t uploaded = update({}, [&](Scene& s) { s.move_mesh(0, floor.positions, {}, {}, {}); });
    EXPECT_EQ(uploaded, bytes_of({ScenePart::geometry, ScenePart::bvh}));
}

TEST_F(GpuUpdate, OfAMovedInstanceUploadsInstancesAndTree) {
    const auto change = [](Scene& s) { s.move_instance(10, placed_at({0.1f, 0, 0})); };
    EXPECT_EQ(update({}, change), bytes_of({ScenePart::instances, ScenePart::bvh}));
}

TEST_F(GpuUpdate, OfAMaterialUploadsMaterialsAlone) {
    const auto change = [](Scene& s) {
        add_materials(s);
        s.add_material(std::vector<LobeInput>{lobe(LobeKind::diffuse, 0.2f)}, {});
    };
    const uint64_t uploaded = update({.materials = true}, change);
    EXPECT_EQ(uploaded, bytes_of({ScenePart::materials}));
}

TEST_F(GpuUpdate, OfWhatGlowsUploadsLightsToo) {
    const auto change = [](Scene& s) {
        for (int32_t i = 0; i < k_emitter; ++i) {
            s.add_material(std::vector<LobeInput>{lobe(LobeKind::diffuse, 0.3f)}, {});
        }
        s.add_material({}, {9, 9, 9});
    };
    const uint64_t uploaded = update({.materials = true}, change);
    EXPECT_EQ(uploaded, bytes_of({ScenePart::materials, ScenePart::lights, ScenePart::instances}));
}

TEST_F(GpuUpdate, OfLampsUploadsLights) {
    const auto change = [](Scene& s) { s.add_lamp(make_point({0, 0, 1.5f}, {9, 9, 9}, 0.1f).value(), 0); };
    const uint64_t uploaded = update({.lamps = true}, change);
    EXPECT_EQ(uploaded, bytes_of({ScenePart::lights}));
}

TEST_F(GpuUpdate, OfTheWorldUploadsItsPicture) {
    const auto change = [](Scene& s) {
        const std::vector<Rgb> texels{{1, 2, 3}, {3, 2, 1}, {0, 1, 0}, {5, 5, 5}};
        s.set_world_image(texels, 2, 2, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    };
    const uint64_t uploaded = update({.world = true}, change);
    EXPECT_EQ(uploaded, bytes_of({ScenePart::world, ScenePart::lights}));
    EXPECT_GT(bytes_of({ScenePart::world}), 48u);
}

TEST_F(GpuUpdate, OfTheGeometryUploadsAll) {
    const uint64_t before = render.renderer->uploaded_bytes();
    scene = crowded_room(every_light().front().add, 20);
    render.renderer->update(scene, for_scene(scene->view(), balanced()), 0, 1000);
    const ByPart<size_t> bytes = scene->bytes(NodeForm::compressed);
    EXPECT_EQ(render.renderer->uploaded_bytes() - before, std::accumulate(bytes.of.begin(), bytes.of.end(), size_t{0}));
    EXPECT_EQ(render.renderer->iterate(3), 3u);
    render.renderer->settle();
    expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, render.renderer->pass(), 3));
}

TEST_F(GpuUpdate, ThatFailsIsMadeByTheCpu) {
    render.machine.launches_until_failure = 0;
    update({.materials = true}, [](Scene& s) { add_materials(s); });
    ASSERT_EQ(render.renderer->notes().size(), 1u);
    EXPECT_EQ(render.renderer->notes()[0], "device HOST: the passes: lost; going on with the CPU");
}

TEST_F(GpuUpdate, WithTooManyLightPathsRendersFewer) {
    const MemoryLimit limit(device_memory_taken() + 1'000'000);
    const PassSettings asked = for_scene(scene->view(), balanced(100'000));
    render.renderer->update(scene, asked, 0, 1000);
    PassSettings fewer = asked;
    fewer.light_paths = 1562;
    EXPECT_EQ(render.renderer->pass().light_paths, 1562u);  // a half of a half ... of 100 000, once it fits
    ASSERT_EQ(render.renderer->notes().size(), 1u);
    EXPECT_EQ(render.renderer->notes()[0], "device CUDA: out of memory for 100000 light paths; rendering with 1562");
    EXPECT_EQ(render.renderer->iterate(2), 2u);
    render.renderer->settle();
    expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, fewer, 2));
}

TEST_F(GpuUpdate, OfTwoDevicesReachesBoth) {
    GpuRender both(scene, balanced(), "HYBRID");
    EXPECT_EQ(both.renderer->iterate(4), 4u);
    both.renderer->rest();
    scene->reopen({.lamps = true});
    scene->add_lamp(make_point({0, 0, 1.5f}, {9, 9, 9}, 0.1f).value(), 0);
    scene->build(1);
    both.renderer->update(scene, for_scene(scene->view(), balanced()), 0, 6);
    EXPECT_EQ(both.renderer->iterate(6), 6u);
    both.renderer->rest();
    both.renderer->settle();
    EXPECT_EQ(both.renderer->iterations().finished(), (std::map<uint32_t, uint32_t>{{0, 6}}));
    expect_same_sums(both.renderer->film().sums(), cpu_sums(*scene, both.renderer->pass(), 6));
}

TEST_F(GpuUpdate, OnTheCpuCopiesNothing) {
    PassSettings pass = for_scene(scene->view(), balanced());
    Renderer renderer(scene, pass, scene->window(), make_devices("CPU", *scene, pass, 1), 0, 1000);
    EXPECT_EQ(renderer.iterate(2), 2u);
    scene->reopen({.materials = true});
    add_materials(*scene);
    EXPECT_THROW(renderer.iterate(1), std::logic_error);
    scene->build(1);
    renderer.update(scene, for_scene(scene->view(), balanced(200)), 0, 1000);
    EXPECT_EQ(renderer.iterate(3), 3u);
    EXPECT_EQ(renderer.uploaded_bytes(), 0u);
    expect_same_sums(renderer.film().sums(), cpu_sums(*scene, renderer.pass(), 3));
}

TEST(SceneUpdate, RefusesFewerMaterialsThanInstancesHave) {
    const auto scene = room();
    scene->reopen({.materials = true});
    scene->add_material({}, {1, 1, 1});
    EXPECT_THROW(scene->add_lamp({}, 0), std::logic_error);
    EXPECT_THROW(scene->build(1), std::invalid_argument);
    EXPECT_FALSE(scene->built());
}

TEST(Iterations, GiveBackWhatIsFinished) {
    Iterations all(0);
    for (uint32_t i = 0; i < 6; ++i) all.finish(all.take(10).value());
    all.give_back(3), all.give_back(5), all.give_back(0);
    EXPECT_EQ(all.finished(), (std::map<uint32_t, uint32_t>{{1, 3}, {4, 5}}));
    EXPECT_EQ(all.take(10), 0u);
    EXPECT_EQ(all.take(10), 3u);
    EXPECT_EQ(all.take(10), 5u);
    EXPECT_EQ(all.take(10), 6u);
}

}  // namespace
}  // namespace vlp::test
