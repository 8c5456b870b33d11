// A second device that renders iterations of its own beside the renderer's thread (host only).
#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "backend/backend.h"

namespace vlp {

// One iteration at a time, in a thread and a film of its own; sums of films are exact, so that it does not matter who made
// what. All calls from one thread.
class Helper {
public:
    Helper(std::unique_ptr<Backend> backend, const Film& like);
    ~Helper();
    Helper(const Helper&) = delete;
    Helper& operator=(const Helper&) = delete;

    bool idle() const { return !iteration_; }
    void start(uint32_t iteration);
    // Adds a finished iteration to `film` and returns which; nothing while there is none. Rethrows what ended it, after
    // which it is idle and the iteration undone.
    std::optional<uint32_t> collect(Film& film);
    // Waits until the iteration is finished or `stop` is set.
    void wait(const std::atomic<bool>& stop);
    // Makes the iteration under way end, finished or not.
    void halt();
    // Throws away the iteration that it has, if any, and returns which.
    std::optional<uint32_t> abandon();

    double seconds_left() const;  // of the iteration under way, as far as the last one tells; infinite before the first
    const Backend& backend() const { return *backend_; }
    std::unique_ptr<Backend> release();  // abandons first

private:
    void work();
    void end_thread();

    std::unique_ptr<Backend> backend_;
    Film film_;
    std::optional<uint32_t> iteration_;  // in work or finished
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    enum class State : uint8_t { idle, started, finished, stopped, failed, ending } state_ = State::idle;
    std::atomic<bool> stop_{false};
    std::exception_ptr error_;
    double started_ = 0, took_ = 0;  // seconds of a steady clock; of the last iteration, 0 before it
    std::thread thread_;
};

}  // namespace vlp
