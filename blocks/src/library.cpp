#include "bf/blocks/standard.hpp"

#include "groups.hpp"

namespace bf {

Library standard_library() {
    Library library("");
    for (const auto add : {blocks::add_sources,
                           blocks::add_generators,
                           blocks::add_random,
                           blocks::add_arithmetic,
                           blocks::add_functions,
                           blocks::add_formulas,
                           blocks::add_matrices,
                           blocks::add_vectors,
                           blocks::add_linear_algebra,
                           blocks::add_geometry,
                           blocks::add_tables,
                           blocks::add_signals,
                           blocks::add_conversion,
                           blocks::add_control,
                           blocks::add_logic,
                           blocks::add_edges,
                           blocks::add_bits,
                           blocks::add_checks,
                           blocks::add_discontinuities,
                           blocks::add_discrete,
                           blocks::add_integrators,
                           blocks::add_discrete_systems,
                           blocks::add_discrete_pid,
                           blocks::add_continuous,
                           blocks::add_limited_integrators,
                           blocks::add_past})
        add(library);
    return library;
}

} // namespace bf
