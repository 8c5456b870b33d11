// The pool's workers: sleep until there is a loop, then take pieces until none is left.
#include "core/parallel.h"

#include <system_error>

namespace vlp {

ThreadPool::ThreadPool(unsigned threads) {
    if (threads == 0) threads = std::thread::hardware_concurrency();
    for (unsigned i = 1; i < threads; ++i) {
        if (!start_worker()) break;
    }
}

bool ThreadPool::start_worker() {
    try {
        workers_.emplace_back([this] {
            uint64_t seen = 0;
            std::unique_lock lock(mutex_);
            for (;;) {
                wake_.wait(lock, [&] { return stopping_ || generation_ != seen; });
                if (stopping_) return;
                seen = generation_;
                lock.unlock();
                work();
                lock.lock();
                if (--busy_ == 0) done_.notify_one();
            }
        });
    } catch (const std::system_error&) {
        return false;
    }
    return true;
}

ThreadPool::~ThreadPool() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::run(uint32_t count, const std::function<void(uint32_t)>& body) {
    {
        const std::lock_guard lock(mutex_);
        body_ = &body;
        count_ = count;
        next_ = 0;
        error_ = nullptr;
        busy_ = static_cast<unsigned>(workers_.size());
        ++generation_;
    }
    wake_.notify_all();
    work();
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return busy_ == 0; });
    body_ = nullptr;
    if (error_) std::rethrow_exception(error_);
}

void ThreadPool::work() {
    try {
        for (uint32_t i; (i = next_.fetch_add(1, std::memory_order_relaxed)) < count_;) (*body_)(i);
    } catch (...) {
        const std::lock_guard lock(mutex_);
        if (!error_) error_ = std::current_exception();
        next_ = count_;
    }
}

}  // namespace vlp
