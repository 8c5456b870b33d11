// A pool of threads that runs loops of independent pieces of work (host only).
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace vlp {

class ThreadPool {
public:
    // `threads` counts the caller, who works too; 0: one for each processor. Fewer where the system gives no more.
    explicit ThreadPool(unsigned threads = 0);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    unsigned size() const { return static_cast<unsigned>(workers_.size()) + 1; }

    // Calls body(i) for every i in [0, count), in any order; rethrows the first exception after all have ended.
    // Not re-entrant: a body must not call `run` of the same pool.
    void run(uint32_t count, const std::function<void(uint32_t)>& body);

private:
    bool start_worker();
    void work();

    std::vector<std::thread> workers_;
    std::mutex mutex_;
    std::condition_variable wake_, done_;
    const std::function<void(uint32_t)>* body_ = nullptr;
    std::atomic<uint32_t> next_{0};
    uint32_t count_ = 0;
    unsigned busy_ = 0;
    uint64_t generation_ = 0;
    bool stopping_ = false;
    std::exception_ptr error_;
};

}  // namespace vlp
