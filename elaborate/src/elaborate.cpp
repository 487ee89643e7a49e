#include "bf/elaborate/elaborate.hpp"

#include "stages.hpp"

namespace bf {

Diagram elaborate(const model::Model& model, Registry& registry, const ElaborateOptions& options) {
    elaboration::Elaboration e{model, registry, options, {}, {}, {}, {}, {}, {}};
    for (const auto stage : {elaboration::flatten, elaboration::wire, elaboration::infer_shapes,
                             elaboration::assign_rates, elaboration::sort}) {
        stage(e);
        // Wiring is checked even where blocks are wrong: mistakes rarely come alone.
        if (stage != elaboration::flatten) e.report.throw_if_any();
    }
    return std::move(e.diagram);
}

} // namespace bf
