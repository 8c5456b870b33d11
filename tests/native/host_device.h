// A device for GpuBackend that is the host: what is queued waits until it must be done, in an order of the test's choice.
#pragma once

#include <array>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "backend/gpu_backend.h"

#include <gtest/gtest.h>

namespace vlp::test {

// Which queue's work is done as soon as it is queued; the other's only when something waits for it.
enum class Eager : uint8_t { none, passes, copies };

// What the tests see of a device, and how they break it.
struct HostMachine {
    Eager eager = Eager::none;
    int launches_until_failure = -1;  // -1: never
    int downloads_until_failure = -1;
    size_t most_in_one_launch = 0;
    size_t most_queued_launches = 0;
    std::function<void()> on_launch;
};

class HostDevice {
public:
    static constexpr const char* k_name = "HOST";

    class Event {
    public:
        explicit Event(HostDevice&) {}
        Queue queue = Queue::passes;
        uint64_t work = 0;  // of the queue, that must be done
    };

    explicit HostDevice(HostMachine& machine) : machine_(machine) {}

    void* allocate(size_t bytes, bool) {
        auto* const data = static_cast<std::byte*>(::operator new(bytes + k_guard, std::align_val_t{64}));
        std::memset(data, 0xa5, bytes + k_guard);
        bytes_of_[data] = bytes;
        return data;
    }
    void release(void* data, bool) {
        const auto* const guard = static_cast<std::byte*>(data) + bytes_of_.extract(data).mapped();
        const bool intact = std::all_of(guard, guard + k_guard, [](std::byte b) { return b == std::byte{0xa5}; });
        EXPECT_TRUE(intact) << "written behind the end of a buffer";
        ::operator delete(data, std::align_val_t{64});
    }

    void upload(void* to, const void* from, size_t bytes) {
        do_until(pending(Queue::passes).queued, Queue::passes);
        std::memcpy(to, from, bytes);
    }
    void clear(void* to, size_t bytes) {
        if (bytes == 0) return;
        put(Queue::passes, [=] { std::memset(to, 0, bytes); });
    }
    template <typename Body>
    void launch(uint32_t begin, uint32_t end, const Body& body) {
        machine_.most_in_one_launch = std::max<size_t>(machine_.most_in_one_launch, end - begin);
        const bool fails = machine_.launches_until_failure >= 0 && machine_.launches_until_failure-- == 0;
        if (machine_.on_launch) machine_.on_launch();
        ++queued_launches_;
        machine_.most_queued_launches = std::max(machine_.most_queued_launches, queued_launches_);
        put(Queue::passes, [=, this] {
            --queued_launches_;
            if (fails) lost_ = true;
            if (lost_) throw std::runtime_error("device HOST: the passes: lost");
            for (uint32_t i = begin; i < end; ++i) body(i);
        });
    }
    void scan(uint32_t* counts, uint32_t n, void*, size_t) {
        put(Queue::passes, [=] { std::exclusive_scan(counts, counts + n, counts, 0u); });
    }
    void download(Queue queue, void* to, const void* from, size_t bytes) {
        const bool fails =
            queue == Queue::copies && machine_.downloads_until_failure >= 0 && machine_.downloads_until_failure-- == 0;
        put(queue, [=, this] {
            if (fails) lost_ = true;
            if (lost_) throw std::runtime_error("device HOST: reading: lost");
            std::memcpy(to, from, bytes);
        });
    }

    void record(Event& event, Queue queue) { event.queue = queue, event.work = pending(queue).queued; }
    void queue_wait(Queue queue, Event& event) {
        put(queue, [this, event] { do_until(event.work, event.queue); });
    }
    void wait(Event& event) {
        do_until(event.work, event.queue);
        if (lost_) throw std::runtime_error("device HOST: lost");
    }
    bool is_over(Event& event) { return pending(event.queue).done >= event.work; }
    size_t stack_bytes() const { return 0; }

private:
    struct Pending {
        std::deque<std::function<void()>> work;
        uint64_t queued = 0, done = 0;
    };

    Pending& pending(Queue queue) { return queues_[static_cast<size_t>(queue)]; }

    void put(Queue queue, std::function<void()> work) {
        pending(queue).work.push_back(std::move(work));
        ++pending(queue).queued;
        if (machine_.eager == (queue == Queue::passes ? Eager::passes : Eager::copies)) {
            do_until(pending(queue).queued, queue);
        }
    }
    void do_until(uint64_t count, Queue queue) {
        Pending& q = pending(queue);
        while (q.done < count) {
            const auto next = std::move(q.work.front());
            q.work.pop_front();
            ++q.done;
            next();
        }
    }

    static constexpr size_t k_guard = 4096;

    HostMachine& machine_;
    std::map<void*, size_t> bytes_of_;
    std::array<Pending, 2> queues_;
    size_t queued_launches_ = 0;
    bool lost_ = false;
};

using HostBackend = GpuBackend<HostDevice>;

}  // namespace vlp::test
