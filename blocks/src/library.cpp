#include "bf/blocks/standard.hpp"

#include "groups.hpp"

namespace bf {

Library standard_library() {
    Library library("");
    for (const auto add :
         {blocks::add_sources, blocks::add_arithmetic, blocks::add_functions, blocks::add_matrices,
          blocks::add_linear_algebra, blocks::add_geometry, blocks::add_signals, blocks::add_control,
          blocks::add_logic, blocks::add_nonlinear, blocks::add_checks, blocks::add_discrete,
          blocks::add_integrators, blocks::add_continuous})
        add(library);
    return library;
}

} // namespace bf
