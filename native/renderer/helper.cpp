// The helper's thread and its states.
#include "renderer/helper.h"

#include <chrono>
#include <limits>
#include <utility>

namespace vlp {

namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

Helper::Helper(std::unique_ptr<Backend> backend, const Film& like)
    : backend_(std::move(backend)),
      film_(like.window(), like.has_splats(), like.has_guides()),
      thread_([this] { work(); }) {}

Helper::~Helper() { end_thread(); }

void Helper::end_thread() {
    if (!thread_.joinable()) return;
    abandon();
    {
        const std::lock_guard lock(mutex_);
        state_ = State::ending;
    }
    changed_.notify_all();
    thread_.join();
}

std::unique_ptr<Backend> Helper::release() {
    end_thread();
    return std::move(backend_);
}

void Helper::start(uint32_t iteration) {
    {
        const std::lock_guard lock(mutex_);
        iteration_ = iteration;
        stop_ = false;
        started_ = now();
        state_ = State::started;
    }
    changed_.notify_all();
}

std::optional<uint32_t> Helper::collect(Film& film) {
    const std::lock_guard lock(mutex_);
    if (state_ != State::finished && state_ != State::failed) return std::nullopt;
    const std::optional<uint32_t> iteration = std::exchange(iteration_, std::nullopt);
    if (std::exchange(state_, State::idle) == State::failed) std::rethrow_exception(std::exchange(error_, nullptr));
    film.add(film_.sums(), 1);
    film_.clear();
    return iteration;
}

void Helper::wait(const std::atomic<bool>& stop) {
    std::unique_lock lock(mutex_);
    while (state_ == State::started && !stop) changed_.wait_for(lock, std::chrono::milliseconds(5));
}

void Helper::halt() {
    stop_ = true;
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return state_ != State::started; });
}

std::optional<uint32_t> Helper::abandon() {
    halt();
    const std::lock_guard lock(mutex_);
    state_ = State::idle;
    error_ = nullptr;
    film_.clear();
    return std::exchange(iteration_, std::nullopt);
}

double Helper::seconds_left() const {
    const std::lock_guard lock(mutex_);
    return took_ > 0 ? took_ - (now() - started_) : std::numeric_limits<double>::infinity();
}

void Helper::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return state_ == State::started || state_ == State::ending; });
        if (state_ == State::ending) return;
        const uint32_t iteration = iteration_.value_or(0);  // there is one once it is started
        lock.unlock();
        State outcome = State::failed;
        std::exception_ptr error;
        try {
            outcome = backend_->run_iteration(iteration, film_, stop_) ? State::finished : State::stopped;
            backend_->collect(film_);
        } catch (...) {
            error = std::current_exception();
        }
        lock.lock();
        if (outcome == State::finished) took_ = now() - started_;
        error_ = error;
        state_ = outcome;
        changed_.notify_all();
    }
}

}  // namespace vlp
