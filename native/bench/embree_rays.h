// The same rays through Embree's single-ray API, for comparison (only where its library is).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bench/ray_scenes.h"

namespace vlp::bench {

class EmbreeScene {
public:
    EmbreeScene(const BenchScene& scene, unsigned threads);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    float closest(const Ray& ray) const;  // t; infinity: nothing
    bool occluded(const Ray& ray) const;
    static std::string version();
    double build_seconds() const { return build_seconds_; }

private:
    struct Handles;
    std::unique_ptr<Handles> handles_;
    double build_seconds_ = 0;
};

}  // namespace vlp::bench
