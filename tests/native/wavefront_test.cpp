// The wavefront form of eye passes, with the host as the device: where samples begin, what it takes, and when it is chosen.
// The pictures of all forms are compared in gpu_backend_test.cpp.
#include "gpu_cases.h"

namespace vlp::test {
namespace {

// More samples than paths at a time: those that end make room for others.
TEST(Wavefront, BeginsSamplesWherePathsEnd) {
    const auto scene = room(520);
    PassSettings pass = balanced();
    pass.light_path_length = 2, pass.eye_path_length = 4;
    pass = for_scene(scene->view(), pass);
    ASSERT_LT(WavefrontSize(pass, scene->window().pixel_count()).slots, scene->window().pixel_count());
    const FormOfEyePasses form("wavefront");
    HostMachine machine;
    HostBackend gpu(*scene, pass, machine);
    Film film(scene->window(), pass.splats);
    EXPECT_TRUE(gpu.run_iteration(0, film, false));
    gpu.collect(film);
    EXPECT_EQ(gpu.counters.work_done, gpu.counters.work_total);
    expect_same_sums(film.sums(), cpu_sums(*scene, pass, 1));
}

TEST(Wavefront, OfManyConnectionsHasFewerPaths) {
    PassSettings pass = balanced();
    pass.light_samples = pass.vlp_connections = 64, pass.kappa = 1;
    const WavefrontSize size(pass, 1u << 20), small(balanced(), 1u << 20);
    EXPECT_LE(size.slots * size.slot_bytes(), WavefrontSize::k_most_bytes);
    EXPECT_GT(size.slots, 20'000u);
    EXPECT_EQ(small.slots, WavefrontSize::k_most_slots);
}

TEST(Wavefront, HasRoomForTheTablesOfAllItsRounds) {
    for (const uint32_t connections : {1u, 2u, 5u, 9u}) {
        PassSettings pass = balanced();
        pass.light_samples = connections, pass.kappa = 1;
        const WavefrontSize size(pass, 1u << 20);
        for (uint32_t paths = 1; paths <= size.slots; ++paths) {
            ASSERT_LE(SortRuns(paths).table(k_path_kinds), size.groups()) << paths << " of " << size.slots;
        }
    }
}

TEST(EyeFormChoice, TakesTheFasterForm) {
    for (const EyeForm faster : {EyeForm::paths, EyeForm::wavefront}) {
        EyeFormChoice choice;
        EXPECT_EQ(choice.next(), EyeForm::paths);
        int timed = 0;
        for (; choice.is_open(); ++timed) choice.took((choice.next() == faster ? 1.0 : 2.0) + (timed == 3 ? 9 : 0));
        EXPECT_EQ(timed, 5);
        EXPECT_EQ(choice.next(), faster);
    }
    for (const EyeForm form : {EyeForm::paths, EyeForm::wavefront}) {
        EXPECT_FALSE(EyeFormChoice(form).is_open());
        EXPECT_EQ(EyeFormChoice(form).next(), form);
    }
}

TEST(EyeFormChoice, AWrongNameIsToldAndTheCpuRenders) {
    const FormOfEyePasses form("wavefronts");
    GpuRender render(room(), balanced());
    ASSERT_EQ(render.renderer->notes().size(), 1u);
    EXPECT_NE(render.renderer->notes()[0].find("VLP_BPT_GPU_EYE_PASS='wavefronts': must be paths or wavefront"),
              std::string::npos)
        << render.renderer->notes()[0];
    EXPECT_EQ(render.renderer->iterate(1), 1u);
}

TEST(EyeFormChoice, IsMadeAnewForAnotherScene) {
    const std::shared_ptr<Scene> scene = room(), other = crowded_room(every_light().front().add, 24);
    const PassSettings pass = for_scene(scene->view(), balanced());
    HostMachine machine;
    HostBackend gpu(*scene, pass, machine);
    Film film(scene->window(), pass.splats);
    const auto wavefronts = [&] {  // of 8 iterations
        int count = 0;
        for (uint32_t i = 0; i < 8; ++i) {
            EXPECT_TRUE(gpu.run_iteration(i, film, false));
            count += gpu.counters.eye_form == EyeForm::wavefront;
        }
        return count;
    };
    const int first = wavefronts();
    EXPECT_TRUE(first == 2 || first == 5) << first;
    scene->reopen({});
    scene->set_camera(looking({0.3f, -2.2f, 1}, {0, 0, 0.8f}, 0.45f));
    scene->build(1);
    gpu.update(*scene, pass);
    EXPECT_EQ(wavefronts(), first == 2 ? 0 : 8);
    gpu.update(*other, for_scene(other->view(), balanced()));
    const int anew = wavefronts();
    EXPECT_TRUE(anew == 2 || anew == 5) << anew;
}

TEST(GpuMemory, WithoutRoomForAWavefrontThereIsNone) {
    const auto scene = room();
    const PassSettings asked = for_scene(scene->view(), balanced(4000));
    MemoryByDevice plan;
    add_gpu_memory(plan, *scene, asked);
    for (const size_t missing : {size_t{1}, WavefrontSize(asked, scene->window().pixel_count()).bytes()}) {
        const MemoryLimit limit(plan["CUDA"].total() - missing);
        GpuRender render(scene, balanced(4000));
        EXPECT_EQ(render.pass.light_paths, 4000u);
        EXPECT_EQ(render.renderer->iterate(2), 2u);
        EXPECT_TRUE(render.renderer->notes().empty());
        EXPECT_EQ(render.renderer->eye_form(), EyeForm::paths);
        render.renderer->settle();
        expect_same_sums(render.renderer->film().sums(), cpu_sums(*scene, asked, 2));
    }
}

}  // namespace
}  // namespace vlp::test
