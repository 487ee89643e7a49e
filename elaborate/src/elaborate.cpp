#include "bf/elaborate/elaborate.hpp"

#include "stages.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <tuple>

namespace bf {

namespace elaboration {

model::Location place_of_row(const model::Block& block, const std::string& message) {
    for (const auto& [name, value, where] : block.settings) {
        const std::string words = "'" + name + "', row ";
        const std::size_t found = message.find(words);
        if (found == message.npos) continue;
        std::size_t row = 0;
        const char* const number = message.data() + found + words.size();
        std::from_chars(number, message.data() + message.size(), row);
        if (row >= 1 && row <= value.rows.size() && value.rows[row - 1]) return value.rows[row - 1];
        if (value.where) return value.where;
    }
    return block.where;
}

void Report::throw_if_any() {
    if (!diagnostics_.empty()) throw model::Errors(take());
}

std::vector<model::Diagnostic> Report::take() {
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
    return std::move(diagnostics_);
}

} // namespace elaboration

std::set<std::filesystem::path> named_files(const Arguments& arguments) {
    std::set<std::filesystem::path> files;
    const auto add = [&](const std::string& text) {
        std::error_code ignored;
        const auto file =
            std::filesystem::weakly_canonical(std::filesystem::path(arguments.folder) / text, ignored);
        const auto status = std::filesystem::status(file, ignored);
        if (!text.empty() && std::filesystem::exists(status) && !std::filesystem::is_directory(status))
            files.insert(file);
    };
    for (const auto& [name, value] : arguments) {
        if (value.kind == Value::Kind::text) add(value.text);
        for (const auto& text : value.texts) add(text);
    }
    return files;
}

Examined examine(const model::Model& model, Registry& registry, const ElaborateOptions& options) {
    elaboration::Elaboration e{model, registry, options};
    try {
        elaboration::flatten(e);
    } catch (const model::Errors& errors) { // without its plugins, or too large: nothing is known
        return {Diagram{}, errors.diagnostics()};
    }
    elaboration::bind_resources(e);
    elaboration::wire(e);
    elaboration::infer_shapes(e);
    elaboration::check_claims(e);
    if (e.report.is_empty()) elaboration::name_elements(e);
    elaboration::assign_rates(e);
    // Shapes that depend on a loop have been reported with it.
    if (e.report.is_empty() || e.diagram.plan.outputs.empty()) elaboration::sort(e);
    return {std::move(e.diagram), e.report.take()};
}

Diagram elaborate(const model::Model& model, Registry& registry, const ElaborateOptions& options) {
    Examined elaborated = examine(model, registry, options);
    if (!elaborated.diagnostics.empty()) throw model::Errors(std::move(elaborated.diagnostics));
    return std::move(elaborated.diagram);
}

} // namespace bf
