// The GPU back end: passes in batches of threads, sums of the film that stay on the device.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>

#include "backend/backend.h"
#include "backend/device_buffer.h"
#include "backend/gpu_kernels.h"
#include "backend/wavefront.h"
#include "bvh/compressed.h"

namespace vlp {

template <typename Device>
class GpuBackend final : public Backend {
public:
    // `arguments` make the device.
    template <typename... Arguments>
    GpuBackend(const Scene& scene, const PassSettings& pass, Arguments&&... arguments)
        : device_(std::forward<Arguments>(arguments)...) {
        counts_ = buffer<PassCounts>(1, "counts");
        counts_here_ = buffer<PassCounts>(1, "counts on the host", true);
        update(scene, pass);
    }
    GpuBackend(const GpuBackend&) = delete;
    GpuBackend& operator=(const GpuBackend&) = delete;
    // Buffers may not go while the device writes to them.
    ~GpuBackend() override {
        try {
            wait_for_all();
        } catch (const std::runtime_error&) {  // what is lost was told when it was waited for
        }
    }

    void update(const Scene& scene, const PassSettings& pass) override {
        wait_for_all();
        kept_ = downloading_ = 0;
        splats_are_clear_ = false;
        counters.dropped = 0;
        counters.eye_samples = 0;
        *counts_here_.data() = {};
        device_.clear(counts_.data(), counts_.bytes());
        const uint64_t uploaded = counters.uploaded;
        place_scene(scene);
        scene_ = guided(scene_, pass);
        place_film(scene.window(), pass);
        place_light_vertices(pass);
        place_wavefront(counters.uploaded != uploaded);
    }

    bool run_iteration(uint32_t iteration, Film& film, const std::atomic<bool>& stop) override {
        if (downloading_ > 0 && device_.is_over(downloaded_)) add_download(film);
        if (plan_.due()) plan_samples();
        const SampleRates rates = plan_.rates(iteration, levels_.data(), moments_.data());
        counters.work_done = 0;
        counters.work_total = pixels() + (pass_.traces_light() ? pass_.splat_paths() : 0);
        if (pass_.traces_light() && !run_light_pass(iteration, stop)) return false;
        const bool has_vlps = pass_.kappa > 0;
        const EyePass eye{
            scene_,         pass_,         rates,          window_,       has_vlps ? slots_.data() : nullptr,
            stored_.data(), frame_.data(), guides_.data(), counts_.data()};
        if (!run_eye_pass(eye, stop)) return false;
        device_.download(Queue::passes, counts_here_.data(), counts_.data(), counts_.bytes());
        if (downloading_ > 0) device_.queue_wait(Queue::passes, downloaded_);
        const auto channels = static_cast<uint32_t>(film_channels(pass_));
        device_.launch(0, channels * pixels(),
                       Commit{frame_.data(), guides_.data(), splats_.data(), point_splats_.data(), sums_.data(),
                              channels, kept_ == 0});
        if (pass_.adaptive) device_.launch(0, pixels(), AddMoments{rates, frame_.data(), moments_.data()});
        splats_are_clear_ = true;
        ++kept_;
        counters.eye_samples += plan_.finish_iteration();
        return true;
    }

    void finish() override {
        wait_for(Queue::passes);
        counters.dropped = counts_here_.data()->dropped;
        counters.stored_vlps = pass_.kappa > 0 ? static_cast<uint32_t>(counts_here_.data()->stored_vlps) : 0;
    }

    uint32_t kept() const override { return kept_ + downloading_; }

    void begin_collect() override {
        if (downloading_ > 0 || kept_ == 0) return;
        device_.record(finished_, Queue::passes);
        device_.queue_wait(Queue::copies, finished_);
        device_.download(Queue::copies, sums_here_.data(), sums_.data(), sums_.bytes());
        device_.record(downloaded_, Queue::copies);
        downloading_ = std::exchange(kept_, 0);
    }

    void collect(Film& film) override {
        if (downloading_ > 0) add_download(film);
        begin_collect();
        if (downloading_ > 0) add_download(film);
    }

    uint32_t light_paths(const PassSettings&) const override { return pass_.light_paths; }

    void add_memory(MemoryByDevice& memory) const override {
        MemoryUse& gpu = memory[Device::k_name];
        for (size_t part = 0; part < parts_.of.size(); ++part) gpu.scene.of[part] = parts_.of[part].buffer.bytes();
        gpu.film += frame_.bytes() + guides_.bytes() + splats_.bytes() + point_splats_.bytes() + sums_.bytes() +
                    moments_.bytes() + levels_.bytes() + variance_.bytes();
        gpu.light_vertices += slots_.bytes() + stored_.bytes();
        gpu.work += counts_.bytes() + groups_.bytes() + vertices_in_path_.bytes() + scratch_.bytes();
        gpu.work += wavefront_.bytes();
        gpu.stacks = device_.stack_bytes();
        memory["CPU"].film += sums_here_.bytes() + variance_here_.bytes() + levels_.bytes();
        memory["CPU"].work += counts_here_.bytes() + wavefront_.bytes_here();
    }

private:
    template <typename T>
    using Buffer = DeviceBuffer<T, Device>;

    // A part of the scene: its arrays, one after the other.
    struct Part {
        Buffer<std::byte> buffer;
        uint64_t revision = 0;
    };

    // Bound how long it takes to stop.
    static constexpr uint32_t k_batch = 1u << 18;
    static constexpr size_t k_nodes_at_once = 1u << 16;
    // Of a film's sums, each of which a thread has the index of.
    static constexpr size_t k_most_numbers = UINT32_MAX - 1024;
    // Light paths are halved until they fit, but not below this share of what was asked for.
    static constexpr uint32_t k_least_share = 64;

    template <typename T>
    Buffer<T> buffer(size_t count, const std::string& what, bool on_host = false) {
        try {
            return Buffer<T>(device_, count, what, on_host);
        } catch (const OutOfDeviceMemory&) {
            if (!wavefront_.placed()) throw;
            wavefront_.release();  // which can be done without
            return Buffer<T>(device_, count, what, on_host);
        }
    }

    uint32_t pixels() const { return static_cast<uint32_t>(window_.pixel_count()); }

    void wait_for(Queue queue) {
        device_.record(finished_, queue);
        device_.wait(finished_);
    }
    void wait_for_all() {
        wait_for(Queue::passes);
        wait_for(Queue::copies);
    }

    // Uploads the parts that have changed.
    void place_scene(const Scene& scene) {
        const ByPart<size_t> bytes = scene.bytes(NodeForm::compressed, k_device_alignment);
        ByPart<bool> changed;
        for (size_t i = 0; i < bytes.of.size(); ++i) {
            Part& part = parts_.of[i];
            const uint64_t revision = scene.revision(static_cast<ScenePart>(i));
            changed.of[i] = part.revision != revision || part.buffer.bytes() != bytes.of[i];
            part.revision = revision;
            if (part.buffer.bytes() == bytes.of[i]) continue;
            part.buffer = {};  // first, to have its room
            part.buffer = buffer<std::byte>(bytes.of[i], std::string("the scene's ") + k_scene_part_names[i]);
        }
        ByPart<size_t> end;
        const auto place = [&](ScenePart part, const void* data, size_t size) -> const void* {
            std::byte* const to = parts_[part].buffer.data() + end[part];
            end[part] += (size + k_device_alignment - 1) / k_device_alignment * k_device_alignment;
            if (!changed[part]) return to;
            if (data) {
                device_.upload(to, data, size);
            } else {
                upload_compressed(to, scene.nodes());
            }
            counters.uploaded += size;
            return to;
        };
        scene_ = scene.view_placed(place, NodeForm::compressed);
    }

    // In pieces, as nobody else needs them.
    void upload_compressed(std::byte* to, std::span<const BvhNode> nodes) {
        ThreadPool pool;
        for (; !nodes.empty(); nodes = nodes.subspan(std::min(nodes.size(), k_nodes_at_once))) {
            const std::vector<CompressedNode> piece =
                compress(nodes.first(std::min(nodes.size(), k_nodes_at_once)), pool);
            device_.upload(to, piece.data(), piece.size() * sizeof(CompressedNode));
            to += piece.size() * sizeof(CompressedNode);
        }
    }

    void place_film(Window window, const PassSettings& pass) {
        const size_t pixels = window.pixel_count();
        if (pixels > k_most_numbers / film_channels(pass)) {
            throw std::runtime_error(std::string("device ") + Device::k_name + ": a picture of " +
                                     std::to_string(pixels) + " pixels is too large");
        }
        window_ = window;
        resize(frame_, pixels, "the film");
        resize(guides_, pass.guides ? pixels : 0, "a denoiser's guides");
        resize(sums_, pixels * film_channels(pass), "the film's sums");
        resize(splats_, pass.splats ? pixels * 3 : 0, "splats");
        resize(point_splats_, pass.splats && pass.guides ? pixels * 3 : 0, "splats");
        resize(sums_here_, sums_.size(), "the film's sums on the host", true);
        plan_ = SamplePlan(window, pass.adaptive);
        const size_t planned = pass.adaptive ? pixels : 0;
        resize(moments_, planned, "the noise of pixels");
        resize(levels_, planned, "the samples of pixels");
        resize(variance_, planned, "the noise of pixels");
        resize(variance_here_, planned, "the noise of pixels on the host", true);
        device_.clear(moments_.data(), moments_.bytes());
    }

    // Chooses levels from the moments of all iterations so far, which are waited for.
    void plan_samples() {
        device_.launch(0, pixels(), TellVariance{moments_.data(), variance_.data()});
        device_.download(Queue::passes, variance_here_.data(), variance_.data(), variance_.bytes());
        wait_for(Queue::passes);
        plan_.plan({variance_here_.data(), variance_here_.size()});
        device_.upload(levels_.data(), plan_.levels().data(), levels_.bytes());
    }

    // Of as many light paths as there is room for: all, a half, a quarter, ...
    void place_light_vertices(const PassSettings& pass) {
        const bool traced = pass.traces_light();
        for (pass_ = pass;; pass_.light_paths /= 2) {
            try {
                resize(slots_, traced ? light_vertex_capacity(pass_) : 0, "light vertices");
                resize(stored_, traced ? candidate_capacity(pass_) : 0, "the list of virtual light points");
                const uint32_t paths = traced ? pass_.light_paths : 0;
                resize(vertices_in_path_, paths, "counts of light vertices");
                resize(groups_, traced ? SortRuns(paths).table(k_vlp_groups) : 0, "counts of virtual light points");
                resize(scratch_, scan_bytes(groups_.size()), "a scan");
                start_passes();
                return;
            } catch (const OutOfDeviceMemory&) {
                slots_ = {}, stored_ = {};
                if (!traced || pass_.light_paths / 2 < std::max(1u, pass.light_paths / k_least_share)) throw;
            }
        }
    }

    template <typename T>
    void resize(Buffer<T>& old, size_t count, const char* what, bool on_host = false) {
        if (old.size() == count) return;
        old = {};  // first, to have its room
        old = buffer<T>(count, what, on_host);
    }

    // For no path, so that the device reserves its stacks now and not in the middle of a render.
    void start_passes() {
        device_.launch(0, 0, LightPass{});
        if (pass_.guides) {
            device_.launch(0, 0, GuidedEyePass{});
        } else {
            device_.launch(0, 0, EyePass{});
        }
        wait_for(Queue::passes);
    }

    // After all else, as the eye pass can do without. Which form is faster is found out anew unless the camera alone moved.
    void place_wavefront(bool other_scene) {
        const std::optional<EyeForm> forced = forced_eye_form();
        if (forced == EyeForm::paths) {
            wavefront_.release();
            form_ = EyeFormChoice(*forced);
            return;
        }
        try {
            if (!wavefront_.place(pass_, window_.pixel_count()) && !other_scene) return;
            form_ = forced ? EyeFormChoice(*forced) : EyeFormChoice();
            pass_.guides ? wavefront_.template start<GuidedSink>() : wavefront_.template start<PixelSink>();
            wait_for(Queue::passes);
        } catch (const OutOfDeviceMemory&) {
            wavefront_.release();
            form_ = EyeFormChoice(EyeForm::paths);
        }
    }

    bool run_eye_pass(const EyePass& eye, const std::atomic<bool>& stop) {
        using Clock = std::chrono::steady_clock;
        const bool timed = form_.is_open();
        if (timed) wait_for(Queue::passes);
        const auto start = Clock::now();
        counters.eye_form = form_.next();
        const bool went_on = pass_.guides ? run_eye_pass<GuidedSink>(eye, GuidedEyePass{eye}, stop)
                                          : run_eye_pass<PixelSink>(eye, eye, stop);
        if (!went_on || !timed) return went_on;
        wait_for(Queue::passes);
        form_.took(std::chrono::duration<double>(Clock::now() - start).count());
        return true;
    }
    template <typename Sink, typename Paths>
    bool run_eye_pass(const EyePass& eye, const Paths& paths, const std::atomic<bool>& stop) {
        if (form_.next() == EyeForm::paths) return launch_in_batches(pixels(), paths, stop);
        const uint32_t before = counters.work_done;
        const auto tell = [&](uint64_t samples) {
            counters.work_done = before + static_cast<uint32_t>(std::min<uint64_t>(samples, pixels()));
        };
        if (!wavefront_.template run<Sink>(eye, stop, tell)) return false;
        tell(pixels());
        return true;
    }

    bool run_light_pass(uint32_t iteration, const std::atomic<bool>& stop) {
        if (!std::exchange(splats_are_clear_, false)) {
            device_.clear(splats_.data(), splats_.bytes());
            device_.clear(point_splats_.data(), point_splats_.bytes());
        }
        LightPass light{scene_,
                        pass_,
                        iteration,
                        pass_.light_rounds,
                        window_,
                        slots_.data(),
                        vertices_in_path_.data(),
                        splats_.data(),
                        point_splats_.data(),
                        counts_.data()};
        while (light.round-- > 0) {  // the first comes last, as its vertices are VLPs
            if (!launch_in_batches(pass_.light_paths, light, stop)) return false;
        }
        if (!(pass_.kappa > 0)) return true;
        list_stored();
        return true;
    }

    // Lists the light vertices that can be connected, by their groups.
    void list_stored() {
        const SortRuns runs(pass_.light_paths);
        const CountStored count{scene_, pass_, runs, slots_.data(), vertices_in_path_.data(), groups_.data()};
        device_.clear(groups_.data(), groups_.bytes());
        device_.launch(0, runs.count, count);
        device_.scan(groups_.data(), static_cast<uint32_t>(groups_.size()), scratch_.data(), scratch_.bytes());
        device_.launch(0, runs.count, ListStored{count, stored_.data(), counts_.data()});
    }

    // Queues body(i) for i below `count`, two batches ahead of the device at most. Whether `stop` let it.
    template <typename Body>
    bool launch_in_batches(uint32_t count, const Body& body, const std::atomic<bool>& stop) {
        for (uint32_t first = 0; first < count; first += k_batch) {
            if (stop) return false;
            const uint32_t end = std::min(count, first + k_batch);
            auto& before = batches_[next_batch_++ % batches_.size()];
            device_.wait(before);
            device_.launch(first, end, body);
            device_.record(before, Queue::passes);
            counters.work_done += end - first;
        }
        return !stop;
    }

    Device device_;
    PassSettings pass_;
    SceneView scene_;
    Window window_;
    ByPart<Part> parts_;
    Buffer<LightVertex> slots_;
    Buffer<VlpCandidate> stored_;
    Buffer<uint32_t> groups_;
    Buffer<uint8_t> vertices_in_path_;
    Buffer<std::byte> scratch_;
    Buffer<PixelSample> frame_;
    Buffer<GuideSample> guides_;
    Buffer<ExactSum> splats_, point_splats_, sums_, sums_here_;
    Buffer<PassCounts> counts_, counts_here_;  // "here": on the host
    SamplePlan plan_;
    Buffer<PixelMoments> moments_;  // this and the next: where sampling is adaptive
    Buffer<int8_t> levels_;
    Buffer<float> variance_, variance_here_;
    EyeFormChoice form_;
    Wavefront<Device> wavefront_{device_};
    typename Device::Event finished_{device_}, downloaded_{device_};
    std::array<typename Device::Event, 2> batches_{typename Device::Event{device_}, typename Device::Event{device_}};
    uint32_t next_batch_ = 0;
    uint32_t kept_ = 0, downloading_ = 0;  // iterations in sums_, and in what is on its way to sums_here_
    bool splats_are_clear_ = false;

    void add_download(Film& film) {
        device_.wait(downloaded_);
        film.add({sums_here_.data(), sums_here_.size()}, std::exchange(downloading_, 0));
    }
};

}  // namespace vlp
