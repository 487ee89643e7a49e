// Models as FMUs, alone and as the parts of systems.
#pragma once

#include "bf/fmi/archive.hpp"
#include "session.hpp"

#include <string>
#include <vector>

namespace bf::tools {

struct FmuOptions {
    int version = 3;                       ///< of the standard
    bool has_clocks = false;               ///< for its rates
    std::vector<std::string> targets = {}; ///< machines that it has binaries for; empty: this one
    bool has_no_binary = false;

    void add_to(CLI::App& app);
};

struct MadeFmu {
    fmi::Description description;
    fmi::Contents contents; ///< of its archive
};

/// Throws codegen::GenerationError for what cannot be exported, CommandError where the compiler fails.
MadeFmu make_fmu(const LoadedModel& loaded, const FmuOptions& options);

/// How FMUs have a quantity of that type and size: a column as an array, one number without dimensions.
fmi::Type type_of(Type type);
std::vector<int> dimensions_of(int rows, int cols);

} // namespace bf::tools
