// Which iterations of a render are done, and which are to be done next (host only).
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <set>

namespace vlp {

// Devices that share a render take iterations in order and finish them in any. For one thread, but for `finished`, which
// any may ask.
class Iterations {
public:
    explicit Iterations(uint32_t first) : next_(first) {}

    void restart(uint32_t first) {
        const std::lock_guard lock(mutex_);
        next_ = first;
        given_back_.clear();
        finished_.clear();
    }

    // The first one below `end` that nobody has taken.
    std::optional<uint32_t> take(uint32_t end) {
        if (!given_back_.empty() && *given_back_.begin() < end) return given_back_.extract(given_back_.begin()).value();
        return next_ < end ? std::optional(next_++) : std::nullopt;
    }
    // Not done after all, whether it was finished or not.
    void give_back(uint32_t iteration) {
        given_back_.insert(iteration);
        const std::lock_guard lock(mutex_);
        const auto after = finished_.upper_bound(iteration);
        if (after == finished_.begin() || std::prev(after)->second <= iteration) return;
        const auto [begin, end] = *std::prev(after);
        finished_.erase(begin);
        if (begin < iteration) finished_[begin] = iteration;
        if (iteration + 1 < end) finished_[iteration + 1] = end;
    }

    void finish(uint32_t iteration) {
        const std::lock_guard lock(mutex_);
        uint32_t begin = iteration, end = iteration + 1;
        const auto after = finished_.lower_bound(iteration);
        if (after != finished_.begin() && std::prev(after)->second == begin) begin = std::prev(after)->first;
        if (after != finished_.end() && after->first == end) {
            end = after->second;
            finished_.erase(after);
        }
        finished_[begin] = end;
    }
    // Those that are done, [begin, end) by begin; neighbouring ranges are one.
    std::map<uint32_t, uint32_t> finished() const {
        const std::lock_guard lock(mutex_);
        return finished_;
    }

private:
    uint32_t next_;
    std::set<uint32_t> given_back_;
    mutable std::mutex mutex_;  // of finished_
    std::map<uint32_t, uint32_t> finished_;
};

}  // namespace vlp
