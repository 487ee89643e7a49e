#include "adjustable.hpp"

#include "bf/base/elements.hpp"
#include "bf/base/names.hpp"
#include "bf/elaborate/tuning.hpp"
#include "named.hpp"

#include <algorithm>
#include <numeric>

namespace bf::analysis {

Adjustables::Adjustables(const Simulation& run) : run_(run) {
    const auto present = run.variables();
    for (const auto& variable : Tuning(run.diagram()).variables()) {
        const auto its = std::find_if(present.begin(), present.end(),
                                      [&](const auto& one) { return one.path == variable.path; });
        if (its != present.end() && !its->values.empty())
            all_.push_back({*its, true, variable.rows, variable.cols, variable.limits, variable.fixed});
    }
    for (const auto& parameter : run.parameters())
        if (parameter.type == Type::float64) {
            const auto end = run.diagram().find_parameter(parameter.path);
            all_.push_back({{parameter.path, parameter.values()},
                            false,
                            static_cast<int>(parameter.info.rows),
                            static_cast<int>(parameter.info.cols),
                            end.node < 0 ? Limits() : run.diagram().slot(end).limits});
        }
}

const Adjustable* Adjustables::find(const std::string& path) const {
    const auto found =
        std::find_if(all_.begin(), all_.end(), [&](const auto& one) { return one.given.path == path; });
    return found == all_.end() ? nullptr : &*found;
}

std::pair<const Adjustable*, std::vector<std::size_t>> Adjustables::named(const std::string& name) const {
    const auto* found = find(name);
    std::string element;
    if (const auto bracket = name.find('['); !found && bracket != name.npos) {
        found = find(name.substr(0, bracket));
        element = name.substr(bracket);
    }
    if (!found) return {};
    const auto& [path, values] = found->given;
    if (!found->fixed.empty()) throw RunError("'" + path + "' is fixed: " + found->fixed);
    std::vector<std::size_t> all(values.size());
    std::iota(all.begin(), all.end(), 0);
    if (element.empty()) return {found, all};
    const auto end = found->is_variable ? Node::End() : run_.diagram().find_parameter(path);
    for (const auto i : all) {
        const auto e = static_cast<int>(i);
        if (element == "[" + std::to_string(i + 1) + "]" ||
            (all.size() > 1 && element == (end.node < 0 ? element_text(found->rows, found->cols, e)
                                                        : run_.diagram().element_text(end, e))))
            return {found, {i}};
    }
    throw RunError("'" + path + "' has no element " + element + "; it has " + std::to_string(all.size()) +
                   (all.size() == 1
                        ? ""
                        : ", from " + this->name(*found, 0) + " to " + this->name(*found, all.size() - 1)));
}

std::string Adjustables::name(const Adjustable& number, std::size_t element) const {
    const auto& path = number.given.path;
    const auto e = static_cast<int>(element);
    if (number.given.values.size() == 1) return path;
    if (!number.is_variable)
        return path + run_.diagram().element_text(run_.diagram().find_parameter(path), e);
    return path +
           (number.rows == 1 ? element_text(number.cols, 1, e) : element_text(number.rows, number.cols, e));
}

std::string Adjustables::nearest(const std::string& name) const {
    std::vector<std::string> known;
    for (const auto& one : all_) {
        // A group of variables is none of them itself.
        if (one.given.path.starts_with(name + ".")) return "; did you mean '" + one.given.path + "'?";
        known.push_back(one.given.path);
    }
    return did_you_mean(name, known);
}

std::vector<ParameterValue> Adjustables::follow(const std::vector<ParameterValue>& asked) const {
    try {
        return run_.follow(asked);
    } catch (const RunError&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw RunError(error.what());
    }
}

} // namespace bf::analysis
