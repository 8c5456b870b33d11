// Renderers of one device and of two: every iteration is in the picture once, whoever made it and whoever failed.
#include "renderer/renderer.h"

#include "renderer/pilot.h"
#include "same_sums.h"
#include "scene/scene.h"
#include "transport_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

namespace vlp::test {
namespace {

using namespace std::chrono_literals;
using Ranges = std::map<uint32_t, uint32_t>;

constexpr Window k_window{0, 0, 3, 2};

// Iteration i adds 2^i to every pixel, so that a sum tells which are in it. Fails at iteration `fails`.
class FakeDevice final : public Backend {
public:
    explicit FakeDevice(std::chrono::milliseconds takes, uint32_t fails = k_none) : takes_(takes), fails_(fails) {}

    bool run_iteration(uint32_t iteration, Film& film, const std::atomic<bool>& stop) override {
        ++runs;
        for (const auto end = std::chrono::steady_clock::now() + takes_; std::chrono::steady_clock::now() < end;) {
            if (stop) return false;
            std::this_thread::sleep_for(200us);
        }
        if (iteration >= fails_) throw std::runtime_error("device FAKE: lost");
        for (PixelSample& pixel : film.frame()) {
            std::fill(pixel.rgba, pixel.rgba + 4, std::ldexp(1.0f, static_cast<int>(iteration)));
        }
        film.commit_rows(0, film.window().height);
        film.count_iteration();
        counters.dropped += 1;
        return true;
    }
    void update(const Scene&, const PassSettings&) override {}
    void add_memory(MemoryByDevice& memory) const override { memory["FAKE"].work += 8; }

    std::atomic<int> runs{0};

private:
    std::chrono::milliseconds takes_;
    uint32_t fails_;
};

struct Pair {
    FakeDevice* main = nullptr;
    FakeDevice* helper = nullptr;
    std::unique_ptr<Renderer> renderer;

    Pair(std::chrono::milliseconds main_takes, std::chrono::milliseconds helper_takes, uint32_t end,
         uint32_t main_fails = k_none) {
        auto a = std::make_unique<FakeDevice>(main_takes, main_fails);
        auto b = std::make_unique<FakeDevice>(helper_takes);
        main = a.get(), helper = b.get();
        renderer = std::make_unique<Renderer>(nullptr, PassSettings{}, k_window,
                                              Devices{std::move(a), std::move(b), {}, {}}, 0, end);
    }
    Ranges done() const { return renderer->iterations().finished(); }
    double sum() const { return renderer->film().sums()[0].value(); }
};

TEST(Iterations, AreTakenInOrderAndJoinToRanges) {
    Iterations all(5);
    EXPECT_EQ(all.take(7), 5u);
    EXPECT_EQ(all.take(7), 6u);
    EXPECT_EQ(all.take(7), std::nullopt);
    EXPECT_EQ(all.take(100), 7u);
    all.finish(5), all.finish(7);
    EXPECT_EQ(all.finished(), (Ranges{{5, 6}, {7, 8}}));
    all.give_back(6);
    EXPECT_EQ(all.take(6), std::nullopt);
    EXPECT_EQ(all.take(100), 6u);
    all.finish(6);
    EXPECT_EQ(all.finished(), (Ranges{{5, 8}}));
    EXPECT_EQ(all.take(100), 8u);
}

TEST(TwoDevices, ShareTheIterations) {
    Pair pair(3ms, 3ms, 20);
    EXPECT_EQ(pair.renderer->iterate(20), 20u);
    EXPECT_EQ(pair.done(), (Ranges{{0, 20}}));
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 20) - 1);
    EXPECT_EQ(pair.renderer->film().iterations(), 20u);
    EXPECT_GE(pair.helper->runs, 5);
    EXPECT_GE(pair.main->runs, 5);
    EXPECT_EQ(pair.renderer->dropped(), 20u);
    EXPECT_EQ(pair.renderer->memory()["FAKE"].total(), 16u);
}

// The fast one does not wait for what the slow one will not finish in time: it takes it over.
TEST(TwoDevices, ASlowHelperDoesNotHoldUp) {
    Pair pair(1ms, 3000ms, 20);
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(pair.renderer->iterate(20), 20u);
    EXPECT_LT(std::chrono::steady_clock::now() - start, 1500ms);
    EXPECT_EQ(pair.done(), (Ranges{{0, 20}}));
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 20) - 1);
}

TEST(TwoDevices, ASlowMainDoesNotHoldUpTheHelper) {
    Pair pair(60ms, 1ms, 12);
    EXPECT_EQ(pair.renderer->iterate(12), 12u);
    EXPECT_EQ(pair.done(), (Ranges{{0, 12}}));
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 12) - 1);
}

// Small helpings, as progress reports ask for: the helper keeps its iteration from one to the next.
TEST(TwoDevices, TheHelperGoesOnBetweenCalls) {
    Pair pair(2ms, 15ms, 24);
    for (uint32_t done = 0; done < 24;) done += pair.renderer->iterate(1);
    EXPECT_EQ(pair.done(), (Ranges{{0, 24}}));
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 24) - 1);
    EXPECT_GE(pair.helper->runs, 2);
}

TEST(TwoDevices, TheHelperTakesNoneBeyondTheEnd) {
    Pair pair(1ms, 1ms, 4);
    EXPECT_EQ(pair.renderer->iterate(4), 4u);
    EXPECT_EQ(pair.renderer->iterate(3), 3u);  // asked for more all the same
    EXPECT_EQ(pair.done(), (Ranges{{0, 7}}));
}

TEST(TwoDevices, WhatIsCancelledIsMadeLater) {
    Pair pair(20ms, 20ms, 16);
    std::thread other([&] {
        std::this_thread::sleep_for(70ms);
        pair.renderer->cancel();
    });
    uint32_t done = pair.renderer->iterate(16);
    other.join();
    EXPECT_LT(done, 16u);
    EXPECT_EQ(pair.renderer->film().iterations(), done);
    done += pair.renderer->iterate(16 - done);
    EXPECT_EQ(done, 16u);
    EXPECT_EQ(pair.done(), (Ranges{{0, 16}}));
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 16) - 1);
}

TEST(TwoDevices, RestLeavesAHoleThatIsToldOf) {
    Pair pair(1ms, 2000ms, 16);
    EXPECT_EQ(pair.renderer->iterate(3), 3u);
    pair.renderer->rest();
    EXPECT_EQ(pair.done(), (Ranges{{1, 4}})) << "iteration 0 was the helper's";
    EXPECT_EQ(pair.sum(), 2 + 4 + 8);
}

TEST(TwoDevices, TheHelperGoesOnAloneWhenTheOtherFails) {
    Pair pair(3ms, 3ms, 16, 6);
    EXPECT_EQ(pair.renderer->iterate(16), 16u);
    EXPECT_EQ(pair.done(), (Ranges{{0, 16}}));
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 16) - 1);
    ASSERT_EQ(pair.renderer->notes().size(), 1u);
    EXPECT_EQ(pair.renderer->notes()[0], "device FAKE: lost; going on with the CPU");
    EXPECT_EQ(pair.renderer->dropped(), 16u);
}

// From 40 paths and 181 candidates to 100 paths and 1: as many bytes in all, but not of each array.
TEST(CpuBackend, AnUpdateMakesRoomForEachArray) {
    const std::shared_ptr<Scene> scene = crowded_room(every_light().front().add, 8, {});
    PassSettings pass;
    pass.light_path_length = 1, pass.eye_path_length = 2;
    pass.light_paths = 40, pass.vlp_candidates = 181;
    const PassSettings before = for_scene(scene->view(), pass);
    pass.light_paths = 100, pass.vlp_candidates = 1;
    const PassSettings after = for_scene(scene->view(), pass);
    Renderer updated(scene, before, scene->window(), Devices{make_cpu_backend(*scene, before, 1), nullptr, {}, {}}, 0,
                     4);
    Renderer anew(scene, after, scene->window(), Devices{make_cpu_backend(*scene, after, 1), nullptr, {}, {}}, 0, 4);
    EXPECT_EQ(updated.memory().at("CPU").light_vertices, anew.memory().at("CPU").light_vertices);
    EXPECT_EQ(updated.iterate(2), 2u);
    updated.update(scene, after, 0, 4);
    EXPECT_EQ(updated.iterate(4), 4u);
    EXPECT_EQ(anew.iterate(4), 4u);
    EXPECT_GT(anew.stored_vlps(), 40u);
    const auto a = updated.film().sums(), b = anew.film().sums();
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size_bytes()), 0);
}

// Two CPU back ends with splats and guides: the sums are bit for bit those of one, and the picture is that without guides.
TEST(TwoDevices, MakeThePictureOfOne) {
    const std::shared_ptr<Scene> scene = crowded_room(every_light().front().add, 24, {});
    PassSettings pass;
    pass.light_path_length = 3, pass.eye_path_length = 4, pass.light_paths = 300;
    pass.splats = true, pass.roulette = true;
    pass = for_scene(scene->view(), pass);
    const auto cpu = [&] { return make_cpu_backend(*scene, pass, 1); };
    Renderer plain(scene, pass, scene->window(), Devices{cpu(), nullptr, {}, {}}, 3, 15);
    pass.guides = true;
    Renderer one(scene, pass, scene->window(), Devices{cpu(), nullptr, {}, {}}, 3, 15);
    Renderer two(scene, pass, scene->window(), Devices{cpu(), cpu(), {}, {}}, 3, 15);
    EXPECT_EQ(plain.iterate(12), 12u);
    EXPECT_EQ(one.iterate(12), 12u);
    EXPECT_EQ(two.iterate(12), 12u);
    EXPECT_EQ(two.iterations().finished(), (Ranges{{3, 15}}));
    const auto a = one.film().sums(), b = two.film().sums();
    ASSERT_EQ(a.size(), 13u * 24 * 24);
    for (size_t c = 0; c < 13; ++c) EXPECT_GT(a[13 * (12 * 24 + 12) + c].value(), 0);
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size_bytes()), 0);
    std::vector<ExactSum> picture;
    for (size_t i = 0; i < a.size(); ++i) {
        if (i % 13 < 4) picture.push_back(a[i]);
    }
    expect_same_by_other_code(picture, plain.film().sums());
}

// As a progress display does; a sanitizer for threads has something to find here.
TEST(TwoDevices, CanBeAskedWhileTheyRender) {
    Pair pair(1ms, 1ms, 60, 30);
    std::atomic<bool> over{false};
    std::thread other([&] {
        while (!over) {
            uint32_t done = 0;
            for (const auto& [begin, end] : pair.done()) done += end - begin;
            EXPECT_LE(done, 60u);
            EXPECT_LE(pair.renderer->notes().size(), 1u);
            EXPECT_LE(pair.renderer->memory()["FAKE"].total(), 16u);
            EXPECT_LE(pair.renderer->dropped(), 60u);
            EXPECT_LE(pair.renderer->progress(), 1);
        }
    });
    EXPECT_EQ(pair.renderer->iterate(60), 60u);
    over = true;
    other.join();
    EXPECT_EQ(pair.sum(), std::ldexp(1.0, 60) - 1);
}

TEST(OneDevice, ASpareTakesOverWhenItFails) {
    const auto scene = std::make_shared<Scene>();
    scene->build(1);
    const auto spare = [](const Scene&, const PassSettings&) { return std::make_unique<FakeDevice>(0ms); };
    Renderer renderer(scene, PassSettings{}, k_window, {std::make_unique<FakeDevice>(0ms, 2), nullptr, spare, {}}, 0,
                      5);
    EXPECT_EQ(renderer.iterate(5), 5u);
    EXPECT_EQ(renderer.film().sums()[0].value(), 31);
    EXPECT_EQ(renderer.notes().size(), 1u);
}

TEST(OneDevice, AFailureWithoutSpareKeepsWhatIsDone) {
    Renderer renderer(nullptr, PassSettings{}, k_window, Devices{std::make_unique<FakeDevice>(0ms, 2), nullptr, {}, {}},
                      0, 5);
    EXPECT_THROW(renderer.iterate(5), std::runtime_error);
    EXPECT_EQ(renderer.film().iterations(), 2u);
    EXPECT_EQ(renderer.iterations().finished(), (Ranges{{0, 2}}));
}

}  // namespace
}  // namespace vlp::test
