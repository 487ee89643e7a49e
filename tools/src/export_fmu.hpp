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
    /// NAME=2,4,8 or NAME=1:8: variables of the model that become structural parameters, and their values.
    std::vector<std::string> structural = {};

    void add_to(CLI::App& app);
};

struct MadeFmu {
    fmi::Description description;
    fmi::Contents contents; ///< of its archive
};

/// A model, and the values of structural parameters for which it is that.
struct FmuVariant {
    LoadedModel loaded;
    std::vector<std::uint64_t> structure = {};
};

/// Of a model, or of the same with other values of structural parameters, of which the first one is that of
/// the description. Throws codegen::GenerationError for what cannot be exported, CommandError where the
/// compiler fails.
MadeFmu make_fmu(const std::vector<FmuVariant>& variants, const FmuOptions& options);

/// How FMUs have a quantity of that type and size: a column as an array, one number without dimensions.
fmi::Type type_of(Type type);
std::vector<int> dimensions_of(int rows, int cols);

} // namespace bf::tools
