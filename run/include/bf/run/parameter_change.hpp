// New values of parameters on their way into a running simulation.
#pragma once

#include "bf/core/status.hpp"
#include "bf/run/run_c.h"

#include <cstddef>
#include <string>
#include <vector>

namespace bf {

/// A parameter's path and its elements, column by column; one element expands.
struct ParameterValue {
    std::string path;
    std::vector<double> values;
};

/// Made and checked by Run::prepare, in any thread, for Run::apply between two steps. Moves, but no copy: its
/// rows point into its values.
struct ParameterChange {
    ParameterChange() = default;
    ParameterChange(ParameterChange&&) = default;
    ParameterChange& operator=(ParameterChange&&) = default;

    /// Of an interpreted run: swapped in, so that the old values are here afterwards.
    struct Part {
        std::byte* at;
        std::vector<std::byte> bytes;
    };
    std::vector<Part> parts = {};
    struct Place {
        int node, slot;
    };
    std::vector<Place> ordered = {}; ///< parameters that must be at least another, where one of both changes
    /// Of generated code.
    std::vector<ParameterValue> values = {};
    std::vector<bf_run_value> rows = {};

    /// Written by Run::apply, which cannot allocate, where its status does not say all.
    char refusal[300] = "";
    /// Why Run::apply refused these values with that status.
    std::string why_refused(const Status& status) const { return *refusal ? refusal : status.text(); }
};

} // namespace bf
