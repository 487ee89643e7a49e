// The groups that make up the standard library.
#pragma once

#include "bf/core/registry.hpp"

namespace bf::blocks {

void add_sources(Library& library);
void add_arithmetic(Library& library);
void add_functions(Library& library);
void add_matrices(Library& library);
void add_linear_algebra(Library& library);
void add_geometry(Library& library);
void add_signals(Library& library);
void add_control(Library& library);
void add_logic(Library& library);
void add_nonlinear(Library& library);
void add_checks(Library& library);
void add_discrete(Library& library);
void add_integrators(Library& library);
void add_continuous(Library& library);

} // namespace bf::blocks
