// The two forms of the eye pass on a GPU, and which of them is taken. They make the same picture.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace vlp {

enum class EyeForm : uint8_t {
    paths,      // one kernel, in which a thread traces all paths of a pixel
    wavefront,  // kernels for the steps of many paths, see wavefront.h
};

inline constexpr const char* k_eye_form_names[] = {"paths", "wavefront"};

// The form that the environment variable VLP_BPT_GPU_EYE_PASS names, for tests and for the same bits on every run: the
// forms round in different places. None where it is empty; throws std::runtime_error for any other name.
inline std::optional<EyeForm> forced_eye_form() {
    const char* const name = std::getenv("VLP_BPT_GPU_EYE_PASS");
    if (!name || *name == '\0') return {};
    for (const EyeForm form : {EyeForm::paths, EyeForm::wavefront}) {
        if (std::string_view(name) == k_eye_form_names[static_cast<size_t>(form)]) return form;
    }
    throw std::runtime_error(std::string("VLP_BPT_GPU_EYE_PASS='") + name + "': must be paths or wavefront");
}

// Finds out the faster form by running them in turn: the first iteration warms up, and of the two times that each form has
// after that the less counts.
class EyeFormChoice {
public:
    EyeFormChoice() = default;
    explicit EyeFormChoice(EyeForm always) : trials_(k_trials), best_(always) {}

    // Whether the next iteration is to be timed.
    bool is_open() const { return trials_ < k_trials; }
    EyeForm next() const { return is_open() ? static_cast<EyeForm>(trials_ % 2) : best_; }
    // The eye pass of an iteration took `seconds` in the form that was next.
    void took(double seconds) {
        double& least = seconds_[static_cast<size_t>(next())];
        if (trials_ > 0 && (least == 0 || seconds < least)) least = seconds;
        if (++trials_ == k_trials) best_ = seconds_[1] < seconds_[0] ? EyeForm::wavefront : EyeForm::paths;
    }

private:
    static constexpr uint32_t k_trials = 5;

    uint32_t trials_ = 0;  // so far
    double seconds_[2]{};
    EyeForm best_ = EyeForm::paths;
};

}  // namespace vlp
