// A trial: light paths, VLPs and eye paths as an iteration has them, but few.
//
// The balance heuristic makes a path x count f(x) / p(x), whichever strategy found it, p being the sum of all densities and
// counts. The square of it is f^2 / p on average. Without connections p is less by their share of it, and the square 1 / (1 -
// share) times as large. So what a render without connections would be like follows from one with them, and precisely where
// it matters: connections find the rare bright paths that such a render would seldom meet.
//
// The same goes for a render without any light paths, whose eye paths find what splats would have found too.
//
// By the same rule a trial with F times the connections at z_1 tells of every smaller F' what each find would be there: p is less
// by (1 - F' / F) of the share that those connections have, and of them every F / F'-th is made.
#include "renderer/trial.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "integrator/light_tracing.h"
#include "integrator/path_tracing.h"
#include "renderer/vlp_list.h"

namespace vlp {
namespace {

constexpr uint32_t k_rounds = 8;  // each with one path through every pixel that is looked at
constexpr uint32_t k_light_paths = 512;  // in each round, at most
constexpr int k_around = 2;  // pixels to each side whose noise is taken together
constexpr uint32_t k_options = 4;  // F = 1, 2, 4, 8
constexpr double k_most_times = 30;  // as large as usual that a find counts at most: more of it is chance
constexpr float k_most_growth = 1000;  // of a square without connections: a render will not meet what comes more seldom

// Of `connections` at a surface, in steps of an eye walk. Of several candidates hardly any is kept that no shadow ray is sent to.
// A light vertex has a ray to the lens, and is listed.
double connection_cost(const PassSettings& pass, uint32_t connections) {
    if (connections == 0) return 0;
    return pass.vlp_candidates == 1 ? 0.65 * connections : 0.35 + (0.85 + 0.006 * pass.vlp_candidates) * connections;
}
constexpr double k_light_vertex_cost = 2;

// The pixels that are looked at, evenly spread over the whole picture: one in the middle of each cell.
struct Cells {
    uint32_t width, height;  // of the picture
    uint32_t columns, rows;

    explicit Cells(const Camera& camera)
        : width(camera.width), height(camera.height), columns(along(width)), rows(along(height)) {}

    size_t count() const { return size_t{columns} * rows; }
    double pixels_each() const { return static_cast<double>(width) * height / static_cast<double>(count()); }
    uint32_t x_of(size_t cell) const { return middle(static_cast<uint32_t>(cell % columns), columns, width); }
    uint32_t y_of(size_t cell) const { return middle(static_cast<uint32_t>(cell / columns), rows, height); }
    size_t at(Vec2 film) const { return size_t{index(film.y, rows, height)} * columns + index(film.x, columns, width); }

    // The mean over the cells around one.
    double around(size_t cell, const std::vector<double>& values) const {
        const auto x = static_cast<int>(cell % columns), y = static_cast<int>(cell / columns);
        double sum = 0;
        int cells = 0;
        for (int j = std::max(y - k_around, 0); j <= std::min(y + k_around, static_cast<int>(rows) - 1); ++j) {
            for (int i = std::max(x - k_around, 0); i <= std::min(x + k_around, static_cast<int>(columns) - 1); ++i) {
                sum += values[static_cast<size_t>(j) * columns + static_cast<size_t>(i)];
                ++cells;
            }
        }
        return sum / cells;
    }

private:
    static uint32_t along(uint32_t pixels) { return std::min(std::clamp(pixels / 8, 8u, 32u), pixels); }
    static uint32_t middle(uint32_t i, uint32_t cells, uint32_t pixels) {
        return static_cast<uint32_t>((uint64_t{2} * i + 1) * pixels / (2 * cells));
    }
    static uint32_t index(float at, uint32_t cells, uint32_t pixels) {
        return std::min(static_cast<uint32_t>(at * static_cast<float>(cells) / static_cast<float>(pixels)), cells - 1);
    }
};

// How a render goes without what the trial has: all of it, no connections, or no light paths.
enum class TrialWay : uint8_t { connected, unconnected, unlit };

// Something that was found: what it adds to a pixel, and by what share its square would grow without connections, and without
// splats either.
struct Find {
    float light = 0, limit = 0, first_share = 0, growth = 0, growth_unlit = 0;

    Find(const PassSettings& pass, const Contribution& c, float scale) {
        const Rgb found = c.value * (c.weight * scale);
        if (!is_finite(found)) return;
        light = average(found), limit = pass.clamp_of(c.s + c.t);
        first_share = c.shares.first;
        growth = growth_of((1 - c.shares.all) * c.draws);
        growth_unlit = growth_of((1 - c.shares.all - c.shares.splats) * c.draws);
    }
    static float growth_of(float left) { return (left > 1 / k_most_growth ? 1 / left : k_most_growth) - 1; }
    float growth_by(TrialWay way) const {
        return way == TrialWay::connected ? 0.0f : way == TrialWay::unconnected ? growth : growth_unlit;
    }
    // With `kept` of the connections at z_1.
    float with(float kept) const {
        const float there = light / (1 - first_share * (1 - kept));
        return limit > 0 ? min_of(there, limit) : there;
    }
};

// An eye path through a pixel.
struct TriedPath {
    using Sum = ConnectionSum;

    const SceneView& scene;
    const PassSettings& pass;
    float scale;  // light paths of an iteration for each of the trial
    uint32_t number;  // of the round: which connections are kept where not all are
    float light[k_options]{};  // with F = 1, 2, 4, 8 of the connections at z_1
    double growth = 0, growth_unlit = 0;  // of the square, with all
    uint32_t steps = 1, joined = 0;  // joined: surfaces that connections begin at
    bool first_joined = false;  // z_1 is one

    void visit(const EyeWalk& eye) {
        ++steps;
        if (!scene.materials[eye.surface.material].has_finite) return;
        ++joined;
        if (eye.t == 2) first_joined = true;
    }
    void add(const Contribution& c) {
        const Find find(pass, c, c.s >= 2 ? scale : 1.0f);
        for (uint32_t option = 0; option < k_options; ++option) {
            const uint32_t times = 1u << option, every = max_of(pass.first_times / times, 1u);
            if (c.s >= 2 && c.t == 2 && c.number % every != number % every) continue;
            light[option] += find.with(1.0f / static_cast<float>(every));
        }
        const auto all = static_cast<double>(find.with(1));
        growth += static_cast<double>(find.growth) * all * all;
        growth_unlit += static_cast<double>(find.growth_unlit) * all * all;
    }
};

// Splats that fall on the picture, for h = 1.
struct TriedSplats {
    using Sum = ConnectionSum;

    struct Fallen {
        size_t cell;
        Find find;
    };
    const PassSettings& pass;
    const Cells& cells;
    std::vector<Fallen> fallen{};

    bool wanted(uint32_t i) const { return splats_from(pass, i); }
    bool reaches(Vec2 film) const {
        return film.x >= 0 && film.y >= 0 && film.x < static_cast<float>(cells.width) &&
               film.y < static_cast<float>(cells.height);
    }
    void add(const Splat& splat) { fallen.push_back({cells.at(splat.film), Find(pass, splat.found, 1)}); }
};

struct Round {
    std::vector<TriedPath> paths;  // one of each cell
    std::vector<TriedSplats::Fallen> splats;
    uint32_t light_vertices = 0;
};

uint32_t light_paths_of_round(const PassSettings& pass) { return std::min(pass.light_paths, k_light_paths); }
float light_scale(const PassSettings& pass) {
    return static_cast<float>(pass.light_paths) / static_cast<float>(std::max(light_paths_of_round(pass), 1u));
}

Round run_round(const SceneView& scene, PassSettings pass, const Cells& cells, uint32_t number) {
    pass.seed = hash(k_pilot_stream, 2 + number);
    Round round;
    std::vector<LightVertex> slots(size_t{light_paths_of_round(pass)} * pass.light_path_length);
    TriedSplats splats{pass, cells};
    for (uint32_t path = 0; path < light_paths_of_round(pass); ++path) {
        round.light_vertices +=
            trace_light_path(scene, pass, k_light_stream, 0, path, slots.data() + round.light_vertices, splats);
    }
    round.splats = std::move(splats.fallen);

    std::vector<VlpCandidate> stored;
    const LightVertexCache cache = list_vlps(scene, pass, slots.data(), round.light_vertices, stored);

    round.paths.reserve(cells.count());
    for (size_t i = 0; i < cells.count(); ++i) {
        round.paths.push_back({scene, pass, light_scale(pass), number});
        trace_eye_path(scene, pass, cache, {}, cells.x_of(i), cells.y_of(i), round.paths.back());
    }
    return round;
}

// The integral of h^2, by which splats are noisier than if each fell on one pixel.
double squared_filter(const PassSettings& pass) {
    constexpr int k_steps = 64;
    const float radius = filter_radius(pass.filter, pass.filter_width), step = 2 * radius / k_steps;
    double sum = 0;
    for (int i = 0; i < k_steps; ++i) {
        const auto h = static_cast<double>(
            eval_1d(pass.filter, pass.filter_width, (static_cast<float>(i) + 0.5f) * step - radius));
        sum += h * h * static_cast<double>(step);
    }
    return sum * sum;
}

// What all rounds together tell of either way to render.
class Reckoning {
public:
    Reckoning(const PassSettings& pass, const Cells& cells, const std::vector<Round>& rounds)
        : pass_(pass), cells_(cells), rounds_(rounds), level_(cells.count()) {
        std::vector<double> mean(cells.count());
        for (const Round& round : rounds) {
            for (size_t i = 0; i < mean.size(); ++i) mean[i] += light(round.paths[i], k_options - 1) / k_rounds;
            for (const auto& splat : round.splats) {
                mean[splat.cell] += static_cast<double>(splat.find.with(1)) * splats_in_pixel() / k_rounds;
            }
        }
        for (size_t i = 0; i < level_.size(); ++i) level_[i] = 0.1 + std::max(mean[i], cells.around(i, mean));
    }

    // With F = 2^option, without connections, or without light paths.
    Prospect connected(uint32_t option) const { return prospect(option, TrialWay::connected); }
    Prospect unconnected() const { return prospect(k_options - 1, TrialWay::unconnected); }
    Prospect unlit() const { return prospect(k_options - 1, TrialWay::unlit); }

private:
    Prospect prospect(uint32_t option, TrialWay way) const {
        const bool connected = way == TrialWay::connected;
        const auto count = static_cast<double>(cells_.count());
        Prospect sum;
        // Squares of what falls on the pixels of each cell in an iteration.
        std::vector<double> of_splats(cells_.count());
        double vertices = 0, splats = 0, relative_light = 0;
        for (const Round& round : rounds_) {
            vertices += round.light_vertices / static_cast<double>(k_rounds);
            splats += static_cast<double>(round.splats.size());
            for (const auto& splat : round.splats) relative_light += relative(splat, option);
        }
        // Where few splats fall each is bright, and not by chance.
        const double most = k_most_times * std::max(1.0, splats > 0 ? relative_light / splats : 0.0);
        for (const Round& round : rounds_) {
            for (const auto& splat : round.splats) {
                const double light = std::min(relative(splat, option), most);
                const double growth = 1.0 + static_cast<double>(splat.find.growth_by(way));
                of_splats[splat.cell] += light * light * growth * splats_in_pixel() / k_rounds;
            }
        }
        const bool unlit = way == TrialWay::unlit;  // eye paths find this light
        std::vector<double> variance(cells_.count());
        double weights = 0;
        for (size_t i = 0; i < cells_.count(); ++i) {
            // Adaptive sampling gives a pixel samples by its deviation, so they cost what they do where there is noise.
            variance[i] = relative_variance(i, option, way);
            if (unlit) variance[i] += of_splats[i];
            const double weight = std::sqrt(variance[i]);
            weights += weight, sum.eye_cost += weight * cost(i, connected ? 1u << option : 0);
        }
        sum.eye_cost = weights > 0 ? sum.eye_cost / weights : 1;
        // And what counts is the mean of deviations. Eight rounds say little of one pixel's.
        for (size_t i = 0; i < cells_.count(); ++i) sum.eye_variance += std::sqrt(cells_.around(i, variance)) / count;
        sum.eye_variance *= sum.eye_variance;
        if (unlit) return sum;
        for (const double squares : of_splats) sum.splat_variance += squares / count;
        sum.splat_variance *= squared_filter(pass_);
        sum.light_cost = (light_paths_of_round(pass_) + vertices * k_light_vertex_cost) * splats_in_pixel() / count;
        return sum;
    }

    // What part of the trial's connections at z_1 the option has.
    float kept(uint32_t option) const {
        return min_of(static_cast<float>(1u << option) / static_cast<float>(pass_.first_times), 1.0f);
    }
    double relative(const TriedSplats::Fallen& splat, uint32_t option) const {
        return static_cast<double>(splat.find.with(kept(option))) / level_[splat.cell];
    }
    static double light(const TriedPath& path, uint32_t option) { return static_cast<double>(path.light[option]); }
    // Those that fall on a pixel in an iteration, for each that fell on its cell in a round.
    double splats_in_pixel() const { return static_cast<double>(light_scale(pass_)) / cells_.pixels_each(); }

    // F = `times`; 0: without connections.
    double cost(size_t cell, uint32_t times) const {
        const uint32_t connections = times > 0 ? pass_.vlp_connections : 0;
        double sum = 0;
        for (const Round& round : rounds_) {
            const TriedPath& path = round.paths[cell];
            const uint32_t first = path.first_joined ? 1 : 0;
            sum += path.steps + (path.joined - first) * connection_cost(pass_, connections) +
                   first * connection_cost(pass_, connections * times);
        }
        return sum / k_rounds;
    }
    double relative_variance(size_t cell, uint32_t option, TrialWay way) const {
        double sum = 0, squares = 0, growth = 0;
        for (const Round& round : rounds_) {
            const TriedPath& path = round.paths[cell];
            const double found = light(path, option), counted = std::min(found, k_most_times * level_[cell]);
            sum += counted, squares += counted * counted;
            const double all = way == TrialWay::unconnected ? path.growth : path.growth_unlit;
            growth += all * (counted < found ? (counted / found) * (counted / found) : 1.0);
        }
        double variance = (squares - sum * sum / k_rounds) / (k_rounds - 1);
        if (way != TrialWay::connected) variance += growth / k_rounds;
        return std::max(variance, 0.0) / (level_[cell] * level_[cell]);
    }

    const PassSettings& pass_;
    const Cells& cells_;
    const std::vector<Round>& rounds_;
    std::vector<double> level_;  // mean + 0.1
};

}  // namespace

uint32_t Prospect::best_rounds(uint32_t most) const {
    uint32_t best = 1;
    for (uint32_t rounds = 2; rounds <= most; ++rounds) {
        if (inverse_efficiency(rounds) < inverse_efficiency(best)) best = rounds;
    }
    return best;
}

Trial try_out(const SceneView& scene, PassSettings pass, ThreadPool& pool) {
    const Cells cells(scene.camera);
    const uint32_t options = pass.kappa > 0 ? k_options : 1;
    pass.first_times = 1u << (options - 1);
    std::vector<Round> rounds(k_rounds);
    pool.run(k_rounds, [&](uint32_t i) { rounds[i] = run_round(scene, pass, cells, i); });
    const Reckoning reckoning(pass, cells, rounds);
    Trial trial{{}, reckoning.unconnected(), reckoning.unlit()};
    for (uint32_t option = 0; option < options; ++option) trial.connected.push_back(reckoning.connected(option));
    return trial;
}

}  // namespace vlp
