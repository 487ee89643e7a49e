// New values of parameters on their way into a running simulation.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace bf {

/// A parameter's path and its elements, column by column; one element expands.
struct ParameterValue {
    std::string path;
    std::vector<double> values;
};

/// Made and checked by Simulation::prepare, in any thread; Simulation::apply swaps it in between two steps
/// and so leaves the old values here.
struct ParameterChange {
    struct Part {
        std::byte* at;
        std::vector<std::byte> bytes;
    };
    std::vector<Part> parts;
};

} // namespace bf
