#include "bf/elaborate/elaborate.hpp"

#include "stages.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

namespace bf {

namespace elaboration {

void Report::throw_if_any() {
    if (diagnostics_.empty()) return;
    std::vector<std::string> files; // in the order in which they are first spoken of
    const auto place = [&](const model::Diagnostic& d) {
        constexpr auto last = std::numeric_limits<std::size_t>::max();
        if (!d.where || !d.where.file) return std::tuple(last, 0, 0);
        auto file = std::find(files.begin(), files.end(), *d.where.file);
        if (file == files.end()) file = files.insert(file, *d.where.file);
        return std::tuple(static_cast<std::size_t>(file - files.begin()), d.where.line, d.where.column);
    };
    for (const auto& diagnostic : diagnostics_) place(diagnostic);
    std::stable_sort(diagnostics_.begin(), diagnostics_.end(),
                     [&](const auto& a, const auto& b) { return place(a) < place(b); });
    throw model::Errors(std::move(diagnostics_));
}

} // namespace elaboration

Diagram elaborate(const model::Model& model, Registry& registry, const ElaborateOptions& options) {
    elaboration::Elaboration e{model, registry, options};
    for (const auto stage :
         {elaboration::flatten, elaboration::bind_resources, elaboration::wire, elaboration::infer_shapes,
          elaboration::name_elements, elaboration::assign_rates, elaboration::sort}) {
        stage(e);
        // Wiring is checked even where blocks are wrong: mistakes rarely come alone.
        if (stage != elaboration::flatten && stage != elaboration::bind_resources) e.report.throw_if_any();
    }
    return std::move(e.diagram);
}

} // namespace bf
