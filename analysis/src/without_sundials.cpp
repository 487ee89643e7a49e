#include "bf/analysis/trim.hpp"

namespace bf::analysis {

TrimResult trim(Simulation&, const TrimOptions&) {
    throw RunError(
        "this program was built without SUNDIALS, which finds operating points; build with -DBF_SUNDIALS=ON");
}

} // namespace bf::analysis
