// Runs the eye pass as a wavefront: memory for the paths, and rounds of launches until all samples are taken.
#pragma once

#include <array>
#include <atomic>
#include <optional>

#include "backend/device_buffer.h"
#include "backend/gpu_device.h"
#include "backend/wavefront_kernels.h"

namespace vlp {

// `Device` as in gpu_device.h.
template <typename Device>
class Wavefront {
public:
    explicit Wavefront(Device& device) : device_(device) {}

    // Makes room for a pass over so many pixels, if it is not what there is. Throws OutOfDeviceMemory, and then has none.
    bool place(const PassSettings& pass, size_t pixels) {
        const WavefrontSize size(pass, pixels);
        if (size_ && size == *size_) return false;
        release();
        try {
            slots_ = buffer<PathSlot>(size.slots);
            vertices_ = buffer<VertexDensity>(size_t{size.slots} * size.vertices_each);
            hits_ = buffer<Hit>(size.slots);
            connections_ = buffer<Connection>(size_t{size.slots} * size.connections_each);
            for (auto& list : lists_) list = buffer<uint32_t>(size.slots);
            kinds_ = buffer<uint8_t>(size.slots);
            finds_ = buffer<std::byte>(size.finds);
            first_samples_ = buffer<uint32_t>(size.first_samples());
            groups_ = buffer<uint32_t>(size.groups());
            scratch_ = buffer<std::byte>(size.scratch_bytes());
            counts_ = buffer<WavefrontCounts>(1);
            counts_here_ = DeviceBuffer<WavefrontCounts, Device>(device_, k_ahead, "counts on the host", true);
        } catch (const OutOfDeviceMemory&) {
            release();
            throw;
        }
        size_ = size;
        return true;
    }
    void release() {
        size_.reset();
        slots_ = {}, vertices_ = {}, hits_ = {}, connections_ = {}, lists_ = {}, kinds_ = {};
        finds_ = {}, first_samples_ = {}, groups_ = {}, scratch_ = {}, counts_ = {}, counts_here_ = {};
    }
    bool placed() const { return size_.has_value(); }
    size_t bytes() const { return size_ ? size_->bytes() : 0; }
    size_t bytes_here() const { return counts_here_.bytes(); }

    // Launches every kernel for no path.
    template <typename Sink>
    void start() {
        device_.launch(0, 0, CountSamples{});
        device_.launch(0, 0, BeginPaths<Sink>{});
        launch_round<Sink>(PathRound{}, 0);
        device_.launch(0, 0, MeanSamples<Sink>{});
    }

    // Queues the eye pass, k_ahead rounds ahead of the device at most. `begun(samples)` is told how far it is. Whether
    // `stop` let it.
    template <typename Sink, typename Begun>
    bool run(const EyePass& eye, const std::atomic<bool>& stop, const Begun& begun) {
        PathRound round{eye, queue(), {nullptr, size_->pixels}, 0};
        if (eye.rates.levels) {
            const auto pixels = size_->pixels;
            device_.launch(0, pixels + 1, CountSamples{eye.rates, first_samples_.data(), pixels});
            device_.scan(first_samples_.data(), pixels + 1, scratch_.data(), scratch_.bytes());
            round.samples.first = first_samples_.data();
        }
        device_.launch(0, size_->slots, BeginPaths<Sink>{round, size_->slots});
        uint32_t paths = size_->slots;  // at most: lists never grow
        for (uint32_t i = 0;; ++i) {
            if (stop) return false;
            WavefrontCounts& counts = counts_here_.data()[i % k_ahead];  // as round i - k_ahead left them
            device_.wait(done_[i % k_ahead]);
            if (i >= k_ahead) {
                paths = counts.ends[(i - k_ahead + 1) % 2].all;
                begun(counts.begun);
                if (paths == 0) break;
            }
            round.from = i % 2;
            launch_round<Sink>(round, paths);
            device_.download(Queue::passes, &counts, counts_.data(), counts_.bytes());
            device_.record(done_[i % k_ahead], Queue::passes);
        }
        device_.launch(0, size_->pixels, MeanSamples<Sink>{round});
        return !stop;
    }

private:
    static constexpr uint32_t k_ahead = WavefrontSize::k_rounds_ahead;

    template <typename T>
    DeviceBuffer<T, Device> buffer(size_t count) {
        return DeviceBuffer<T, Device>(device_, count, "the paths of a wavefront");
    }

    PathQueue queue() const {
        return {size_->vertices_each,
                size_->connections_each,
                slots_.data(),
                vertices_.data(),
                hits_.data(),
                connections_.data(),
                {lists_[0].data(), lists_[1].data()},
                counts_.data(),
                kinds_.data(),
                groups_.data(),
                finds_.data()};
    }

    template <typename Sink>
    void launch_round(const PathRound& round, uint32_t paths) {
        const SortRuns runs(paths);
        const CountKinds kinds{round, runs};
        device_.launch(0, paths, FindSurfaces{round});
        device_.launch(0, paths, ArriveAtSurfaces<Sink>{round});
        device_.clear(groups_.data(), runs.table(k_path_kinds) * sizeof(uint32_t));
        device_.launch(0, runs.count, kinds);
        device_.scan(groups_.data(), static_cast<uint32_t>(runs.table(k_path_kinds)), scratch_.data(),
                     scratch_.bytes());
        device_.launch(0, runs.count, SortPaths{kinds});
        device_.launch(0, paths, GatherLight{round});
        device_.launch(0, paths * round.queue.connections_each, SeeConnections{round, paths});
        device_.launch(0, paths, GoOn<Sink>{round});
    }

    Device& device_;
    std::optional<WavefrontSize> size_;
    DeviceBuffer<PathSlot, Device> slots_;
    DeviceBuffer<VertexDensity, Device> vertices_;
    DeviceBuffer<Hit, Device> hits_;
    DeviceBuffer<Connection, Device> connections_;
    std::array<DeviceBuffer<uint32_t, Device>, 2> lists_;
    DeviceBuffer<uint8_t, Device> kinds_;
    DeviceBuffer<std::byte, Device> finds_, scratch_;
    DeviceBuffer<uint32_t, Device> first_samples_, groups_;
    DeviceBuffer<WavefrontCounts, Device> counts_, counts_here_;  // "here": on the host
    std::array<typename Device::Event, k_ahead> done_{typename Device::Event{device_}, typename Device::Event{device_},
                                                      typename Device::Event{device_}};
};

}  // namespace vlp
