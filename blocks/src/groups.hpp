// The groups that make up the standard library.
#pragma once

#include "bf/core/registry.hpp"

namespace bf::blocks {

void add_sources(Library& library);
void add_generators(Library& library);
void add_random(Library& library);
void add_arithmetic(Library& library);
void add_functions(Library& library);
void add_formulas(Library& library);
void add_matrices(Library& library);
void add_vectors(Library& library);
void add_linear_algebra(Library& library);
void add_geometry(Library& library);
void add_tables(Library& library);
void add_signals(Library& library);
void add_conversion(Library& library);
void add_control(Library& library);
void add_logic(Library& library);
void add_edges(Library& library);
void add_bits(Library& library);
void add_checks(Library& library);
void add_state_machine(Library& library);
void add_discontinuities(Library& library);
void add_discrete(Library& library);
void add_integrators(Library& library);
void add_discrete_systems(Library& library);
void add_discrete_pid(Library& library);
void add_continuous(Library& library);
void add_limited_integrators(Library& library);
void add_past(Library& library);

} // namespace bf::blocks
