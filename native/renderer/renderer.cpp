// Iterations, deadlines and cancellation.
#include "renderer/renderer.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <utility>

#include "scene/scene.h"

namespace vlp {

namespace {

// How much of a render is lost at most where a device fails for good.
constexpr double k_seconds_between_collections = 1;

std::string fewer_light_paths(uint32_t paths, uint32_t asked) {
    return "device CUDA: out of memory for " + std::to_string(asked) + " light paths; rendering with " +
           std::to_string(paths);
}

}  // namespace

Devices make_devices(const std::string& device, const Scene& scene, PassSettings& pass, unsigned threads,
                     const MakeBackend& make_gpu) {
    Devices devices;
    if (device != "AUTO" && device != "CPU" && device != "CUDA" && device != "HYBRID") {
        throw std::runtime_error("device " + device + ": must be AUTO, CPU, CUDA or HYBRID");
    }
    if (device == "CUDA" || device == "HYBRID") {
        try {
            devices.main = make_gpu(scene, pass);
            const uint32_t asked = std::exchange(pass.light_paths, devices.main->light_paths(pass));
            if (pass.light_paths < asked) devices.notes.push_back(fewer_light_paths(pass.light_paths, asked));
        } catch (const std::runtime_error& error) {
            devices.notes.push_back(std::string(error.what()) + "; rendering on the CPU");
        }
    }
    const auto cpu = [threads](const Scene& of, const PassSettings& with) {
        return make_cpu_backend(of, with, threads);
    };
    if (!devices.main) {
        devices.main = cpu(scene, pass);
    } else if (device == "HYBRID") {
        devices.helper = cpu(scene, pass);
    } else {
        devices.spare = cpu;
    }
    return devices;
}

Renderer::Renderer(std::shared_ptr<const Scene> scene, const PassSettings& pass, Window window, Devices devices,
                   uint32_t first, uint32_t end)
    : scene_(std::move(scene)),
      pass_(pass),
      film_(window, pass.splats, pass.guides),
      main_(std::move(devices.main)),
      active_(main_.get()),
      helper_(devices.helper ? std::make_unique<Helper>(std::move(devices.helper), film_) : nullptr),
      spare_(std::move(devices.spare)),
      notes_(std::move(devices.notes)),
      iterations_(first),
      end_(end) {
    pass_.light_paths = main_->light_paths(pass_);
}

uint32_t Renderer::iterate(uint32_t count) {
    if (scene_ && !scene_->built()) throw std::logic_error("renderer: the scene is being changed");
    stop_ = false;
    int64_t done = 0;
    for (int change = -1; change < 0; done += change) {
        while (done < count && !stop_ && std::chrono::steady_clock::now() < deadline_) {
            done += collect_from_helper() ? 1 : run_one();
        }
        change = finish_main();
    }
    if (stop_) done += rest();
    update_total();
    return static_cast<uint32_t>(std::max<int64_t>(done, 0));
}

bool Renderer::collect_from_helper() {
    if (!helper_) return false;
    const std::optional<uint32_t> finished = helper_->collect(film_);
    if (finished) iterations_.finish(*finished);
    update_total();
    return finished.has_value();
}

// An iteration by the main device, while the helper, if any, is kept at work. How many more there are.
int Renderer::run_one() {
    if (helper_ && helper_->idle()) {
        if (const auto next = iterations_.take(end_)) helper_->start(*next);
    }
    std::optional<uint32_t> own = iterations_.take(helper_ ? end_ : k_none);
    if (!own && helper_ && !helper_->idle()) {
        // The last one is the helper's: whoever is sooner done with it.
        if (helper_->seconds_left() <= took_) {
            helper_->wait(stop_);
            return 0;
        }
        if (rest() > 0) return 1;
        own = iterations_.take(end_);
    }
    if (!own) own = iterations_.take(k_none);
    if (!own) return 0;

    const auto start = std::chrono::steady_clock::now();
    Backend& main = *active_.load();
    bool done = false;
    try {
        done = main.run_iteration(*own, film_, stop_);
        if (done) {
            iterations_.finish(*own);
            unsaved_.push_back(*own);
        }
        if (std::chrono::duration<double>(start - collected_).count() > k_seconds_between_collections) {
            main.begin_collect();
            collected_ = start;
        }
    } catch (const std::runtime_error& error) {
        if (!done) iterations_.give_back(*own);
        return (done ? 1 : 0) + go_on_without_main(error.what());
    }
    while (unsaved_.size() > main.kept()) unsaved_.pop_front();
    update_total();
    if (!done) {
        iterations_.give_back(*own);
        return 0;
    }
    took_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return 1;
}

// Waits for what the main device has in work. Returns how many more iterations there are: fewer where it fails.
int Renderer::finish_main() {
    try {
        active_.load()->finish();
        return 0;
    } catch (const std::runtime_error& error) {
        return go_on_without_main(error.what());
    }
}

int Renderer::settle() {
    int change = 0;
    try {
        active_.load()->collect(film_);
        unsaved_.clear();
    } catch (const std::runtime_error& error) {
        change = go_on_without_main(error.what());
    }
    update_total();
    return change;
}

// Saves what the failed device can still tell, and gives back the iterations that it cannot. Returns how many.
int Renderer::give_back_lost() {
    Backend& failed = *active_.load();
    int lost = 0;
    try {
        failed.collect(film_);
    } catch (const std::runtime_error&) {
        while (unsaved_.size() > failed.kept()) unsaved_.pop_front();
        for (const uint32_t iteration : unsaved_) iterations_.give_back(iteration);
        lost = static_cast<int>(unsaved_.size());
    }
    unsaved_.clear();
    update_total();
    return lost;
}

// To be called while an exception is handled, which goes on if no other device can. Returns how many more iterations there
// are: those of the helper that nobody had noticed, without those that are lost.
int Renderer::go_on_without_main(const char* reason) {
    const auto collected = static_cast<int>(rest());
    const int lost = give_back_lost();
    if (!helper_ && !spare_) throw;
    std::unique_ptr<Backend> cpu = helper_ ? nullptr : spare_(*scene_, pass_);
    const std::lock_guard lock(mutex_);
    if (helper_) cpu = helper_->release();
    instead_of_main_ = std::move(cpu);
    active_ = instead_of_main_.get();
    helper_.reset();
    spare_ = nullptr;
    notes_.push_back(std::string(reason) + "; going on with the CPU");
    return collected - lost;
}

void Renderer::update(std::shared_ptr<const Scene> scene, const PassSettings& pass, uint32_t first, uint32_t end) {
    rest();
    const std::shared_ptr<const Scene> old = scene_;  // lives until nobody looks at it
    {
        const std::lock_guard lock(mutex_);
        scene_ = std::move(scene);
        pass_ = pass;
        film_ = Film(scene_->window(), pass.splats, pass.guides);
    }
    iterations_.restart(first);
    end_ = end;
    unsaved_.clear();
    std::unique_ptr<Backend> helping;
    if (helper_) {
        const std::lock_guard lock(mutex_);
        helping = helper_->release();
        spare_ = [&helping](const Scene&, const PassSettings&) { return std::move(helping); };
        helper_.reset();
    }
    try {
        Backend& main = *active_.load();
        main.update(*scene_, pass_);
        pass_.light_paths = main.light_paths(pass_);
        if (pass_.light_paths < pass.light_paths) note(fewer_light_paths(pass_.light_paths, pass.light_paths));
    } catch (const std::runtime_error& error) {
        go_on_without_main(error.what());
        active_.load()->update(*scene_, pass_);
    }
    if (helping) {
        helping->update(*scene_, pass_);
        const std::lock_guard lock(mutex_);
        helper_ = std::make_unique<Helper>(std::move(helping), film_);
        spare_ = nullptr;
    }
    update_total();
}

uint32_t Renderer::rest() {
    if (!helper_) return 0;
    helper_->halt();
    const uint32_t collected = collect_from_helper() ? 1 : 0;
    if (const auto undone = helper_->abandon()) iterations_.give_back(*undone);
    return collected;
}

void Renderer::set_deadline(double seconds) {
    using Clock = std::chrono::steady_clock;
    deadline_ = seconds > 0
                    ? Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))
                    : Clock::time_point::max();
}

void Renderer::add_film_state(std::span<const ExactSum> sums, uint64_t iterations) {
    film_.add(sums, iterations);
    update_total();
}

void Renderer::note(const std::string& text) {
    const std::lock_guard lock(mutex_);
    notes_.push_back(text);
}

std::vector<std::string> Renderer::notes() const {
    const std::lock_guard lock(mutex_);
    return notes_;
}

uint64_t Renderer::sum_of(std::atomic<uint64_t> BackendCounters::* counter) const {
    const std::lock_guard lock(mutex_);
    uint64_t sum = main_->counters.*counter;
    if (instead_of_main_) sum += instead_of_main_->counters.*counter;
    return helper_ ? sum + helper_->backend().counters.*counter : sum;
}

uint64_t Renderer::dropped() const { return sum_of(&BackendCounters::dropped); }
uint64_t Renderer::eye_samples() const { return sum_of(&BackendCounters::eye_samples); }

MemoryByDevice Renderer::memory() const {
    const std::lock_guard lock(mutex_);
    MemoryByDevice memory;
    MemoryUse& host = memory["CPU"];
    if (scene_) host.scene = scene_->bytes();
    host.film = film_.bytes() * (helper_ ? 2 : 1);
    active_.load()->add_memory(memory);
    if (helper_) helper_->backend().add_memory(memory);
    return memory;
}

uint64_t Renderer::uploaded_bytes() const {
    const std::lock_guard lock(mutex_);
    return main_->counters.uploaded;
}

float Renderer::progress() const {
    const BackendCounters& c = active_.load()->counters;
    return static_cast<float>(c.work_done) / static_cast<float>(c.work_total);
}

}  // namespace vlp
