// The CPU back end: both passes as parallel loops over paths and over tiles of pixels.
#include <algorithm>
#include <atomic>
#include <numeric>

#include "backend/backend.h"
#include "backend/guided_pixel.h"
#include "core/atomic_add.h"
#include "core/parallel.h"
#include "integrator/light_tracing.h"
#include "integrator/path_tracing.h"
#include "integrator/vlp_groups.h"
#include "scene/scene.h"

namespace vlp {
namespace {

constexpr uint32_t k_paths_per_piece = 1024;
constexpr uint32_t k_tile = 16;  // pixels a side
constexpr uint32_t k_rows = 16;  // of the film that are cleared or committed at a time

// Memory on cache-line boundaries, left uninitialised: what is read has been written before.
template <typename T>
class RawArray {
public:
    // Another size loses what it held.
    void resize(size_t count) {
        if (count == count_) return;
        data_.reset();  // first, to have its room
        count_ = 0;
        if (count > 0) data_.reset(static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t{64})));
        count_ = count;
    }
    T* data() const { return data_.get(); }
    size_t bytes() const { return count_ * sizeof(T); }

private:
    struct AlignedDeleter {
        void operator()(void* p) const { ::operator delete(p, std::align_val_t{64}); }
    };

    std::unique_ptr<T[], AlignedDeleter> data_;
    size_t count_ = 0;
};

// Every other bit of `code`, gathered: a coordinate of a Morton code.
uint32_t compact_bits(uint32_t code) {
    code &= 0x55555555u;
    code = (code | (code >> 1)) & 0x33333333u;
    code = (code | (code >> 2)) & 0x0f0f0f0fu;
    code = (code | (code >> 4)) & 0x00ff00ffu;
    return (code | (code >> 8)) & 0x0000ffffu;
}

struct Tile {
    uint32_t x, y;  // in tiles
};

uint32_t tiles_along(uint32_t pixels) { return (pixels + k_tile - 1) / k_tile; }

uint32_t pieces_of(uint32_t paths) { return (paths + k_paths_per_piece - 1) / k_paths_per_piece; }

// Of the light paths that leave VLPs, in which threads take them.
uint32_t piece_count(const PassSettings& pass) { return pass.traces_light() ? pieces_of(pass.light_paths) : 0; }

// Of those that only splat.
uint32_t splat_piece_count(const PassSettings& pass) {
    return pass.traces_light() ? pieces_of(pass.splat_paths() - pass.light_paths) : 0;
}

// The size of the table of groups, with V at its end.
size_t groups_table(const PassSettings& pass) {
    return pass.kappa > 0 ? size_t{k_vlp_groups} * piece_count(pass) + 1 : 0;
}

// Tiles along a Z-order curve: neighbours in time are neighbours in the picture.
std::vector<Tile> tiles_in_morton_order(Window window) {
    const uint32_t nx = tiles_along(window.width), ny = tiles_along(window.height);
    uint32_t side = 1;
    while (side < std::max(nx, ny)) side *= 2;
    std::vector<Tile> tiles;
    tiles.reserve(static_cast<size_t>(nx) * ny);
    for (uint32_t code = 0; code < side * side; ++code) {
        const Tile tile{compact_bits(code), compact_bits(code >> 1)};
        if (tile.x < nx && tile.y < ny) tiles.push_back(tile);
    }
    return tiles;
}

class CpuBackend final : public Backend {
public:
    CpuBackend(const Scene& scene, const PassSettings& pass, unsigned threads) : pool_(threads) { update(scene, pass); }

    void update(const Scene& scene, const PassSettings& pass) override {
        counters.dropped = 0;
        counters.eye_samples = 0;
        scene_ = guided(scene.view(), pass);
        pass_ = pass;
        slots_.resize(has_vlps() ? light_vertex_capacity(pass) : 0);
        stored_.resize(has_vlps() ? candidate_capacity(pass) : 0);
        vertices_in_piece_ = std::vector<uint32_t>(piece_count(pass));
        groups_ = std::vector<uint32_t>(groups_table(pass));
        tiles_ = tiles_in_morton_order(scene.window());
        plan_ = SamplePlan(scene.window(), pass.adaptive);
        moments_ = std::vector<PixelMoments>(pass.adaptive ? scene.window().pixel_count() : 0);
    }

    bool run_iteration(uint32_t iteration, Film& film, const std::atomic<bool>& stop) override {
        const auto pieces = static_cast<uint32_t>(vertices_in_piece_.size());
        counters.work_done = 0;
        counters.work_total = pieces + splat_piece_count(pass_) + static_cast<uint32_t>(tiles_.size());
        for_rows(film, [&](uint32_t begin, uint32_t end) { film.clear_splats(begin, end); });
        if (plan_.due()) plan_samples();
        const SampleRates rates = plan_.rates(iteration, plan_.levels().data(), moments_.data());

        LightVertexCache cache;
        if (pieces > 0) {
            run_light_pass(iteration, film, stop);
            if (stop) return false;
            if (has_vlps()) cache = list_stored();
        }
        counters.stored_vlps = has_vlps() ? groups_.back() : 0;

        pool_.run(static_cast<uint32_t>(tiles_.size()), [&](uint32_t i) {
            if (stop) return;
            run_tile(rates, film, cache, tiles_[i]);
            counters.work_done.fetch_add(1, std::memory_order_relaxed);
        });
        if (stop) return false;
        for_rows(film, [&](uint32_t begin, uint32_t end) {
            film.commit_rows(begin, end);
            if (pass_.adaptive) add_moments(rates, film, begin, end);
        });
        film.count_iteration();
        counters.eye_samples += plan_.finish_iteration();
        return true;
    }

    void add_memory(MemoryByDevice& memory) const override {
        MemoryUse& cpu = memory["CPU"];
        cpu.light_vertices += slots_.bytes() + stored_.bytes();
        cpu.film += moments_.size() * (sizeof(PixelMoments) + sizeof(int8_t));
        cpu.work +=
            (vertices_in_piece_.capacity() + groups_.capacity()) * sizeof(uint32_t) + tiles_.capacity() * sizeof(Tile);
    }

private:
    bool has_vlps() const { return pass_.kappa > 0; }

    template <typename Body>
    void for_rows(const Film& film, const Body& body) {
        const uint32_t height = film.window().height;
        pool_.run((height + k_rows - 1) / k_rows,
                  [&](uint32_t i) { body(i * k_rows, std::min((i + 1) * k_rows, height)); });
    }

    // The first slot of a piece. Its paths' vertices follow one another from there on: less memory is touched than if each
    // path had L slots of its own, so that more of it stays in the caches.
    uint32_t first_slot(uint32_t piece) const { return piece * k_paths_per_piece * pass_.light_path_length; }

    // Traces all light paths. Their vertices are kept only where they serve as VLPs.
    void run_light_pass(uint32_t iteration, Film& film, const std::atomic<bool>& stop) {
        const auto pieces = static_cast<uint32_t>(vertices_in_piece_.size());
        pool_.run(pieces + splat_piece_count(pass_), [&](uint32_t piece) {
            if (stop) return;
            LightVertex path_alone[k_max_walk];
            SplatSink<AtomicAdd> sink{pass_, film.window(), film.splats().data(), film.point_splats().data(), {}};
            const bool leaves_vlps = piece < pieces;
            const uint32_t begin =
                leaves_vlps ? piece * k_paths_per_piece : pass_.light_paths + (piece - pieces) * k_paths_per_piece;
            const uint32_t end =
                std::min(begin + k_paths_per_piece, leaves_vlps ? pass_.light_paths : pass_.splat_paths());
            const bool keeps = leaves_vlps && has_vlps();
            uint32_t vertices = 0;
            for (uint32_t path = begin; path < end; ++path) {
                LightVertex* slots = keeps ? slots_.data() + first_slot(piece) + vertices : path_alone;
                vertices += trace_light_path(scene_, pass_, k_light_stream, iteration, path, slots, sink);
            }
            if (leaves_vlps) vertices_in_piece_[piece] = vertices;
            count_dropped(sink.dropped);
            counters.work_done.fetch_add(1, std::memory_order_relaxed);
        });
    }

    // Lists the slots that can be connected, by their groups.
    LightVertexCache list_stored() {
        const auto pieces = static_cast<uint32_t>(vertices_in_piece_.size());
        const auto end_of = [&](uint32_t piece) { return first_slot(piece) + vertices_in_piece_[piece]; };
        std::fill(groups_.begin(), groups_.end(), 0u);
        pool_.run(pieces, [&](uint32_t i) {
            count_groups(pass_.vlp_grid, slots_.data(), first_slot(i), end_of(i), &groups_[i], pieces);
        });
        std::exclusive_scan(groups_.begin(), groups_.end(), groups_.begin(), 0u);
        const Hands hands(pass_.vlp_candidates, groups_.back());
        pool_.run(pieces, [&](uint32_t i) {
            list_groups(scene_, pass_, slots_.data(), first_slot(i), end_of(i), &groups_[i], pieces, hands,
                        stored_.data());
        });
        list_blanks(hands, groups_.back(), stored_.data());
        return {slots_.data(), stored_.data(), hands.count};
    }

    void run_tile(const SampleRates& rates, Film& film, const LightVertexCache& cache, Tile tile) {
        const Window& window = film.window();
        const uint32_t x_end = std::min((tile.x + 1) * k_tile, window.width);
        const uint32_t y_end = std::min((tile.y + 1) * k_tile, window.height);
        uint64_t dropped = 0;
        for (uint32_t y = tile.y * k_tile; y < y_end; ++y) {
            for (uint32_t x = tile.x * k_tile; x < x_end; ++x) {
                const uint32_t i = y * window.width + x, px = window.x + x, py = window.y + y;
                const PixelTurn turn = turn_of(rates, i);
                if (turn.samples == 0) continue;
                const PixelResult result = film.has_guides()
                                               ? trace_guided_pixel(scene_, pass_, cache, turn, px, py)
                                               : trace_pixel<PixelSink>(scene_, pass_, cache, turn, px, py);
                film.frame()[i] = result.found;
                if (film.has_guides()) film.guide_frame()[i] = result.guide;
                dropped += result.dropped;
            }
        }
        count_dropped(dropped);
    }

    void add_moments(const SampleRates& rates, Film& film, uint32_t row_begin, uint32_t row_end) {
        const uint32_t width = film.window().width;
        for (uint32_t i = row_begin * width; i < row_end * width; ++i) {
            const PixelTurn turn = turn_of(rates, i);
            if (turn.samples > 0) moments_[i].add(film.frame()[i], turn.samples);
        }
    }

    void plan_samples() {
        std::vector<float> relative_variance(moments_.size());
        std::transform(moments_.begin(), moments_.end(), relative_variance.begin(),
                       [](const PixelMoments& m) { return m.relative_variance(); });
        plan_.plan(relative_variance);
    }

    void count_dropped(uint64_t dropped) {
        if (dropped > 0) counters.dropped.fetch_add(dropped, std::memory_order_relaxed);
    }

    SceneView scene_;
    PassSettings pass_;
    ThreadPool pool_;
    RawArray<LightVertex> slots_;
    RawArray<VlpCandidate> stored_;
    std::vector<uint32_t> vertices_in_piece_;
    std::vector<uint32_t> groups_;  // the table of vlp_groups.h, a column for each piece; V last
    std::vector<Tile> tiles_;
    SamplePlan plan_;
    std::vector<PixelMoments> moments_;  // of the film's pixels, where sampling is adaptive
};

}  // namespace

std::unique_ptr<Backend> make_cpu_backend(const Scene& scene, const PassSettings& pass, unsigned threads) {
    return std::make_unique<CpuBackend>(scene, pass, threads);
}

void add_cpu_memory(MemoryByDevice& memory, Window window, const PassSettings& pass) {
    MemoryUse& cpu = memory["CPU"];
    cpu.film += sample_plan_bytes(window, pass);
    if (pass.kappa > 0) cpu.light_vertices += light_memory(pass);
    cpu.work += (piece_count(pass) + groups_table(pass)) * sizeof(uint32_t) +
                size_t{tiles_along(window.width)} * tiles_along(window.height) * sizeof(Tile);
}

}  // namespace vlp
