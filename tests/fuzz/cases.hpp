// Models of chance, valid and broken, and what must hold for each.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace bf::fuzz {

/// What became of a model.
struct Outcome {
    bool is_accepted = false; ///< it was elaborated; a step may fail
    std::uint64_t hash = 0;   ///< of all outputs of its steps, or of the messages that refuse it
    std::string refusal;      ///< the messages that refuse it
    std::string violation;    ///< what must not happen: empty
};

/// A model of standard blocks as YAML. Every third one is right (right_model.hpp), every third has anything
/// anywhere, every third is a text with bytes changed.
std::string model_of(std::uint64_t seed);

/// Reads, elaborates and steps a model. It must be refused with located messages or run; and then twice the
/// same, in another simulation and from a snapshot at an instant that `seed` decides.
Outcome try_model(std::string_view text, std::uint64_t seed);

} // namespace bf::fuzz
